"""The camera-only check: pitch and progress without depth, and no metres."""

from dataclasses import fields, replace

import numpy as np
import pytest

from studies.synthetic_street import Clip, camera_matrix, drive_clip, render_clip
from tasks.errors import InputError
from tasks.eval.poses import essential
from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import RecoveredMotion
from tests.eval.scoring import normalised_progress_rmse, pitch_rmse_deg
from tests.eval.weathering import add_flakes, add_veil, code_as_jpeg, fade_pictures


def recover_motion(clip: Clip, frames: np.ndarray | None = None) -> RecoveredMotion:
    return recover_motion_essential(clip.frames if frames is None else frames, clip.K, clip.T_rig_camera)


def test_pitch_and_normalised_progress_over_a_hump_are_recovered(full_clip: Clip) -> None:
    seen = recover_motion(full_clip)
    assert not seen.failed.any() and seen.method == "essential"
    assert pitch_rmse_deg(seen, full_clip) < 0.03  # half of what is allowed over 81 frames
    assert normalised_progress_rmse(seen, full_clip) < 0.0024  # the worst of a prototype


def test_a_stop_is_seen_in_the_progress_and_the_dive(stop_clip: Clip) -> None:
    seen = recover_motion(stop_clip)
    assert pitch_rmse_deg(seen, stop_clip) < 0.1  # small pictures, and a nod of 1.3 deg within one frame
    assert normalised_progress_rmse(seen, stop_clip) < 0.005
    assert np.ptp(seen.normalised_path[-4:, 0]) < 0.002


def test_no_scale_means_no_metres(hump_clip: Clip) -> None:
    seen = recover_motion(hump_clip)
    for lengths in (seen.progress, seen.lateral, seen.heave, seen.progress_std, seen.T_rig0_rig[:, :3, 3]):
        assert np.isnan(lengths).all()
    assert np.isfinite(seen.pitch).all() and np.isfinite(seen.normalised_path).all()
    assert seen.normalised_path[-1, 0] == 1.0


@pytest.mark.parametrize("weather", ["flakes", "jpeg", "fog"])
def test_weather_and_codec_at_most_double_the_allowance(full_clip: Clip, weather: str) -> None:
    change = {
        "flakes": add_flakes,
        "jpeg": lambda f: code_as_jpeg(f, 70),
        "fog": lambda f: fade_pictures(f, 0.25),
    }
    cut = replace(full_clip, pitch=full_clip.pitch[:14], station=full_clip.station[:14])
    seen = recover_motion(full_clip, change[weather](full_clip.frames[:14]))
    assert not seen.failed.any()
    assert pitch_rmse_deg(seen, cut) < 0.06


def test_a_car_that_never_moves_has_no_normalised_path(hump_clip: Clip) -> None:
    seen = recover_motion(hump_clip, np.repeat(hump_clip.frames[:1], 4, axis=0))
    assert not seen.failed.any()
    assert np.abs(seen.pitch).max() < 1e-9
    assert np.isnan(seen.normalised_path).all()


def test_black_frames_fail_and_the_chain_keeps_its_scale_across_them(hump_clip: Clip) -> None:
    frames = hump_clip.frames.copy()
    frames[9:11] = 0
    seen = recover_motion(hump_clip, frames)
    assert np.flatnonzero(seen.failed).tolist() == [9, 10]
    assert np.isnan(seen.pitch[9:11]).all() and np.isnan(seen.normalised_path[9:11]).all()
    way = hump_clip.station - hump_clip.station[0]
    assert np.nanmax(np.abs(seen.normalised_path[:, 0] - way / way[-1])) < 0.01


def test_a_track_lost_for_long_stays_lost(hump_clip: Clip) -> None:
    frames = hump_clip.frames[:14].copy()
    frames[4:9] = 128
    seen = recover_motion(hump_clip, frames)
    assert not seen.failed[:4].any() and seen.failed[4:].all()
    assert "lost after frame 3" in seen.failures[-1]


def test_same_frames_give_the_same_bytes(hump_clip: Clip) -> None:
    first, second = (recover_motion(hump_clip, hump_clip.frames[:6]) for _ in range(2))
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(second, field.name))


def test_depth_is_never_asked_for_and_wrong_frames_are_refused(hump_clip: Clip) -> None:
    with pytest.raises(InputError, match="uint8"):
        recover_motion(hump_clip, hump_clip.frames[..., 0])


def test_a_bend_turns_the_heading_and_not_the_pitch() -> None:
    clip = drive_clip(
        frames=12, frame_rate=16.0, curvature=1 / 80, hump_at=9.0, width=240, height=160, focal=200.0
    )
    seen = recover_motion(clip)
    heading = np.arctan2(seen.T_rig0_rig[:, 1, 0], seen.T_rig0_rig[:, 0, 0])
    np.testing.assert_allclose(heading, clip.station / 80, atol=np.deg2rad(0.1))
    assert np.rad2deg(np.abs(seen.pitch)).max() < 0.06


def test_a_step_that_shows_few_depths_is_placed_by_the_known_ones(
    hump_clip: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = []

    def lose_most_depths(*geometry: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        depth, later_depth, precision = triangulate(*geometry)
        steps.append(len(depth))
        if len(steps) == 6:  # all but twenty points behind the camera, and those ten times too far
            depth = np.where(np.arange(len(depth)) < 20, 10 * depth, -depth)
        return depth, later_depth, precision

    triangulate = essential.triangulate_points
    monkeypatch.setattr(essential, "triangulate_points", lose_most_depths)
    seen = recover_motion(hump_clip)
    assert not seen.failed.any()
    assert pitch_rmse_deg(seen, hump_clip) < 0.06
    assert normalised_progress_rmse(seen, hump_clip) < 0.01


def test_a_veil_that_thins_as_things_come_nearer_is_no_motion(full_clip: Clip) -> None:
    veiled = add_veil(full_clip.frames, full_clip.depth, full_clip.K, 0.01, 0.88)
    assert pitch_rmse_deg(recover_motion(full_clip, veiled), full_clip) < 0.009


def test_a_turn_that_nothing_foretells_is_followed() -> None:
    station, pitch = 1.1 * np.arange(9.0), np.deg2rad(3.0) * (np.arange(9) >= 5)
    clip = render_clip(station, 0 * station, pitch, K=camera_matrix(240, 160, 200.0), width=240, height=160)
    seen = recover_motion(clip)
    assert not seen.failed.any() and pitch_rmse_deg(seen, clip) < 0.03
    assert normalised_progress_rmse(seen, clip) < 0.005
