"""Roll, yaw, place and heave of the recovered rig: the claimed ones pass, and each other motion fails by its name."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from catalogs.entries import load
from studies.negative_controls.false_rigs import FALSE_RIGS, show_rig
from studies.synthetic_street import Clip
from tasks.errors import InputError
from tasks.eval.body_agreement import BodyClaim, compare_body, pose_body
from tasks.eval.motion_agreement import PoseVerdict, judge_pose
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.pnp import recover_motion_pnp
from tasks.eval.poses.rigid import invert_pose
from tasks.render.camera import body_poses
from tasks.scene.route import Route

Floats = NDArray[np.float64]
RATE_HZ = 16.0


@pytest.fixture(scope="module")
def recovered(hump_clip: Clip) -> RecoveredMotion:
    clip, sky = hump_clip, ~np.isfinite(hump_clip.depth)
    return recover_motion_pnp(clip.frames, clip.depth, clip.K, clip.T_rig_camera, sky)


def claim_of(clip: Clip) -> BodyClaim:
    return BodyClaim(T_world_rig=clip.T_world_rig, heave=clip.heave)


def judge(motion: RecoveredMotion, clip: Clip) -> PoseVerdict:
    return judge_pose(motion, clip.pitch, clip.station, load("gate file"), claim_of(clip))


def pitch_by(clip: Clip, angle: Floats | float) -> Floats:
    nothing = np.zeros(len(clip.pitch))
    return pose_body(nothing, nothing + angle, 0.0, 0.0)


NAMED = {
    "no-heave": "heave", "heave-flip": "heave", "heave-3": "heave", "roll": "roll", "yaw": "yaw", "aside": "lateral",
    "sway": "lateral",
}  # fmt: skip
"""What the reason names, by the false motion."""


def test_the_claimed_rig_passes(recovered: RecoveredMotion, hump_clip: Clip) -> None:
    verdict = judge(recovered, hump_clip)
    assert verdict.passed, verdict.reasons
    assert verdict.heave_gain == pytest.approx(1, abs=0.1) and verdict.heave_gain_std < 0.1


@pytest.mark.parametrize("false", FALSE_RIGS)
def test_a_rig_that_moves_otherwise_than_claimed_fails_by_its_name(
    recovered: RecoveredMotion, hump_clip: Clip, false: str
) -> None:
    claim = claim_of(hump_clip)
    shown = FALSE_RIGS[false](claim, np.arange(len(claim.heave)) / RATE_HZ)
    verdict = judge(show_rig(recovered, claim, shown), hump_clip)
    assert not verdict.passed and any(NAMED[false] in reason for reason in verdict.reasons), verdict.reasons


@pytest.mark.parametrize("false", ["roll", "yaw", "aside"])
def test_a_rig_that_turns_otherwise_fails_where_pitch_is_seen_as_badly_as_in_a_snowstorm(
    recovered: RecoveredMotion, hump_clip: Clip, false: str
) -> None:
    claim = claim_of(hump_clip)
    blurred = replace(recovered, pitch_std=np.full(len(claim.heave), np.deg2rad(0.13)))
    shown = FALSE_RIGS[false](claim, np.arange(len(claim.heave)) / RATE_HZ)
    assert judge(show_rig(blurred, claim, shown), hump_clip).passed is False


def test_a_pitch_that_is_off_all_along_fails_by_the_rise(recovered: RecoveredMotion, hump_clip: Clip) -> None:
    shown = hump_clip.T_world_rig @ pitch_by(hump_clip, np.deg2rad(2))
    verdict = judge(show_rig(recovered, claim_of(hump_clip), shown), hump_clip)
    assert any("rise" in reason for reason in verdict.reasons), verdict.reasons


def test_a_heave_below_the_checks_own_uncertainty_is_not_judged(
    recovered: RecoveredMotion, hump_clip: Clip
) -> None:
    shaken = hump_clip.T_world_rig.copy()
    shaken[:, 2, 3] += 0.01 * np.random.default_rng(0).standard_normal(len(shaken))
    motion = show_rig(recovered, claim_of(hump_clip), shaken)
    verdict = judge(motion, replace(hump_clip, heave=0.1 * hump_clip.heave))
    assert verdict.heave_gain_std > 0.1 and abs(verdict.heave_gain - 1) > 0.5
    assert not any("heave" in reason for reason in verdict.reasons)


def test_a_pitch_that_drifts_does_not_turn_the_way_into_heave(hump_clip: Clip) -> None:
    drift = np.deg2rad(0.3) * np.linspace(0, 1, len(hump_clip.pitch))
    there = invert_pose(hump_clip.T_world_rig[:1]) @ hump_clip.T_world_rig
    exact = replace(_placed(hump_clip), T_rig0_rig=there @ pitch_by(hump_clip, drift))
    gain = compare_body(exact, claim_of(hump_clip)).heave_gain
    assert gain == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_a_clip_too_short_for_a_change_of_heave_has_no_gain(hump_clip: Clip, frames: int) -> None:
    clip = replace(
        hump_clip,
        T_world_rig=hump_clip.T_world_rig[:frames],
        pitch=hump_clip.pitch[:frames],
        heave=hump_clip.heave[:frames],
    )
    errors = compare_body(_placed(clip), claim_of(clip))
    assert np.isnan(errors.heave_gain) and np.isfinite(errors.lateral_rmse_m)


def _placed(clip: Clip) -> RecoveredMotion:
    n, nothing = len(clip.pitch), np.zeros(len(clip.pitch))
    return RecoveredMotion(
        method="exact", T_rig0_rig=np.tile(np.eye(4), (n, 1, 1)), pitch=nothing, heave=nothing, lateral=nothing,
        progress=nothing, normalised_path=np.zeros((n, 3)), pitch_std=nothing, progress_std=nothing,
        inliers=np.ones(n, np.int64), failed=np.zeros(n, bool), failures=(),
    )  # fmt: skip


def test_the_judges_body_is_the_renderers() -> None:
    draw = np.random.default_rng(1)
    heave, pitch = 0.1 * draw.standard_normal((2, 7))
    ends = np.tile(np.eye(4), (2, 1, 1))
    ends[1, 0, 3] = 10.0
    road = Route(station=np.array([0.0, 10.0]), T_world_rig=ends)
    shown = body_poses(road, np.zeros(7), heave, pitch, cg_behind_front_axle=1.2, cg_height=0.5)
    np.testing.assert_allclose(pose_body(heave, pitch, 1.2, 0.5), shown, atol=1e-15)


def test_a_claim_that_does_not_fit_the_frames_is_refused(hump_clip: Clip) -> None:
    holed = hump_clip.heave.copy()
    holed[2] = np.nan
    with pytest.raises(InputError) as caught:
        compare_body(_placed(hump_clip), BodyClaim(T_world_rig=hump_clip.T_world_rig[1:], heave=holed))
    assert len(caught.value.problems) == 2
