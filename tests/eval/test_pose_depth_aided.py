"""The two checks that read rendered depth: points (PnP) and pixels (photometric)."""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest

from studies.synthetic_street import Clip
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.photometric import recover_motion_photometric
from tasks.eval.poses.pnp import recover_motion_pnp
from tests.eval.scoring import pitch_rmse_deg, progress_rmse
from tests.eval.weathering import add_flakes, add_noise, add_veil, code_as_jpeg, fade_pictures

Check = Callable[..., RecoveredMotion]
CLEAR_DEG = {"pnp": 0.02, "photometric": 0.01}
"""Half of what is allowed over 81 frames at 480 x 320, for a third of the length; the small clips, whose
pixels are twice as wide, may have twice that."""
SMALL_DEG = {name: 2 * limit for name, limit in CLEAR_DEG.items()}


@pytest.fixture(params=["pnp", "photometric"])
def method(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def check(method: str) -> Check:
    return {"pnp": recover_motion_pnp, "photometric": recover_motion_photometric}[method]


def recover_motion(check: Check, clip: Clip, upto: int | None = None, **others: object) -> RecoveredMotion:
    arguments: dict[str, object] = {
        "frames": clip.frames[:upto], "depth": clip.depth[:upto], "K": clip.K, "T_rig_camera": clip.T_rig_camera,
        "unusable": clip.class_id[:upto] == SemanticClass.SKY,
    }  # fmt: skip
    return check(**(arguments | others))


def test_pitch_heave_and_progress_over_a_hump_are_recovered(
    full_clip: Clip, check: Check, method: str
) -> None:
    seen = recover_motion(check, full_clip)
    assert not seen.failed.any() and seen.method == method
    assert pitch_rmse_deg(seen, full_clip) < CLEAR_DEG[method]
    assert progress_rmse(seen, full_clip) < 0.01
    assert np.abs(seen.heave - full_clip.heave).max() < 0.01
    assert np.abs(seen.lateral).max() < 0.02
    assert np.nanmax(np.rad2deg(full_clip.pitch)) > 0.5  # there was something to see


def test_a_braking_car_dives_stops_and_then_stays(stop_clip: Clip, check: Check, method: str) -> None:
    seen = recover_motion(check, stop_clip)
    assert pitch_rmse_deg(seen, stop_clip) < SMALL_DEG[method]
    assert progress_rmse(seen, stop_clip) < 0.01
    standing = np.flatnonzero(np.diff(stop_clip.station) == 0)[1:] + 1
    assert len(standing) >= 4
    assert np.ptp(seen.progress[standing]) < 1e-3
    assert np.ptp(np.rad2deg(seen.pitch[standing])) < 2e-3


def test_progress_follows_a_bend_without_being_told_the_route(
    bend_clip: Clip, check: Check, method: str
) -> None:
    seen = recover_motion(check, bend_clip)
    assert pitch_rmse_deg(seen, bend_clip) < SMALL_DEG[method]
    assert progress_rmse(seen, bend_clip) < 0.01
    np.testing.assert_allclose(seen.lateral, bend_clip.T_world_rig[:, 1, 3], atol=0.02)


def test_the_route_s_own_slope_is_not_body_pitch(hump_clip: Clip, check: Check, method: str) -> None:
    # a road that pitches exactly as this body does leaves the body level
    seen = recover_motion(check, hump_clip, upto=14, route_rotations=hump_clip.T_world_rig[:14, :3, :3])
    assert np.rad2deg(np.abs(seen.pitch)).max() < 2 * SMALL_DEG[method]
    assert np.rad2deg(np.abs(hump_clip.pitch[:14])).max() > 0.5


@pytest.mark.parametrize("weather", ["flakes", "jpeg", "fog"])
def test_weather_and_codec_at_most_double_the_allowance(
    hump_clip: Clip, check: Check, method: str, weather: str
) -> None:
    change = {
        "flakes": add_flakes,
        "jpeg": lambda f: code_as_jpeg(f, 70),
        "fog": lambda f: fade_pictures(f, 0.25),
    }[weather]
    cut = replace(hump_clip, pitch=hump_clip.pitch[:14], station=hump_clip.station[:14])
    seen = recover_motion(check, hump_clip, upto=14, frames=change(hump_clip.frames[:14]))
    assert not seen.failed.any()
    assert pitch_rmse_deg(seen, cut) < 2 * SMALL_DEG[method]
    assert progress_rmse(seen, cut) < 0.02


def test_a_veil_that_thins_as_things_come_nearer_is_no_motion(full_clip: Clip) -> None:
    veiled = add_veil(full_clip.frames, full_clip.depth, full_clip.K, 0.01, 0.88)
    seen = recover_motion(recover_motion_pnp, full_clip, frames=veiled)
    assert pitch_rmse_deg(seen, full_clip) < 0.004


def test_one_picture_repeated_is_a_car_that_stands_with_particles_or_without(
    hump_clip: Clip, check: Check
) -> None:
    still = np.repeat(hump_clip.frames[:1], 5, axis=0)
    depth = np.repeat(hump_clip.depth[:1], 5, axis=0)
    sky = np.repeat(hump_clip.class_id[:1] == SemanticClass.SKY, 5, axis=0)
    bare = recover_motion(check, hump_clip, frames=still, depth=depth, unusable=sky)
    assert np.abs(bare.progress).max() < 1e-6 and np.abs(bare.pitch).max() < 1e-6
    assert not bare.failed.any()
    assert np.isnan(bare.normalised_path).all()
    snowing = recover_motion(check, hump_clip, frames=add_flakes(still), depth=depth, unusable=sky)
    assert np.abs(snowing.progress).max() < 0.01
    assert np.rad2deg(np.abs(snowing.pitch)).max() < 0.02


def test_a_black_frame_fails_and_the_track_goes_on_behind_it(
    hump_clip: Clip, check: Check, method: str
) -> None:
    frames = hump_clip.frames[:16].copy()
    frames[6:8] = 0
    seen = recover_motion(check, hump_clip, upto=16, frames=frames)
    assert np.flatnonzero(seen.failed).tolist() == [6, 7]
    assert len(seen.failures) == 2 and seen.failures[0].startswith(f"{method}: frame 6 has no pose: ")
    for numbers in (
        seen.pitch,
        seen.progress,
        seen.heave,
        seen.lateral,
        seen.pitch_std,
        seen.T_rig0_rig[:, 0, 0],
    ):
        assert np.isnan(numbers[6:8]).all() and np.isfinite(numbers[[5, 8, 15]]).all()
    cut = replace(hump_clip, pitch=hump_clip.pitch[:16], station=hump_clip.station[:16])
    assert pitch_rmse_deg(seen, cut) < 2 * SMALL_DEG[method]


def test_a_track_lost_for_long_stays_lost(hump_clip: Clip, check: Check) -> None:
    frames = hump_clip.frames[:14].copy()
    frames[4:9] = 128
    seen = recover_motion(check, hump_clip, upto=14, frames=frames)
    assert not seen.failed[:4].any() and seen.failed[4:].all()
    assert "lost in frame 4" in seen.failures[-1]


def test_pictures_of_nothing_common_are_not_given_a_pose(hump_clip: Clip, check: Check) -> None:
    frames = np.random.default_rng(3).integers(0, 256, (4, *hump_clip.frames.shape[1:]), dtype=np.uint8)
    seen = recover_motion(check, hump_clip, upto=4, frames=frames)
    assert seen.failed[1:].all() and np.isnan(seen.pitch[1:]).all()


def test_the_error_is_within_a_few_of_its_own_uncertainties(hump_clip: Clip, check: Check) -> None:
    clear = recover_motion(check, hump_clip, upto=14)
    noisy = recover_motion(check, hump_clip, upto=8, frames=add_noise(hump_clip.frames[:8], 8.0))
    assert (np.abs(clear.pitch - hump_clip.pitch[:14])[1:] < 5 * clear.pitch_std[1:]).all()
    assert (np.abs(clear.progress - hump_clip.station[:14])[1:] < 5 * clear.progress_std[1:]).all()
    assert np.rad2deg(clear.pitch_std[-1]) < 0.03
    assert noisy.pitch_std[-1] > clear.pitch_std[7]


def test_same_frames_give_the_same_bytes(hump_clip: Clip, check: Check) -> None:
    first, second = (recover_motion(check, hump_clip, upto=6) for _ in range(2))
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(second, field.name))


def test_a_single_frame_is_no_motion(hump_clip: Clip, check: Check) -> None:
    seen = recover_motion(check, hump_clip, upto=1)
    assert seen.pitch.tolist() == [0.0] and seen.progress.tolist() == [0.0] and not seen.failed.any()


def test_every_wrong_array_is_named_at_once(hump_clip: Clip, check: Check) -> None:
    with pytest.raises(InputError) as caught:
        recover_motion(
            check, hump_clip, depth=hump_clip.depth[:3], K=np.eye(4), T_rig_camera=np.full((4, 4), np.nan)
        )
    assert len(caught.value.problems) == 3
    with pytest.raises(InputError, match="uint8"):
        recover_motion(check, hump_clip, frames=hump_clip.frames.astype(np.float32))
