"""The numbers that a vehicle may hold under ``effects``, all 0 in the paper's model.

Those that the library of effects has mean there and here the same, by the same functions.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.vehicle.effects.chassis import ChassisEffects
from tasks.vehicle.effects.ports import INDEX, PARAMETERS

EFFECT_UNITS = {
    "drag_area": "m2", "wind_speed": "m s-1", "rolling_coefficient": "1", "rolling_speed": "s m-1",
    "ploughing": "N mm-1", "creep_force": "N", "creep_speed": "m s-1", "engine_torque": "N m",
    "engine_viscous": "N m s rad-1", "pad_drag": "N m", "lag": "s", "dead_time": "s", "push_out": "MPa",
    "pressure_curve": "MPa-1", "fade": "1", "pad_speed": "s m-1", "pad_speed_reference": "m s-1",
    "bias_pressure": "MPa-1", "relaxation_length": "m", "load_sensitivity": "1", "tyre_heating": "1",
    "wet_speed": "s m-1", "wet_threshold": "m s-1", "friction_speed": "s m-1", "damper_asymmetry": "1",
    "coulomb_friction": "N", "progressive_rate": "N m-3", "stop_stiffness": "N m-1", "stop_clearance": "m",
    "anti_dive": "1", "anti_lift": "1", "pitch_gain": "1", "aero_pitch": "N s2 m-1", "aero_lift": "N s2 m-2",
    "slope_moment": "1", "radius_by_load": "1", "scrub_stiffness": "1", "enveloping_length": "m",
    "tyre_damping": "N s m-1", "abs_cutoff": "m s-1", "stick_ratio": "1", "stick_below": "m s-1",
    "stick_above": "m s-1", "stick_anti_dive": "1", "stick_anti_lift": "1",
}  # fmt: skip
"""Unit of each number, as catalogue files write it; fade is per 100 K and tyre heating per 100 kJ.

Parameters of the library that are not here change numbers of the vehicle's own, or belong to the road.
"""

NUMBERS_OF_EFFECTS = {
    "air drag": ("drag_area",),
    "rolling resistance": ("rolling_coefficient",),
    "tyre radius by load": ("radius_by_load",),
    "slope moment": ("slope_moment",),
    "footprint": ("enveloping_length",),
    "tyre damping": ("tyre_damping",),
    "damper asymmetry": ("damper_asymmetry",),
    "progressive spring": ("progressive_rate",),
    "scrub": ("scrub_stiffness",),
    "anti-dive and anti-lift": ("anti_dive", "anti_lift"),
    "ABS cut-off": ("abs_cutoff",),
    "sticking tyre": ("stick_ratio", "stick_below", "stick_above", "stick_anti_dive", "stick_anti_lift"),
    "wind": ("wind_speed",),
    "rolling resistance by speed": ("rolling_speed",),
    "snow ploughing": ("ploughing",),
    "idle creep": ("creep_force", "creep_speed"),
    "engine braking": ("engine_torque", "engine_viscous"),
    "pad drag": ("pad_drag",),
    "load sensitivity": ("load_sensitivity",),
    "relaxation length": ("relaxation_length",),
    "tyre heating": ("tyre_heating",),
    "wet friction by speed": ("wet_speed", "wet_threshold"),
    "tyre friction by speed": ("friction_speed",),
    "suspension friction": ("coulomb_friction",),
    "bump stop": ("stop_stiffness", "stop_clearance"),
    "brake dead time": ("dead_time",),
    "brake lag": ("lag",),
    "push-out pressure": ("push_out",),
    "pressure curve": ("pressure_curve",),
    "bias by pressure": ("bias_pressure",),
    "pad friction by speed": ("pad_speed", "pad_speed_reference"),
    "brake fade": ("fade",),
    "brake-pitch gain": ("pitch_gain",),
    "air's pitch moment and lift": ("aero_pitch", "aero_lift"),
}
"""The effects by what a table calls them, and the numbers of each."""


def effect_numbers(values: Mapping[str, float]) -> tuple[NDArray[np.float64], ChassisEffects]:
    """Effects of a vehicle from named numbers; all others 0.

    Parameters
    ----------
    values : by name, in the units of `EFFECT_UNITS`

    Returns
    -------
    The library's, float64 [len(PARAMETERS)] in the order of `PARAMETERS`, and those of coupled mode alone.

    Raises
    ------
    InputError
        For names that coupled mode does not carry.
    """
    unknown = [name for name in values if name not in EFFECT_UNITS]
    if unknown:
        known = ", ".join(EFFECT_UNITS)
        raise InputError(
            [f"effect {name}: coupled mode has no such number; there are: {known}" for name in unknown]
        )
    theta = np.zeros(len(PARAMETERS))
    own = {}
    for name, value in values.items():
        if name in INDEX:
            theta[INDEX[name]] = value
        else:
            own[name] = float(value)
    return theta, ChassisEffects(**own)
