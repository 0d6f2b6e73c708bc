"""The car as one record of numbers: the catalogue's vehicle, what is declared for the car, and effects on top."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.double_track.declared import read_declared, read_vehicle, values_of

EFFECTS = (
    "drag_area", "wind_speed", "rolling_coefficient", "rolling_speed", "ploughing", "creep_force", "creep_speed",
    "engine_torque", "engine_viscous", "pad_drag", "lag", "dead_time", "push_out", "pressure_curve", "fade",
    "pad_speed", "pad_speed_reference", "bias_pressure", "load_sensitivity", "tyre_heating", "wet_speed",
    "wet_threshold", "damper_asymmetry", "coulomb_friction", "progressive_rate", "aero_lift",
)  # fmt: skip
"""Effects that the equations of motion read as they are; 0 is the plain car."""
RETUNES = ("pressure_gain", "mass", "stiffness", "damping", "wheel_radius", "friction", "pitch_gain")
"""Relative changes of the car's own numbers."""
SENSORS = (
    "speed_scale", "wheel_speed_scale", "gravity_leak", "mount_tilt", "pitch_delay", "speed_delay",
    "acceleration_delay",
)  # fmt: skip
CHANGES = ("wheel_inertia", "relaxation_length", "anti_dive", "anti_lift", "stop_stiffness", "stop_clearance")
"""Effects that change a number of the car."""
KNOWN = frozenset((*EFFECTS, *RETUNES, *SENSORS, *CHANGES))

_SCALARS = (
    "gravity", "air_density", "body_mass", "pitch_inertia", "roll_inertia", "wheelbase", "body_lever", "drag_lever",
    "radius", "coast", "roll_stiffness", "damper_knee", "stop_clearance", "stop_stiffness", "stop_growth",
    "fore_aft_stiffness", "fore_aft_damping", "migration", "dry_friction_speed", "load_exponent",
    "stiffness_by_load", "tyre_damping", "slow_speed", "tyre_cooling", "brake_gain", "front_share", "disc_cooling",
    "disc_cooling_by_speed", "lock_speed", "push_out_width", "release_lag_ratio", "pad_drag_front",
    "peak", "slip_stiffness", "shape", "curvature", "wet", "snow_depth_mm", "direction", "grade", "hazard_center",
    "hazard_length", "hazard_height",
)  # fmt: skip
_BY_WHEEL = (
    "ahead", "aside", "wheel_mass", "wheel_inertia", "spring", "damper", "tyre_stiffness", "static_load", "tangent",
    "relaxation",
)  # fmt: skip
CAR = np.dtype(
    [(name, "f8") for name in (*_SCALARS, *EFFECTS)]
    + [(name, "f8", (4,)) for name in _BY_WHEEL]
    + [("disc_capacity", "f8", (2,))]
)
"""A car on its surface, as the compiled equations read it; wheels are fl, fr, rl, rr."""


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """Circumstances of one run.

    Parameters
    ----------
    surface : row of car.yaml
    direction : +1 along the route, -1 against it
    grade : rise of the road along the route [1]
    hazard : centre, length, height of a raised cosine [m]
    """

    surface: Mapping[str, Any]
    direction: int = 1
    grade: float = 0.0
    hazard: tuple[float, float, float] = (0.0, 0.0, 0.0)


