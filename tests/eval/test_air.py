"""The veil of the air: found in pictures with depth, and taken away before they are aligned."""

import numpy as np
import pytest

import tasks.eval.poses.photometric as photometric
from studies.synthetic_street import Clip
from tasks.conventions import SemanticClass
from tasks.eval.poses.air import LEAST_SKY, Air, fit_extinction, measure_sky_light, take_air_away
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.photometric import recover_motion_photometric
from tests.eval.scoring import pitch_rmse_deg, progress_rmse
from tests.eval.weathering import add_veil

LIGHT = 0.88


def recover_motion(clip: Clip, frames: np.ndarray) -> RecoveredMotion:
    sky = clip.class_id == SemanticClass.SKY
    return recover_motion_photometric(frames, clip.depth, clip.K, clip.T_rig_camera, sky)


def test_extinction_is_found_beside_surfaces_that_change_for_other_reasons() -> None:
    rng = np.random.default_rng(4)
    near, nearing = rng.uniform(0, 0.6, 4000), rng.uniform(0, 6, 4000)
    far = LIGHT - (LIGHT - near) * np.exp(-0.008 * nearing)
    far[:400] = rng.uniform(0, 1, 400)
    assert fit_extinction(far, near, nearing, LIGHT) == pytest.approx(0.008, rel=0.01)
    assert fit_extinction(near, near, nearing, LIGHT) == pytest.approx(0.0, abs=1e-12)
    assert fit_extinction(near, near, 0 * nearing, LIGHT) == 0.0  # a car that stands tells nothing


def test_the_light_of_the_air_is_that_of_the_sky_or_unknown() -> None:
    greys, depth = np.full((20, 30), 40, np.uint8), np.full((20, 30), 9.0, np.float32)
    greys[:10], depth[:10] = 188, np.nan
    assert measure_sky_light(greys, depth) == pytest.approx(0.503, abs=1e-3)  # sRGB 188 is half the light
    blue_above = greys.copy()
    blue_above[:5] = 150
    assert measure_sky_light(blue_above, depth) is None
    depth.ravel()[LEAST_SKY - 1 :] = 9.0
    assert measure_sky_light(greys, depth) is None


def test_a_surface_is_as_bright_without_air_at_any_range(hump_clip: Clip) -> None:
    surface = np.full((1, *hump_clip.depth.shape[1:], 3), 90, np.uint8)
    depth, K = hump_clip.depth[:1], hump_clip.K
    seen = add_veil(surface, depth, K, 0.006, LIGHT)[0, ..., 0]
    near = depth[0] < 80
    assert np.ptp(seen[near]) > 30
    clear = take_air_away(seen, depth[0], K, Air(extinction=0.006, light=LIGHT))
    expected = take_air_away(surface[0, ..., 0], depth[0], K, Air(extinction=0.0, light=LIGHT))
    np.testing.assert_allclose(clear[near], expected[near], atol=2.0)


def test_veil_that_thins_as_things_come_nearer_is_no_motion(
    hump_clip: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = add_veil(hump_clip.frames, hump_clip.depth, hump_clip.K, 0.02, LIGHT)
    seen = recover_motion(hump_clip, frames)
    assert pitch_rmse_deg(seen, hump_clip) < 0.012
    assert progress_rmse(seen, hump_clip) < 0.002
    monkeypatch.setattr(photometric, "LEAST_EXTINCTION", np.inf)
    assert pitch_rmse_deg(recover_motion(hump_clip, frames), hump_clip) > 0.04


def test_clear_air_leaves_the_pictures_as_they_are(hump_clip: Clip, monkeypatch: pytest.MonkeyPatch) -> None:
    as_made = recover_motion(hump_clip, hump_clip.frames)
    monkeypatch.setattr(photometric, "LEAST_EXTINCTION", np.inf)
    assert as_made.pitch.tobytes() == recover_motion(hump_clip, hump_clip.frames).pitch.tobytes()
