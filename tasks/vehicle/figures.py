"""Figures of a vehicle that engineers compare cars by: loads, frequencies, damping, and how hard it brakes.

Body and wheels are taken one at a time, each with the others held still (Gillespie 1992, Fundamentals of Vehicle
Dynamics, SAE R-114, chapter 5); the modes of the whole half-car lie some per cent beside them.
"""

from collections.abc import Callable, Mapping
from math import degrees, nan, pi, sqrt
from typing import NamedTuple

from tasks.vehicle.effects.equations import (
    compute_engine_torque,
    compute_resistance,
    compute_rolling_resistance,
)
from tasks.vehicle.effects.table import pack_effect_values
from tasks.vehicle.parameters import Vehicle

COASTING_SPEED = 60 / 3.6
"""Speed of the figure of the road load [m/s]."""


def compute_ride_rate(spring: float, tyre: float) -> float:
    """Return the ride rate: the stiffness of an axle's suspension and tyres in series [N/m].

    Parameters
    ----------
    spring, tyre : k_s and k_t of the axle [N/m]
    """
    return spring * tyre / (spring + tyre)


def compute_ride_damping(damper: float, spring: float, tyre: float) -> float:
    """Return the damping that the body feels above its tyres [N s/m].

    The damper sees the share k_t / (k_s + k_t) of the body's motion, and this share of its force reaches the body.

    Parameters
    ----------
    damper : c_s of the axle [N s/m]
    spring, tyre : k_s and k_t of the axle [N/m]
    """
    return damper * (tyre / (spring + tyre)) ** 2


def compute_natural_frequency(stiffness: float, inertia: float) -> float:
    """Return the undamped natural frequency of one degree of freedom [Hz].

    Parameters
    ----------
    stiffness : [N/m], or [N m/rad] of a rotation
    inertia : [kg], or [kg m2] of a rotation
    """
    return sqrt(stiffness / inertia) / (2.0 * pi)


def compute_damping_ratio(stiffness: float, damping: float, inertia: float) -> float:
    """Return the damping of one degree of freedom over its critical damping [1].

    Parameters
    ----------
    stiffness : [N/m], or [N m/rad] of a rotation
    damping : [N s/m], or [N m s/rad] of a rotation
    inertia : [kg], or [kg m2] of a rotation
    """
    return damping / (2.0 * sqrt(stiffness * inertia))


def compute_heave_constants(vehicle: Vehicle) -> tuple[float, float]:
    """Return stiffness [N/m] and damping [N s/m] of the body's vertical motion, both axles together."""
    return _sum_axles(vehicle, 1.0, 1.0)


def compute_pitch_constants(vehicle: Vehicle) -> tuple[float, float]:
    """Return stiffness [N m/rad] and damping [N m s/rad] of the body's pitch about its centre of gravity."""
    return _sum_axles(vehicle, vehicle.cg_to_front_axle**2, vehicle.cg_to_rear_axle**2)


def _sum_axles(v: Vehicle, front: float, rear: float) -> tuple[float, float]:
    """Return the ride rates and the ride damping summed over both axles, each axle with its weight."""
    return (
        front * compute_ride_rate(v.suspension_stiffness_f, v.tyre_stiffness_f)
        + rear * compute_ride_rate(v.suspension_stiffness_r, v.tyre_stiffness_r),
        front * compute_ride_damping(v.suspension_damping_f, v.suspension_stiffness_f, v.tyre_stiffness_f)
        + rear * compute_ride_damping(v.suspension_damping_r, v.suspension_stiffness_r, v.tyre_stiffness_r),
    )


def compute_dynamic_index(vehicle: Vehicle) -> float:
    """Return the pitch inertia over that of two masses above the axles, same centre, I_y / (m_s l_f l_r) [1]."""
    return vehicle.pitch_inertia / (vehicle.sprung_mass * vehicle.cg_to_front_axle * vehicle.cg_to_rear_axle)


def compute_deceleration_per_pressure(vehicle: Vehicle) -> float:
    """Return the deceleration that a pressure gives while no wheel slides, K_p / (R m) [m/s2/MPa]."""
    return vehicle.brake_gain / (vehicle.wheel_radius * vehicle.mass)


def compute_peak_deceleration(vehicle: Vehicle) -> float:
    """Return the deceleration at the tyre's peak on the best surface of the vehicle's tables, mu g [m/s2]."""
    peaks = [
        friction * efficiency
        for family in vehicle.families.values()
        for friction, efficiency in zip(family.surface_friction, family.efficiency, strict=True)
    ]
    return max(peaks) * vehicle.gravity


