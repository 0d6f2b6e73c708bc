"""The vehicle on its surface, in the form that the kernels of the model take."""

from dataclasses import dataclass
from typing import NamedTuple

from tasks.surface.road_profile import FLAT_ROAD, LEVEL_ROAD, RoadGrade, RoadHazard
from tasks.surface.wet_friction import ANY_SPEED, WetGrip
from tasks.vehicle.effects.table import EffectValues, pack_effect_values
from tasks.vehicle.half_car import HalfCar, build_half_car
from tasks.vehicle.paper.wheels import Wheels, build_wheels
from tasks.vehicle.parameters import SurfaceResponse, Vehicle


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Conditions of a run, beside its surface.

    Parameters
    ----------
    hazard : road feature
    snow_depth_mm : depth of the snow on the road [mm]
    grade : rise of the road along the route, over the stations of the run
    direction : +1 along the route, -1 against it
    disc_rise : temperature of the discs above ambient at the start [K]
    grip : how friction depends on speed
    """

    hazard: RoadHazard = FLAT_ROAD
    snow_depth_mm: float = 0.0
    grade: RoadGrade = LEVEL_ROAD
    direction: int = 1
    disc_rise: float = 0.0
    grip: WetGrip = ANY_SPEED


class Chassis(NamedTuple):
    """The whole vehicle on its surface, except the tyre's curve.

    Parameters
    ----------
    body : the half-car
    wheels : wheels, brakes and longitudinal values
    lever : height of the body's centre of gravity above the wheel centres [m]
    lock_speed : wheel speed below which brake friction is proportional to it [rad/s]
    transfer : height of the centre of gravity over the wheelbase [1]
    effects : numbers of its effects; a tuple, since numba counts references of arrays at every call
    wet : 1 on a wet road, else 0 [1]
    snow_depth_mm : depth of the snow on the road [mm]
    direction : +1 along the route, -1 against it; the wind blows along the route [1]
    grip : how the friction of a wet road depends on speed
    """

    body: HalfCar
    wheels: Wheels
    lever: float
    lock_speed: float
    transfer: float
    effects: EffectValues
    wet: float
    snow_depth_mm: float
    direction: float
    grip: WetGrip


def build_chassis(vehicle: Vehicle, response: SurfaceResponse, conditions: Conditions) -> Chassis:
    """Return the values of a vehicle on a surface that the model needs.

    ``cg_height`` is that of the whole vehicle; the axles' centres of gravity are at wheel height.

    Parameters
    ----------
    vehicle : the vehicle
    response : its tyres on the surface
    conditions : conditions of the run
    """
    axles = vehicle.unsprung_mass_f + vehicle.unsprung_mass_r
    body_height = (vehicle.mass * vehicle.cg_height - axles * vehicle.wheel_radius) / vehicle.sprung_mass
    return Chassis(
        body=build_half_car(vehicle),
        wheels=build_wheels(vehicle),
        lever=body_height - vehicle.wheel_radius,
        lock_speed=vehicle.lock_speed,
        transfer=vehicle.cg_height / vehicle.wheelbase,
        effects=pack_effect_values(vehicle.effects),
        wet=float(response.wet),
        snow_depth_mm=float(conditions.snow_depth_mm),
        direction=float(conditions.direction),
        grip=WetGrip(*map(float, conditions.grip)),
    )
