"""Differences between the labels of one clip in two versions of a dataset, in physical units."""

from collections.abc import Mapping
from math import degrees, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

RMS_CHANNELS = {
    "speed_rms_m_s": (("speed",), 1.0),
    "pitch_rms_deg": (("pitch",), degrees(1.0)),
    "heave_rms_mm": (("heave",), 1e3),
    "braking_slip_rms": (("braking_slip_f", "braking_slip_r"), 1.0),
    "axle_load_rms_n": (("axle_load_f", "axle_load_r"), 1.0),
    "brake_torque_rms_n_m": (("brake_torque_f", "brake_torque_r"), 1.0),
}
"""Root mean square over the shared ticks: figure to its channels and the factor to its unit."""

FIGURES = {
    "stopping_distance_change_m": ("stopping_distance", 1.0),
    "stop_time_change_s": ("stop_time", 1.0),
    "peak_pitch_change_deg": ("peak_pitch", degrees(1.0)),
    "tyre_peak_change": ("tyre_peak", 1.0),
    "surface_friction_change": ("surface_friction", 1.0),
    "film_depth_change_mm": ("film_depth_mm", 1.0),
    "snow_depth_change_mm": ("snow_depth_mm", 1.0),
}
"""Change of a clip's figure, B minus A: figure to the manifest's name and the factor to its unit."""


def compare_ticks(a: Mapping[str, NDArray[Any]], b: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """Compare two tick tables over the ticks that both have.

    Parameters
    ----------
    a, b : columns of the two versions, each float64 [N]

    Returns
    -------
    Root mean squares of `RMS_CHANNELS`, the largest differences of speed, pitch and load, and the change of the
    final position, each in the unit of its name; NaN where a channel is missing.
    """
    moves = {
        name: _rms_difference(a, b, channels) * factor for name, (channels, factor) in RMS_CHANNELS.items()
    }
    return moves | {
        "speed_largest_m_s": _largest_difference(a, b, ("speed",)),
        "pitch_largest_deg": degrees(_largest_difference(a, b, ("pitch",))),
        "axle_load_largest_n": _largest_difference(a, b, ("axle_load_f", "axle_load_r")),
        "final_station_change_m": _final_difference(a, b, "station"),
    }


def compare_figures(a: Mapping[str, float | None], b: Mapping[str, float | None]) -> dict[str, float]:
    """Compare the figures of a clip, B minus A.

    Parameters
    ----------
    a, b : figures of the two versions as the manifest has them; None where there is no such value

    Returns
    -------
    Each in the unit of its name; NaN where either version has none.
    """

    def change_of(name: str) -> float:
        old, new = a.get(name), b.get(name)
        return nan if old is None or new is None else float(new) - float(old)

    return {label: change_of(name) * factor for label, (name, factor) in FIGURES.items()}


def _stack_differences(
    a: Mapping[str, NDArray[Any]], b: Mapping[str, NDArray[Any]], channels: tuple[str, ...]
) -> NDArray[np.float64]:
    if any(channel not in table for channel in channels for table in (a, b)):
        return np.zeros(0)
    count = min(len(a[channels[0]]), len(b[channels[0]]))
    return np.concatenate([np.asarray(b[c][:count], dtype=np.float64) - a[c][:count] for c in channels])


def _rms_difference(
    a: Mapping[str, NDArray[Any]], b: Mapping[str, NDArray[Any]], channels: tuple[str, ...]
) -> float:
    errors = _stack_differences(a, b, channels)
    return float(np.sqrt(np.mean(errors**2))) if errors.size else nan


def _largest_difference(
    a: Mapping[str, NDArray[Any]], b: Mapping[str, NDArray[Any]], channels: tuple[str, ...]
) -> float:
    errors = _stack_differences(a, b, channels)
    return float(np.max(np.abs(errors))) if errors.size else nan


def _final_difference(a: Mapping[str, NDArray[Any]], b: Mapping[str, NDArray[Any]], channel: str) -> float:
    errors = _stack_differences(a, b, (channel,))
    return float(errors[-1]) if errors.size else nan
