"""A clip's peaks and its time under ABS are those of its ticks."""

import numpy as np
import pytest

from tasks.conventions import CLIP_CHANNELS
from tasks.vehicle.rollout import compute_peaks

TICKS = {
    "longitudinal_acceleration": np.array([0.5, -1.0, -7.5, 0.0]),
    "pitch_rate": np.array([0.1, -0.3, 0.2, 0.0]),
    "braking_slip_f": np.array([0.0, 0.05, 0.2, 0.0]),
    "braking_slip_r": np.array([0.0, 0.25, 0.1, 0.0]),
    "abs_scale_f": np.array([1.0, 0.9, 1.0, 1.0]),
    "abs_scale_r": np.array([1.0, 0.8, 0.7, 1.0]),
}


def test_peaks_are_the_largest_of_either_sign_and_axle_and_abs_acts_where_either_torque_is_reduced():
    peaks = compute_peaks(TICKS)
    assert peaks == {"peak_deceleration": 7.5, "peak_pitch_rate": 0.3, "abs_time": 0.002, "peak_slip": 0.25}
    assert peaks.keys() <= {channel.name for channel in CLIP_CHANNELS}


def test_a_car_that_never_slows_down_has_a_peak_deceleration_of_zero():
    assert (
        compute_peaks(TICKS | {"longitudinal_acceleration": np.array([0.0, 0.5])})["peak_deceleration"] == 0
    )


@pytest.mark.parametrize(
    ("column", "figure"),
    [("longitudinal_acceleration", "peak_deceleration"), ("pitch_rate", "peak_pitch_rate"),
     ("abs_scale_r", "abs_time"), ("braking_slip_f", "peak_slip")],
)  # fmt: skip
def test_a_figure_of_ticks_that_are_not_all_represented_is_not_represented(column, figure):
    found = compute_peaks(TICKS | {column: np.where(np.arange(4) == 3, np.nan, TICKS[column])})
    assert [name for name, value in found.items() if np.isnan(value)] == [figure]
