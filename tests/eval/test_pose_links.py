"""Longer steps beside a chain: they take out what every short step gets wrong alike."""

from dataclasses import replace

import numpy as np
import pytest

from studies.synthetic_street import Clip, drive_clip
from tasks.eval.poses import essential
from tasks.eval.poses.essential import EssentialSettings, recover_motion_essential
from tasks.eval.poses.links import Link, chained_poses, link_placements
from tasks.eval.poses.motion import FrameStep, Placement, failed_step
from tasks.eval.poses.rigid import invert_pose
from tasks.eval.poses.twists import pose_from_twist
from tests.eval.scoring import normalised_progress_rmse, pitch_rmse_deg
from tests.eval.weathering import add_noise

AHEAD = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
TILT = np.array([0.0, 0.0, 0.0, 1e-4, 0.0, 0.0])
NONE = 10_000
"""A span longer than any clip: no links."""


def make_step(twist: np.ndarray, variance: float = 1e-8) -> FrameStep:
    return FrameStep(T_earlier_later=pose_from_twist(twist), covariance=np.eye(6) * variance, inliers=100)


def biased_chain(count: int) -> list[Placement]:
    """Straight ahead, each step tilted by 0.1 mrad."""
    return [Placement(anchor=k, step=make_step(AHEAD + TILT)) for k in range(count - 1)]


def tilt_angles(placements: list[Placement]) -> np.ndarray:
    poses = np.stack(chained_poses(placements))
    return np.arctan2(-poses[:, 1, 2], poses[:, 2, 2])


def test_a_bias_of_every_step_is_shared_out_by_weight():
    # two steps of variance 1 each against a link of 1: the link has 2 votes of 3, by hand
    turning = [Placement(anchor=k, step=make_step(TILT)) for k in range(2)]
    linked = link_placements(turning, [Link(earlier=0, later=2, step=make_step(TILT))])
    np.testing.assert_allclose(tilt_angles(linked), [0.0, 2e-4 / 3, 4e-4 / 3], rtol=1e-3)


def test_links_over_more_frames_leave_less_of_it():
    left = []
    for span in (2, 4, 8):
        links = [
            Link(earlier=k, later=k + span, step=make_step(span * AHEAD + TILT))
            for k in range(0, 33 - span, 2)
        ]
        left.append(tilt_angles(link_placements(biased_chain(33), links))[-1])
    assert 32e-4 > left[0] > left[1] > left[2] > 4e-4
    assert left[2] < 32e-4 / 4


def test_links_that_agree_change_nothing():
    chain = [Placement(anchor=k, step=make_step(AHEAD)) for k in range(8)]
    linked = link_placements(chain, [Link(earlier=0, later=5, step=make_step(5 * AHEAD))])
    np.testing.assert_allclose(chained_poses(linked), chained_poses(chain), atol=1e-12)


def test_failed_links_and_failed_frames_are_passed_over():
    chain = biased_chain(6)
    assert link_placements(chain, [Link(earlier=0, later=4, step=failed_step("nothing", 0))]) == chain
    lost = failed_step("it was dark", 0)
    chain[2] = Placement(anchor=2, step=lost)
    chain[3] = Placement(anchor=2, step=make_step(2 * AHEAD + 2 * TILT))
    linked = link_placements(chain, [Link(earlier=0, later=5, step=make_step(5 * AHEAD + TILT))])
    assert linked[2].step is lost and np.isnan(chained_poses(linked)[3]).all()
    assert 0 < tilt_angles(linked)[-1] < tilt_angles(chain)[-1] / 2


def test_a_step_that_states_no_error_is_believed_all_but_wholly():
    sure = replace(make_step(2 * AHEAD), covariance=np.zeros((6, 6)))
    assert (
        abs(tilt_angles(link_placements(biased_chain(3), [Link(earlier=0, later=2, step=sure)]))[-1]) < 1e-9
    )


def test_links_hold_the_camera_only_pitch(full_clip: Clip) -> None:
    arguments = (full_clip.frames, full_clip.K, full_clip.T_rig_camera)
    bare, tied = (
        pitch_rmse_deg(recover_motion_essential(*arguments, settings=settings), full_clip)
        for settings in (EssentialSettings(link_span=NONE), EssentialSettings())
    )
    assert tied < 0.6 * bare


def test_the_depths_of_links_keep_the_unit_of_length(monkeypatch: pytest.MonkeyPatch) -> None:
    clip = drive_clip(frames=28, frame_rate=10.0, hump_at=1.0, width=240, height=160, focal=200.0)
    noisy = (add_noise(clip.frames, 10.0), clip.K, clip.T_rig_camera)
    kept = normalised_progress_rmse(recover_motion_essential(*noisy), clip)
    monkeypatch.setattr(essential, "keep_sharper_depth", lambda frame, linked: frame)
    crept = normalised_progress_rmse(recover_motion_essential(*noisy), clip)
    assert kept < 0.0025 < crept


def test_poses_of_the_chain_are_products_of_its_steps():
    poses = chained_poses(biased_chain(3))
    np.testing.assert_allclose(invert_pose(poses[1]) @ poses[2], pose_from_twist(AHEAD + TILT), atol=1e-12)
