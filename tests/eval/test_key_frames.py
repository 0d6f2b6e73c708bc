"""Frames of the chain without depth: what is known of their corners, and turns that the prediction misses."""

from dataclasses import replace

import numpy as np
import pytest

from studies.synthetic_street import Clip, rig_poses
from tasks.eval.poses.essential import EssentialSettings
from tasks.eval.poses.key_frames import KeyFrame, keep_sharper_depth, make_key_frame
from tasks.eval.poses.point_pairs import Tracker, correct_turn
from tasks.eval.poses.rigid import Floats, invert_pose
from tasks.eval.poses.twists import pose_from_twist

RULES = (Tracker(11, 1, 0.3), 40, 1.5)
"""As the chain calls `correct_turn`: the tracker, fewest corners [1], near [px]."""


def make_frame(clip: Clip, index: int) -> KeyFrame:
    return make_key_frame(index, clip.frames[index], 34, 0.02, 11, EssentialSettings().least_contrast)


def camera_step(clip: Clip, index: int) -> Floats:
    poses = rig_poses(clip.station, clip.heave, clip.pitch) @ clip.T_rig_camera
    return invert_pose(poses[index]) @ poses[index + 1]


def turn_by(degrees: float) -> Floats:
    return pose_from_twist(np.array([0, 0, 0, np.deg2rad(degrees), 0, 0]))


@pytest.mark.parametrize("degrees", [-2.5, 0.0, 0.2, 2.5])
def test_a_prediction_that_is_turned_wrongly_is_turned_back(hump_clip: Clip, degrees: float) -> None:
    earlier, later = make_frame(hump_clip, 4), make_frame(hump_clip, 5)
    inverse_depth = np.nan_to_num(1 / hump_clip.depth[4], posinf=0.0).astype(np.float32)
    true = camera_step(hump_clip, 4)
    predicted = true @ turn_by(degrees)
    corrected = correct_turn(
        (earlier.coarse, earlier.corners), later.coarse, inverse_depth, predicted, hump_clip.K, *RULES
    )
    if abs(degrees) < 0.3:  # a pixel: within the tracker's reach
        assert corrected is predicted
    else:
        left = np.rad2deg(np.abs(corrected[:3, :3] @ true[:3, :3].T - np.eye(3)).max())
        assert left < 0.1


def test_a_prediction_stays_where_nothing_can_be_tracked(hump_clip: Clip) -> None:
    earlier = make_frame(hump_clip, 4)
    blank, flat = np.zeros_like(earlier.coarse), np.zeros_like(earlier.inverse_depth)
    predicted = camera_step(hump_clip, 4)
    seen = (earlier.coarse, earlier.corners), blank
    assert correct_turn(*seen, flat, predicted, hump_clip.K, *RULES) is predicted


def test_of_two_depths_of_a_corner_the_sharper_one_is_kept(hump_clip: Clip) -> None:
    frame = make_frame(hump_clip, 0)
    count = len(frame.corners)
    even = np.arange(count) % 2 == 0
    first = replace(frame, depth=np.full(count, 5.0), precision=np.ones(count))
    second = replace(frame, depth=np.full(count, 6.0), precision=np.where(even, 2.0, 0.0))
    kept = keep_sharper_depth(first, second)
    assert np.array_equal(kept.depth, np.where(even, 6.0, 5.0))
    assert np.array_equal(kept.precision, np.where(even, 2.0, 1.0))
    assert kept.inverse_depth is first.inverse_depth