def build_car(effects: Mapping[str, float], around: Surroundings) -> NDArray[np.void]:
    """The car with its effects on a surface, one record of `CAR` in an array of shape (1,).

    Parameters
    ----------
    effects : by name, on top of the plain car; sensors are left to the instruments
    around : circumstances of the run

    Raises
    ------
    ValueError
        For names that the car does not know.
    """
    if unknown := set(effects) - KNOWN:
        raise ValueError(f"the car has no {', '.join(sorted(unknown))}; it has {', '.join(sorted(KNOWN))}")
    declared = read_declared("car")
    catalogue, own = read_vehicle(declared["vehicle"]), values_of(declared)
    for group in ("body", "suspension", "tyre", "brakes"):
        own |= values_of(declared[group])
    change = {name: 1.0 + effects.get(name, 0.0) for name in RETUNES}
    record = np.zeros(1, CAR)
    car = record[0]
    radius = catalogue["wheel_radius"] * change["wheel_radius"]
    _place_masses(car, catalogue, own, change, catalogue["wheel_radius"])
    _hang_wheels(car, catalogue, own, change, effects)
    car["radius"] = radius
    car["brake_gain"] = catalogue["brake_gain"] * change["pressure_gain"]
    car["front_share"] = catalogue["front_brake_share"]
    car["coast"] = catalogue["coast_deceleration"]
    car["disc_capacity"] = own["disc_capacity_front"], own["disc_capacity_rear"]
    car["pad_drag_front"] = own["pad_drag_front_share"]
    car["roll_stiffness"] = own["anti_roll_stiffness"]
    car["damper_knee"], car["migration"] = own["damper_knee_speed"], own["swing_arm_migration"]
    car["tyre_damping"] = own["vertical_damping"]
    for name in (
        "air_density", "stop_growth", "fore_aft_stiffness", "fore_aft_damping", "dry_friction_speed", "load_exponent",
        "stiffness_by_load", "slow_speed", "tyre_cooling", "disc_cooling", "disc_cooling_by_speed", "lock_speed",
        "push_out_width", "release_lag_ratio",
    ):  # fmt: skip
        car[name] = own[name]
    for name in EFFECTS:
        car[name] = effects.get(name, 0.0)
    surface = around.surface
    car["peak"] = surface["peak"] * change["friction"]
    for name in ("slip_stiffness", "shape", "curvature", "snow_depth_mm"):
        car[name] = surface[name]
    car["wet"] = float(surface["weather"] == "rain")
    car["direction"], car["grade"] = around.direction, around.grade
    car["hazard_center"], car["hazard_length"], car["hazard_height"] = around.hazard
    return record


def _place_masses(
    car: Any,
    catalogue: Mapping[str, float],
    own: Mapping[str, float],
    change: Mapping[str, float],
    radius: float,
) -> None:
    """Masses, levers and loads at rest; the body's height follows from the whole car's, with axles at wheel height."""
    front, rear = catalogue["unsprung_mass_f"], catalogue["unsprung_mass_r"]
    plain = catalogue["sprung_mass"]
    whole = plain + front + rear
    length = catalogue["cg_to_front_axle"] + catalogue["cg_to_rear_axle"]
    behind_front = catalogue["cg_to_front_axle"]
    height = (whole * catalogue["cg_height"] - (front + rear) * radius) / plain
    body = plain * change["mass"]
    car["gravity"], car["body_mass"], car["wheelbase"] = catalogue["gravity"], body, length
    car["pitch_inertia"], car["roll_inertia"] = catalogue["pitch_inertia"], own["roll_inertia"]
    car["body_lever"] = height * change["pitch_gain"] - radius
    car["drag_lever"] = own["drag_height"] - height
    half = 0.5 * own["track"]
    car["ahead"] = np.array([behind_front, behind_front, behind_front - length, behind_front - length])
    car["aside"] = np.array([half, -half, half, -half])
    car["wheel_mass"] = 0.5 * np.array([front, front, rear, rear])
    to_left = np.array([1.0, -1.0, 1.0, -1.0]) * own["cg_to_left"] / own["track"]
    share = np.array([length - behind_front, length - behind_front, behind_front, behind_front]) / length
    car["static_load"] = catalogue["gravity"] * (body * share * (0.5 + to_left) + car["wheel_mass"])


def _hang_wheels(
    car: Any,
    catalogue: Mapping[str, float],
    own: Mapping[str, float],
    change: Mapping[str, float],
    effects: Mapping[str, float],
) -> None:
    """Springs, dampers, stops, arms and tyres of the four wheels, each half of its axle's."""
    by_axle = {
        "spring": ("suspension_stiffness", change["stiffness"], 0.0),
        "damper": ("suspension_damping", change["damping"], 0.0),
        "tyre_stiffness": ("tyre_stiffness", 1.0, 0.0),
        "wheel_inertia": ("wheel_inertia", 1.0, effects.get("wheel_inertia", 0.0)),
    }
    for name, (entry, factor, more) in by_axle.items():
        front, rear = (0.5 * (catalogue[f"{entry}_{axle}"] * factor + more) for axle in "fr")
        car[name] = front, front, rear, rear
    transfer = catalogue["cg_height"] / car["wheelbase"]
    dive, lift = (effects.get(name, 0.0) * transfer for name in ("anti_dive", "anti_lift"))
    car["tangent"] = dive, dive, -lift, -lift
    car["relaxation"] = own["relaxation_length"] + effects.get("relaxation_length", 0.0)
    car["stop_clearance"] = effects.get("stop_clearance", own["stop_clearance"])
    car["stop_stiffness"] = (
        0.5 * effects["stop_stiffness"] if "stop_stiffness" in effects else own["stop_stiffness"]
    )
