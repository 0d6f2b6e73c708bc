"""The paper's motion metrics: pinned scores of perfect, absent and faulty responses."""

import numpy as np
import pytest

from studies.evaluation.metrics.video_motion import (
    MotionProtocol,
    event_response,
    geometry_error,
    motion_retention,
    normalised_progress,
    path_error,
    reference_progress,
    smooth_signal,
    weather_error,
)
from tasks.errors import InputError

TIMES = np.arange(81) * 0.1
STOP = np.minimum(TIMES, 4.0) * 16 - np.minimum(TIMES, 4.0) ** 2 * 2
SLIPPERY = np.minimum(TIMES, 6.0) * 16 - np.minimum(TIMES, 6.0) ** 2 * 16 / 12
HUMP = 0.02 * np.sin(2 * np.pi * (TIMES - 2.2) / 1.6) * ((TIMES > 2.2) & (TIMES < 3.8))


def test_a_perfect_pitch_scores_zero_and_no_response_scores_one() -> None:
    assert geometry_error(TIMES, HUMP, HUMP, 2.2, None) == pytest.approx(0.0, abs=1e-12)
    assert geometry_error(TIMES, 0 * HUMP, HUMP, 2.2, None) == pytest.approx(1.0)


def test_the_windows_are_the_papers_where_they_open_as_in_its_clips() -> None:
    chosen = MotionProtocol()
    spans = [tuple(2.2 + t for t in span) for span in (chosen.event, chosen.before, chosen.after)]
    np.testing.assert_allclose(spans, [(2.2, 3.8), (1.7, 2.15), (3.85, 4.3)])
    assert len(event_response(TIMES, HUMP, 2.2, chosen)) == 17
    # a feature met between two frames opens the window at the next
    assert len(event_response(TIMES, HUMP, 2.22, chosen)) == 16


def test_amplitude_and_sign_are_never_fitted() -> None:
    assert geometry_error(TIMES, 0.8 * HUMP, HUMP, 2.2, None) == pytest.approx(0.2)
    assert geometry_error(TIMES, -HUMP, HUMP, 2.2, None) == pytest.approx(2.0)


def test_a_drift_along_a_line_is_no_error() -> None:
    assert geometry_error(TIMES, HUMP + 0.01 * TIMES - 0.3, HUMP, 2.2, None) == pytest.approx(0.0, abs=1e-12)


def test_smoothing_the_estimate_alone_is_an_error_that_grows_with_the_window() -> None:
    floors = [geometry_error(TIMES, HUMP, HUMP, 2.2, window) for window in (5, 7, 9)]
    assert 0 < floors[0] < floors[1] < floors[2]


def test_a_clip_without_both_flanks_is_refused() -> None:
    with pytest.raises(InputError, match="must hold"):
        geometry_error(TIMES, HUMP, HUMP, 7.0, None)


@pytest.mark.parametrize("window", [None, 5, 7, 9])
def test_a_reference_that_ends_behind_the_windows_scores_as_a_whole_one(window: int | None) -> None:
    ended = np.where(TIMES <= 4.8, HUMP, np.nan)
    whole = geometry_error(TIMES, HUMP, HUMP, 2.2, window)
    assert geometry_error(TIMES, HUMP, ended, 2.2, window) == whole
    # its own smoothing feels the end, which lies half a window behind the flank
    assert geometry_error(TIMES, ended, ended, 2.2, window) == pytest.approx(whole, abs=1e-9)
    with pytest.raises(InputError, match=r"is to 4\.20 s"):
        geometry_error(TIMES, HUMP, np.where(TIMES <= 4.25, HUMP, np.nan), 2.2, window)


def test_progress_knows_neither_scale_nor_sign_and_never_falls() -> None:
    jittered = -3.7 * STOP + np.where(np.arange(81) % 7 == 0, 0.2, 0.0)
    progress = normalised_progress(jittered, 5)
    assert (np.diff(progress) >= 0).all() and progress.min() >= 0 and progress.max() <= 1
    assert np.abs(progress - reference_progress(STOP)).max() < 0.02


def test_the_weather_error_of_a_video_that_ignores_the_weather_is_the_whole_change() -> None:
    change = np.sqrt(np.mean((reference_progress(SLIPPERY) - reference_progress(STOP)) ** 2))
    assert weather_error(2 * SLIPPERY, 5 * STOP, SLIPPERY, STOP, None) == pytest.approx(0.0, abs=1e-12)
    assert weather_error(STOP, STOP, SLIPPERY, STOP, None) == pytest.approx(change)


def test_a_standing_car_has_no_progress_to_normalise() -> None:
    with pytest.raises(InputError, match="does not move"):
        normalised_progress(np.zeros(81), None)


def test_braking_longer_on_the_same_path_is_no_path_error() -> None:
    curve = [np.stack([way, 0.001 * way**2], axis=1) for way in (STOP, STOP**1.5 * STOP[-1] ** -0.5)]
    assert path_error(*curve) < 1e-3
    shifted = curve[0] + np.stack([0 * STOP, 0.01 * STOP], axis=1)
    assert path_error(shifted, curve[0]) == pytest.approx(0.01 / np.sqrt(3), rel=0.02)


def test_retention_takes_off_the_braking_and_ignores_sign_and_scale() -> None:
    dive = 0.03 * np.exp(-((TIMES - 4) ** 2))
    assert motion_retention(HUMP + dive, dive, -0.5 * HUMP + dive, dive) == pytest.approx(1.0)


def test_a_clip_shorter_than_the_smoothing_window_is_told() -> None:
    with pytest.raises(InputError, match="9 frames needs as many; known are 8"):
        smooth_signal(STOP[:8], 9)
    assert smooth_signal(STOP[:8], 7).shape == (8,)
