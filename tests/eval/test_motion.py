"""Chaining steps into motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from studies.synthetic_street import hump_drive, make_mount, rig_poses
from tasks.eval.poses.motion import MAX_GAP, FrameStep, Placement, failed_step, integrate_motion, place_frames
from tasks.eval.poses.rigid import invert_pose


def exact_steps(
    T_world_rig: NDArray[np.float64], anchors: list[int], variance: float = 0.0
) -> list[Placement]:
    cameras = T_world_rig @ make_mount()
    return [
        Placement(
            anchor=a,
            step=FrameStep(
                T_earlier_later=invert_pose(cameras[a]) @ cameras[k],
                covariance=variance * np.eye(6),
                inliers=9,
            ),
        )
        for k, a in enumerate(anchors, start=1)
    ]


@pytest.mark.parametrize("curvature", [0.0, 1 / 50])
def test_exact_steps_give_the_exact_motion_of_the_rig(curvature: float) -> None:
    station, heave, pitch = hump_drive(30, 10.0)
    T_world_rig = rig_poses(station, heave, pitch, curvature)
    seen = integrate_motion("exact", exact_steps(T_world_rig, list(range(29))), make_mount())
    np.testing.assert_allclose(seen.pitch, pitch, atol=1e-12)
    np.testing.assert_allclose(seen.heave, heave, atol=1e-12)
    # chords are shorter than the arc by (step / radius)^2 / 24 of the way, 2e-5 in this bend
    np.testing.assert_allclose(seen.progress, station, rtol=0 if curvature == 0 else 3e-5, atol=1e-9)
    np.testing.assert_allclose(seen.lateral, T_world_rig[:, 1, 3], atol=1e-12)
    np.testing.assert_allclose(seen.T_rig0_rig, T_world_rig, atol=1e-12)
    np.testing.assert_allclose(seen.T_rig0_rig[:-1] @ seen.T_previous_rig[1:], T_world_rig[1:], atol=1e-12)
    assert seen.inliers.tolist() == [0] + 29 * [9]


def test_along_a_hilly_route_only_the_body_s_own_motion_remains() -> None:
    s = np.linspace(0.0, 20.0, 41)
    slope = 0.08 * np.sin(s / 6)  # climbs and falls, nose-down positive
    rise = np.concatenate([[0.0], np.cumsum(np.diff(s) * -np.sin((slope[1:] + slope[:-1]) / 2))])
    along = np.concatenate([[0.0], np.cumsum(np.diff(s) * np.cos((slope[1:] + slope[:-1]) / 2))])
    route = rig_poses(along, rise, slope)
    body_pitch, body_heave = 0.02 * np.sin(s), 0.03 * np.sin(0.7 * s)
    body = route @ rig_poses(0 * s, body_heave, body_pitch)
    steps = exact_steps(body, list(range(40)))
    seen = integrate_motion("exact", steps, make_mount(), route_rotations=route[:, :3, :3])
    np.testing.assert_allclose(seen.pitch, body_pitch, atol=1e-12)
    np.testing.assert_allclose(seen.progress, s, atol=0.01)
    np.testing.assert_allclose(seen.heave, body_heave, atol=0.002)
    blind = integrate_motion("exact", steps, make_mount())
    assert np.abs(blind.pitch - body_pitch).max() > 0.05


def test_frames_are_placed_against_the_last_good_one_and_predicted_at_its_velocity() -> None:
    asked = []

    def place(anchor: int, frame: int, predicted: NDArray[np.float64]) -> FrameStep:
        asked.append((anchor, frame, predicted[2, 3]))
        if frame in (3, 4):
            return failed_step("it is dark", 0)
        T = np.eye(4)
        T[2, 3] = 2.0 * (frame - anchor)
        return FrameStep(T_earlier_later=T, covariance=np.eye(6), inliers=1)

    placements = place_frames(7, place)
    assert [p.anchor for p in placements] == [0, 1, 2, 2, 2, 5]
    assert asked == [(0, 1, 0.0), (1, 2, 2.0), (2, 3, 2.0), (2, 4, 4.0), (2, 5, 6.0), (5, 6, 2.0)]
    seen = integrate_motion("test", placements, make_mount(tilt=0.0))
    assert seen.failed.tolist() == [False, False, False, True, True, False, False]
    assert seen.failures[0] == "test: frame 3 has no pose: it is dark."
    np.testing.assert_allclose(seen.progress[[2, 5, 6]], [4.0, 10.0, 12.0])


def test_a_gap_beyond_the_limit_is_never_bridged() -> None:
    calls = []

    def place(anchor: int, frame: int, predicted: NDArray[np.float64]) -> FrameStep:
        calls.append(frame)
        return failed_step("it is dark", 0)

    assert all(p.step.failure for p in place_frames(20, place))
    assert calls == list(range(1, MAX_GAP + 1))


@pytest.mark.parametrize(("by_region", "grows"), [(None, 0.5), (1e-5, 0.5), (2e-3, 1.0)])
def test_uncertainty_grows_as_independent_steps_or_as_lasting_errors_whichever_is_more(
    by_region: float | None, grows: float
) -> None:
    poses = rig_poses(np.arange(17.0), np.zeros(17), np.zeros(17))
    level = np.eye(4)
    level[:3, :3] = make_mount(tilt=0.0)[:3, :3]
    steps = exact_steps(poses @ level @ invert_pose(make_mount()), list(range(16)), 1e-6)
    if by_region is not None:
        twists = by_region * np.eye(6)
        steps = [replace(one, step=replace(one.step, region_twists=twists)) for one in steps]
    seen = integrate_motion("test", steps, level)
    one = 1e-3 if grows == 0.5 else by_region
    np.testing.assert_allclose(seen.pitch_std, one * np.arange(17) ** grows, rtol=1e-9)
    np.testing.assert_allclose(seen.progress_std, one * np.arange(17) ** grows, rtol=1e-9)


def test_propagated_uncertainty_matches_a_thousand_perturbed_chains() -> None:
    from tasks.eval.poses.twists import pose_from_twist

    station, heave, pitch = hump_drive(8, 10.0, hump_at=0.1)
    exact = exact_steps(rig_poses(station, heave, pitch, 1 / 40), list(range(7)), 1e-6)
    rng = np.random.default_rng(4)
    pitches, ways = [], []
    for _ in range(1000):
        shaken = [
            Placement(
                anchor=p.anchor,
                step=FrameStep(
                    T_earlier_later=pose_from_twist(rng.normal(0, 1e-3, 6)) @ p.step.T_earlier_later,
                    covariance=p.step.covariance,
                    inliers=9,
                ),
            )
            for p in exact
        ]
        seen = integrate_motion("shaken", shaken, make_mount())
        pitches.append(seen.pitch[-1])
        ways.append(seen.progress[-1])
    stated = integrate_motion("exact", exact, make_mount())
    assert np.std(pitches) == pytest.approx(stated.pitch_std[-1], rel=0.1)
    assert np.std(ways) == pytest.approx(stated.progress_std[-1], rel=0.1)
