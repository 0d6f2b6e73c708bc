"""Largest values of a clip that follow from its ticks, and how long ABS acts."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.vehicle.rollout import TICK_NS


def compute_peaks(columns: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """Return ``peak_deceleration``, ``peak_pitch_rate``, ``abs_time`` and ``peak_slip`` of a clip.

    Each is NaN where a column that it follows from has no number at some tick: what is not known there may be larger.

    Parameters
    ----------
    columns : of the ticks, in the units of `tasks.conventions.TICK_CHANNELS`
    """
    acceleration, pitch_rate = columns["longitudinal_acceleration"], columns["pitch_rate"]
    slip = np.maximum(columns["braking_slip_f"], columns["braking_slip_r"])
    scale = np.minimum(columns["abs_scale_f"], columns["abs_scale_r"])
    acts = np.where(np.isnan(scale), np.nan, scale < 1)
    return {
        # 0 has no sign: a car that never slows down has the same figure in every file
        "peak_deceleration": 0.0 + float(np.maximum(0.0, np.max(-acceleration))),
        "peak_pitch_rate": float(np.max(np.abs(pitch_rate))),
        "abs_time": float(np.sum(acts)) * TICK_NS / 1e9,
        "peak_slip": float(np.max(slip)),
    }
