"""Ground under an axle and strut above it at one instant."""

from typing import NamedTuple

from numba.extending import register_jitable

from tasks.vehicle.effects.chassis import find_contact
from tasks.vehicle.effects.equations import compute_strut_force
from tasks.vehicle.effects.table import EffectValues
from tasks.vehicle.half_car import HalfCarState, compute_contact_load
from tasks.vehicle.model.chassis import Chassis
from tasks.vehicle.road import RoadFeature


class Ground(NamedTuple):
    """Road height [m] and slope [m/m] under an axle, and its contact load, never negative [N]."""

    height: float
    slope: float
    load: float


class Strut(NamedTuple):
    """Travel [m] and rate [m/s] of an axle's strut, rebound positive, and its force [N]."""

    travel: float
    rate: float
    force: float


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_ground(
    station: float,
    speed: float,
    unsprung_height: float,
    unsprung_rate: float,
    stiffness: float,
    static_load: float,
    road: RoadFeature,
    effects: EffectValues,
) -> Ground:
    """Return road height, slope and contact load under one axle.

    Parameters
    ----------
    station : route position of the axle [m]
    speed : speed of the vehicle [m/s]
    unsprung_height, unsprung_rate : height of the axle and its rate, about static equilibrium [m, m/s]
    stiffness : vertical stiffness of the tyre, k_t [N/m]
    static_load : contact load of the half-car at rest [N]
    road : road feature
    effects : numbers of the vehicle's effects
    """
    height, slope = find_contact(station, road, effects)
    load = compute_contact_load(height, unsprung_height, stiffness, static_load)
    if load > 0.0:
        load = max(load + effects.tyre_damping * (speed * slope - unsprung_rate), 0.0)
    return Ground(height, slope, load)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_struts(x: HalfCarState, chassis: Chassis) -> tuple[Strut, Strut]:
    """Return travel, rate and force of the struts of the front and the rear axle.

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    chassis : the vehicle on its surface
    """
    body, effects = chassis.body, chassis.effects
    travel_f, rate_f = x[0] - x[2] - body.to_front * x[1], x[4] - x[6] - body.to_front * x[5]
    travel_r, rate_r = x[0] - x[3] + body.to_rear * x[1], x[4] - x[7] + body.to_rear * x[5]
    return (
        Strut(travel_f, rate_f, compute_strut_force(effects, body.spring_f, body.damper_f, travel_f, rate_f)),
        Strut(travel_r, rate_r, compute_strut_force(effects, body.spring_r, body.damper_r, travel_r, rate_r)),
    )
