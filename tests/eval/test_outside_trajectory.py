"""Trajectories from outside: any world frame and any unit of length give the same motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studies.foreign_video.outside_trajectory import motion_from_trajectory
from studies.synthetic_street import Clip
from tasks.errors import InputError
from tests.eval.scoring import normalised_progress_rmse, pitch_rmse_deg, progress_rmse


def move_trajectory(poses: np.ndarray, scale: float) -> np.ndarray:
    """The same trajectory in another world frame and unit."""
    world = np.eye(4)
    world[:3, :3] = Rotation.from_euler("zyx", [130, -40, 25], degrees=True).as_matrix()
    world[:3, 3] = [3.0, -7.0, 11.0]
    moved = world @ poses
    moved[:, :3, 3] *= scale
    return moved


def poses_of(clip: Clip) -> np.ndarray:
    return clip.T_world_rig @ clip.T_rig_camera


def test_a_true_trajectory_in_metres_gives_the_true_motion_from_any_world_frame(hump_clip: Clip) -> None:
    times = np.arange(len(hump_clip.frames)) / 16.0
    seen = motion_from_trajectory(
        "exact", times, times, move_trajectory(poses_of(hump_clip), 1.0), hump_clip.T_rig_camera, metric=True
    )
    assert pitch_rmse_deg(seen, hump_clip) < 1e-6
    assert progress_rmse(seen, hump_clip) < 2e-3  # the claimed way is along the road, the rig's over the hump
    assert np.isnan(seen.pitch_std).all() and not seen.failed.any()


def test_an_unknown_unit_leaves_pitch_and_shape_and_no_length(hump_clip: Clip) -> None:
    times = np.arange(len(hump_clip.frames)) / 16.0
    made = [
        motion_from_trajectory(
            "mono",
            times,
            times,
            move_trajectory(poses_of(hump_clip), scale),
            hump_clip.T_rig_camera,
            metric=False,
        )
        for scale in (0.05, 20.0)
    ]
    np.testing.assert_allclose(made[0].pitch, made[1].pitch, atol=1e-12)
    np.testing.assert_allclose(made[0].normalised_path, made[1].normalised_path, atol=1e-12)
    assert np.isnan(made[0].progress).all() and np.isnan(made[0].T_rig0_rig[:, :3, 3]).all()
    assert pitch_rmse_deg(made[0], hump_clip) < 1e-6
    assert normalised_progress_rmse(made[0], hump_clip) < 2e-3


def test_a_frame_without_a_pose_has_failed_and_the_rest_stands(hump_clip: Clip) -> None:
    times = np.arange(len(hump_clip.frames)) / 16.0
    kept = np.delete(np.arange(len(times)), [5, 6])
    seen = motion_from_trajectory(
        "gappy", times, times[kept], poses_of(hump_clip)[kept], hump_clip.T_rig_camera, metric=True
    )
    assert list(np.flatnonzero(seen.failed)) == [5, 6] and len(seen.failures) == 2
    assert pitch_rmse_deg(seen, hump_clip) < 1e-6


def test_a_trajectory_of_another_time_is_refused(hump_clip: Clip) -> None:
    times = np.arange(len(hump_clip.frames)) / 16.0
    with pytest.raises(InputError, match="must have a pose at the first frame"):
        motion_from_trajectory(
            "late", times, times + 9.0, poses_of(hump_clip), hump_clip.T_rig_camera, metric=True
        )