def compute_road_load(vehicle: Vehicle) -> float:
    """Return the deceleration at which a car coasts at `COASTING_SPEED` on a level dry road [m/s2].

    Parameters
    ----------
    vehicle : the vehicle, whose effects roll, meet the air and drag; its wheels add their inertia to the mass
    """
    v, effects, speed = vehicle, pack_effect_values(vehicle.effects), COASTING_SPEED
    rolling = compute_rolling_resistance(effects, speed) * v.gravity
    engine = compute_engine_torque(effects, speed / v.wheel_radius, v.wheel_radius)
    force = v.mass * (v.coast_deceleration + rolling) + compute_resistance(effects, speed, 1.0, 0.0)
    force += (engine + effects.pad_drag) / v.wheel_radius
    return force / (v.mass + (v.wheel_inertia_f + v.wheel_inertia_r) / v.wheel_radius**2)


def compute_dive_gradient(vehicle: Vehicle) -> float:
    """Return the steady pitch for each g of braking [deg], from the load transfer on springs, links and tyres.

    Parameters
    ----------
    vehicle : the vehicle, whose anti-dive and anti-lift pass a part of the load transfer beside the springs
    """
    v, effects = vehicle, pack_effect_values(vehicle.effects)
    transfer = v.mass * v.gravity * v.cg_height / v.wheelbase
    through_f = 1.0 - effects.anti_dive * v.front_brake_share
    through_r = 1.0 - effects.anti_lift * (1.0 - v.front_brake_share)
    springs = through_f / v.suspension_stiffness_f + through_r / v.suspension_stiffness_r
    tyres = 1.0 / v.tyre_stiffness_f + 1.0 / v.tyre_stiffness_r
    return degrees(transfer * (springs + tyres) / v.wheelbase)


class Figure(NamedTuple):
    """One figure: its unit, as catalogue files write it, and the function that computes it."""

    unit: str
    compute: Callable[[Vehicle], float]


FIGURES: Mapping[str, Figure] = {
    "mass": Figure("kg", lambda v: v.mass),
    "unsprung_share": Figure("1", lambda v: (v.unsprung_mass_f + v.unsprung_mass_r) / v.mass),
    "wheelbase": Figure("m", lambda v: v.wheelbase),
    "static_front_load": Figure("N", lambda v: v.static_axle_loads[0]),
    "static_rear_load": Figure("N", lambda v: v.static_axle_loads[1]),
    "static_front_share": Figure("1", lambda v: v.static_axle_loads[0] / sum(v.static_axle_loads)),
    "cg_height_over_wheelbase": Figure("1", lambda v: v.cg_height / v.wheelbase),
    "dynamic_index": Figure("1", compute_dynamic_index),
    "heave_frequency": Figure(
        "Hz", lambda v: compute_natural_frequency(compute_heave_constants(v)[0], v.sprung_mass)
    ),
    "heave_damping_ratio": Figure(
        "1", lambda v: compute_damping_ratio(*compute_heave_constants(v), v.sprung_mass)
    ),
    "pitch_frequency": Figure(
        "Hz", lambda v: compute_natural_frequency(compute_pitch_constants(v)[0], v.pitch_inertia)
    ),
    "pitch_damping_ratio": Figure(
        "1", lambda v: compute_damping_ratio(*compute_pitch_constants(v), v.pitch_inertia)
    ),
    "wheel_hop_frequency_f": Figure(
        "Hz",
        lambda v: compute_natural_frequency(v.suspension_stiffness_f + v.tyre_stiffness_f, v.unsprung_mass_f),
    ),
    "wheel_hop_frequency_r": Figure(
        "Hz",
        lambda v: compute_natural_frequency(v.suspension_stiffness_r + v.tyre_stiffness_r, v.unsprung_mass_r),
    ),
    "wheel_radius": Figure("m", lambda v: v.wheel_radius),
    "wheel_inertia_f": Figure("kg m2", lambda v: v.wheel_inertia_f),
    "wheel_inertia_r": Figure("kg m2", lambda v: v.wheel_inertia_r),
    "deceleration_per_pressure": Figure("m s-2 MPa-1", compute_deceleration_per_pressure),
    "front_brake_share": Figure("1", lambda v: v.front_brake_share),
    "peak_deceleration": Figure("m s-2", compute_peak_deceleration),
    "coast_deceleration": Figure("m s-2", lambda v: v.coast_deceleration),
    "road_load": Figure("m s-2", compute_road_load),
    "dive_gradient": Figure("deg", compute_dive_gradient),
    "gravity": Figure("m s-2", lambda v: v.gravity),
}
"""Every figure by its name, in the order in which people read them."""


def compute_figures(vehicle: Vehicle) -> dict[str, float]:
    """Return the value of every figure by its name; NaN where the vehicle's numbers are too small or large for it.

    Parameters
    ----------
    vehicle : the vehicle
    """
    values: dict[str, float] = {}
    for name, figure in FIGURES.items():
        try:
            values[name] = figure.compute(vehicle)
        except (ZeroDivisionError, OverflowError):
            values[name] = nan
    return values
