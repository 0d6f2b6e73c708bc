"""The verdict on a clip: the true telemetry passes, and each way of being out of step fails."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from studies.synthetic_street import Clip
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.eval.motion_agreement import PoseThresholds, PoseVerdict, judge_pose
from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.photometric import recover_motion_photometric
from tasks.eval.poses.pnp import recover_motion_pnp
from tests.eval.weathering import add_flakes

THRESHOLDS = PoseThresholds(
    pitch_rmse_deg=0.08, pitch_relative_error=0.10, pitch_correlation=0.98, response_deg=0.2,
    progress_rmse_m=0.3, normalised_progress_rmse=0.01,
)  # fmt: skip
CAMERA_ONLY = replace(THRESHOLDS, pitch_relative_error=0.20, progress_rmse_m=None)


@pytest.fixture(scope="module")
def recovered_motions(hump_clip: Clip) -> dict[str, RecoveredMotion]:
    with_depth = (
        hump_clip.frames,
        hump_clip.depth,
        hump_clip.K,
        hump_clip.T_rig_camera,
        hump_clip.class_id == SemanticClass.SKY,
    )
    return {
        "pnp": recover_motion_pnp(*with_depth),
        "photometric": recover_motion_photometric(*with_depth),
        "essential": recover_motion_essential(hump_clip.frames, hump_clip.K, hump_clip.T_rig_camera),
    }


def delayed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([values[:1], values[:-1]])


CONTROLS = {
    "no response": lambda pitch: 0 * pitch,
    "one frame late": delayed,
    "amplitude x 0.8": lambda pitch: 0.8 * pitch,
    "sign flipped": lambda pitch: -pitch,
}


@pytest.mark.parametrize("method", ["pnp", "photometric", "essential"])
class TestVerdictOnFrames:
    def judge(
        self,
        recovered_motions: dict[str, RecoveredMotion],
        method: str,
        clip: Clip,
        pitch: NDArray[np.float64],
    ) -> PoseVerdict:
        limits = CAMERA_ONLY if method == "essential" else THRESHOLDS
        return judge_pose(recovered_motions[method], pitch, clip.station, limits)

    def test_the_true_telemetry_passes(self, recovered_motions, method, hump_clip) -> None:
        verdict = self.judge(recovered_motions, method, hump_clip, hump_clip.pitch)
        assert verdict.passed, verdict.reasons
        assert verdict.pitch_relative_error < 0.05 and verdict.pitch_correlation > 0.999
        assert verdict.claimed_pitch_rms_deg > 0.4
        assert np.isnan(verdict.progress_rmse_m) == (method == "essential")

    @pytest.mark.parametrize("control", CONTROLS)
    def test_telemetry_out_of_step_with_the_pictures_fails(
        self, recovered_motions, method, hump_clip, control
    ) -> None:
        verdict = self.judge(recovered_motions, method, hump_clip, CONTROLS[control](hump_clip.pitch))
        assert not verdict.passed and verdict.reasons


def motion_with(clip: Clip, pitch: NDArray[np.float64], **others: object) -> RecoveredMotion:
    """A perfect recovery of a clip whose camera pitched so."""
    n = len(pitch)
    path = np.column_stack([clip.station - clip.station[0], np.zeros((n, 2))])
    exact = RecoveredMotion(
        method="exact", T_rig0_rig=clip.T_world_rig, pitch=pitch - pitch[0], heave=clip.heave, lateral=np.zeros(n),
        progress=path[:, 0], normalised_path=path / path[-1, 0], pitch_std=np.zeros(n), progress_std=np.zeros(n),
        inliers=np.ones(n, np.int64), failed=np.zeros(n, bool), failures=(),
    )  # fmt: skip
    return replace(exact, **others)


@pytest.mark.parametrize("control", CONTROLS)
def test_pictures_out_of_step_with_true_telemetry_fail(hump_clip: Clip, control: str) -> None:
    assert judge_pose(
        motion_with(hump_clip, hump_clip.pitch), hump_clip.pitch, hump_clip.station, THRESHOLDS
    ).passed
    shown = motion_with(hump_clip, CONTROLS[control](hump_clip.pitch))
    assert not judge_pose(shown, hump_clip.pitch, hump_clip.station, THRESHOLDS).passed


def test_the_controls_score_as_their_algebra_says(hump_clip: Clip) -> None:
    def relative(name: str) -> float:
        shown = motion_with(hump_clip, CONTROLS[name](hump_clip.pitch))
        return judge_pose(shown, hump_clip.pitch, hump_clip.station, THRESHOLDS).pitch_relative_error

    assert relative("no response") == pytest.approx(1.0)
    assert relative("amplitude x 0.8") == pytest.approx(0.2)
    assert relative("sign flipped") == pytest.approx(2.0)
    assert relative("one frame late") > 0.2


def test_a_wrong_speed_fails_by_progress_alone(hump_clip: Clip) -> None:
    verdict = judge_pose(
        motion_with(hump_clip, hump_clip.pitch), hump_clip.pitch, 1.05 * hump_clip.station, THRESHOLDS
    )
    assert [reason.split(" is ")[0] for reason in verdict.reasons] == ["progress RMSE"]


def test_pitch_counts_from_frame_0_so_a_constant_offset_does_not_matter(hump_clip: Clip) -> None:
    verdict = judge_pose(
        motion_with(hump_clip, hump_clip.pitch), hump_clip.pitch + 0.1, hump_clip.station + 50, THRESHOLDS
    )
    assert verdict.passed and verdict.pitch_rmse_deg < 1e-9 and verdict.progress_rmse_m < 1e-9


def test_without_response_the_relative_figures_are_not_judged(hump_clip: Clip) -> None:
    noise = np.deg2rad(0.01) * np.random.default_rng(0).standard_normal(len(hump_clip.pitch))
    quiet = motion_with(hump_clip, noise)
    verdict = judge_pose(quiet, 0 * hump_clip.pitch, hump_clip.station, THRESHOLDS)
    assert verdict.passed and np.isnan(verdict.pitch_relative_error) and np.isnan(verdict.pitch_correlation)


def test_a_car_that_stands_has_no_normalised_progress(hump_clip: Clip) -> None:
    n = len(hump_clip.pitch)
    still = motion_with(
        hump_clip, 0 * hump_clip.pitch, progress=np.zeros(n), normalised_path=np.full((n, 3), np.nan)
    )
    verdict = judge_pose(still, np.zeros(n), np.full(n, 7.0), THRESHOLDS)
    assert verdict.passed and np.isnan(verdict.normalised_progress_rmse)
    # but a car that should have moved and was seen standing fails, though its figure is NaN
    moved = judge_pose(still, np.zeros(n), hump_clip.station, replace(THRESHOLDS, progress_rmse_m=None))
    assert not moved.passed


def test_a_frame_without_a_pose_fails_the_clip_unless_a_share_of_them_is_allowed(hump_clip: Clip) -> None:
    n = len(hump_clip.pitch)
    failed = np.arange(n) == 5
    gap = motion_with(
        hump_clip,
        np.where(failed, np.nan, hump_clip.pitch),
        failed=failed,
        failures=("exact: frame 5 has no pose: dark.",),
    )
    verdict = judge_pose(gap, hump_clip.pitch, hump_clip.station, THRESHOLDS)
    assert not verdict.passed and verdict.failed_frames == 1 and "frame 5" in verdict.reasons[0]
    assert verdict.judged_frames == n - 2
    assert np.isfinite(verdict.pitch_rmse_deg)
    lenient = replace(THRESHOLDS, failed_share=0.1)
    assert judge_pose(gap, hump_clip.pitch, hump_clip.station, lenient).passed


def test_a_clip_of_which_no_frame_can_be_held_against_the_first_has_no_figures(hump_clip: Clip) -> None:
    lost = np.arange(len(hump_clip.pitch)) > 0
    gone = {
        name: np.where(lost, np.nan, getattr(motion_with(hump_clip, hump_clip.pitch), name))
        for name in ("pitch", "progress")
    }
    blind = motion_with(
        hump_clip, hump_clip.pitch, failed=lost, failures=("exact: frame 1 has no pose: dark.",)
    )
    verdict = judge_pose(
        replace(blind, **gone), hump_clip.pitch, hump_clip.station, replace(THRESHOLDS, failed_share=1.0)
    )
    assert not verdict.passed and verdict.judged_frames == 0 and verdict.failed_frames == lost.sum()
    assert verdict.reasons == ("no frame after the first has a pose",)
    assert np.isnan([verdict.pitch_rmse_deg, verdict.progress_rmse_m, verdict.claimed_pitch_rms_deg]).all()


def test_telemetry_that_does_not_fit_the_frames_is_refused(hump_clip: Clip) -> None:
    holed = hump_clip.station.copy()
    holed[3] = np.nan
    with pytest.raises(InputError) as caught:
        judge_pose(motion_with(hump_clip, hump_clip.pitch), hump_clip.pitch[:-1], holed, THRESHOLDS)
    assert len(caught.value.problems) == 2


@pytest.mark.parametrize(
    ("pitch_std_deg", "share", "passed"), [(0.002, 0.8, False), (0.06, 0.8, None), (0.06, -1.0, False)]
)
def test_a_missed_limit_is_judged_only_where_the_check_sees_well_enough(
    hump_clip: Clip,
    recovered_motions: dict[str, RecoveredMotion],
    pitch_std_deg: float,
    share: float,
    passed: bool | None,
) -> None:
    seen = recovered_motions["pnp"]
    motion = replace(seen, pitch_std=np.full(len(seen.pitch), np.deg2rad(pitch_std_deg)))
    verdict = judge_pose(motion, share * hump_clip.pitch, hump_clip.station, THRESHOLDS)
    assert verdict.passed is passed
    assert verdict.reasons[0].startswith("not judged: pitch is known to 0.06 deg") is (passed is None)
    assert judge_pose(motion, hump_clip.pitch, hump_clip.station, THRESHOLDS).passed is True


def test_a_clip_too_dark_or_too_thick_with_flakes_to_follow_is_not_judged_and_one_that_shows_other_pictures_fails(
    hump_clip: Clip,
) -> None:
    part = slice(0, 8)
    depth, sky = hump_clip.depth[part], hump_clip.class_id[part] == SemanticClass.SKY
    noise = np.random.default_rng(1).normal(0, 0.5, hump_clip.frames[part].shape)
    dark = np.clip(0.005 * hump_clip.frames[part] + noise, 0, 255).round().astype(np.uint8)
    other = hump_clip.frames[np.array([0, 4, 1, 5, 2, 6, 3, 7]) * len(hump_clip.frames) // 8]
    verdicts = []
    for frames in (dark, add_flakes(hump_clip.frames[part], 1000), other):
        recovered = recover_motion_pnp(frames, depth, hump_clip.K, hump_clip.T_rig_camera, sky)
        verdicts.append(judge_pose(recovered, hump_clip.pitch[part], hump_clip.station[part], THRESHOLDS))
    assert [verdict.passed for verdict in verdicts] == [None, None, False]
    for verdict in verdicts[:2]:
        assert verdict.reasons[0] == "not judged: the pictures show too little to follow"
