"""The table of pose checks, and the chain that the checks by depth share."""

from dataclasses import replace

import numpy as np
import pytest

from studies.synthetic_street import Clip
from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.eval.poses.checks import GATE_CHECK, POSE_CHECKS, CheckedClip, JudgeCamera, prepare_clip
from tasks.eval.poses.depth_chain import (
    KEPT_FRAMES,
    Attempt,
    invert_depth,
    place_frames_by_depth,
    prepare_on_demand,
)
from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import FrameStep, failed_step
from tasks.eval.poses.photometric import recover_motion_photometric
from tasks.eval.poses.pnp import recover_motion_pnp
from tasks.eval.poses.rigid import Floats


@pytest.fixture(scope="module")
def prepared(hump_clip: Clip) -> CheckedClip:
    """Four frames; on a patch of the road stands a vehicle."""
    class_id = hump_clip.class_id[:4].copy()
    class_id[:, 100:120, 60:90] = SemanticClass.VEHICLE
    return prepare_clip(
        {"rgb": hump_clip.frames[:4], "depth": hump_clip.depth[:4], "class": class_id},
        JudgeCamera(K=hump_clip.K, T_rig_camera=hump_clip.T_rig_camera, distortion=None, line_delay_s=0.0),
        frame_interval_s=1 / 16,
        film_depth_mm=0.0,
        route_rotations=np.tile(np.eye(3), (4, 1, 1)),
    )


def test_every_check_of_the_table_reads_the_clip_as_its_method_asks(prepared: CheckedClip) -> None:
    camera, route = prepared.camera, prepared.route_rotations
    with_depth = prepared.rgb, prepared.depth, camera.K, camera.T_rig_camera
    glossy = prepared.class_id == SemanticClass.VEHICLE
    expected = {
        "photometric": recover_motion_photometric(*with_depth, prepared.unusable | glossy, route),
        "pnp": recover_motion_pnp(*with_depth, prepared.unusable, route),
        "essential": recover_motion_essential(prepared.frames, camera.K, camera.T_rig_camera, route),
    }
    assert list(expected) == list(POSE_CHECKS) and GATE_CHECK in POSE_CHECKS
    for name, check in POSE_CHECKS.items():
        seen = check(prepared)
        assert seen.method == name
        assert seen.pitch.tobytes() == expected[name].pitch.tobytes()
        assert seen.inliers.tobytes() == expected[name].inliers.tobytes()


def test_a_wet_road_is_unusable_for_all_checks(prepared: CheckedClip) -> None:
    buffers = {"rgb": prepared.rgb, "depth": prepared.depth, "class": prepared.class_id}
    wet = prepare_clip(
        buffers, prepared.camera, frame_interval_s=0.1, film_depth_mm=0.5, route_rotations=prepared.route_rotations
    )  # fmt: skip
    road = np.isin(prepared.class_id, ROAD_CLASSES)
    assert not prepared.unusable[road].any() and wet.unusable[road].all()


STEP = FrameStep(T_earlier_later=np.eye(4), covariance=np.eye(6), inliers=1)


def at(advance: float) -> Floats:
    pose = np.eye(4)
    pose[2, 3] = advance
    return pose


def test_a_search_takes_the_best_guess_that_did_not_fail() -> None:
    qualities = {0.0: 3.0, 1.0: 9.0, 2.0: 5.0}

    def search(earlier: int, later: int, guess: Floats) -> Attempt:
        advance = float(guess[2, 3])
        step = failed_step("too far", 9) if advance == 1.0 else replace(STEP, T_earlier_later=guess)
        return Attempt(step=step, quality=qualities[advance])

    guesses = [at(advance) for advance in qualities]
    (placed,) = place_frames_by_depth(2, lambda k: k, search, search, guesses)
    np.testing.assert_array_equal(placed.step.T_earlier_later, at(2.0))


def test_a_frame_is_tracked_from_its_prediction_and_searched_only_where_that_fails() -> None:
    calls = []

    def search(earlier: int, later: int, guess: Floats) -> Attempt:
        calls.append(("search", earlier, later))
        return Attempt(step=replace(STEP, T_earlier_later=at(1.0)), quality=1.0)

    def track(earlier: int, later: int, guess: Floats) -> Attempt:
        calls.append(("track", earlier, later))
        np.testing.assert_allclose(guess, at(1.0))
        step = failed_step("hidden", 0) if later == 3 else replace(STEP, T_earlier_later=guess)
        return Attempt(step=step, quality=1.0)

    place_frames_by_depth(4, lambda k: k, track, search, [np.eye(4)])
    assert calls == [("search", 0, 1), ("track", 1, 2), ("track", 2, 3), ("search", 2, 3)]


def test_a_frame_is_prepared_once_while_it_is_kept() -> None:
    made = []
    prepared = prepare_on_demand(lambda k: made.append(k) or k)
    for k in (*range(KEPT_FRAMES), 0):
        prepared(k)
    assert made == list(range(KEPT_FRAMES))
    prepared(KEPT_FRAMES), prepared(1)
    assert made[KEPT_FRAMES:] == [KEPT_FRAMES, 1]


def test_inverse_depth_is_zero_where_nothing_or_hidden() -> None:
    depth = np.array([[2.0, np.nan], [0.0, 4.0]], np.float32)
    hidden = np.array([[False, False], [False, True]])
    np.testing.assert_array_equal(invert_depth(depth, hidden), [[0.5, 0], [0, 0]])
    np.testing.assert_array_equal(invert_depth(depth, None), [[0.5, 0], [0, 0.25]])
