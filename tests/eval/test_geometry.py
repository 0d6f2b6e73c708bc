"""Small rigid-body, point and two-view geometry, against other implementations."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.linalg import expm

from studies.synthetic_street import camera_matrix, make_mount
from tasks.eval.poses.corners import (
    corner_strength,
    even_contrast,
    grid_corners,
    merge_tracks,
    track_corners,
)
from tasks.eval.poses.epipolar import (
    fit_rotation,
    refine_essential,
    scaled_step,
    step_length,
    triangulate_points,
)
from tasks.eval.poses.motion import Placement, integrate_motion
from tasks.eval.poses.rigid import (
    adjoint_matrix,
    advance_pose,
    invert_pose,
    project_points,
    projection_jacobian,
    skew_matrix,
    viewing_rays,
)
from tasks.eval.poses.solve_pnp import (
    PnpLimits,
    _measure_residuals,
    _solve_symmetric,
    _sum_normal_equations,
    solve_pnp,
)
from tasks.eval.poses.twists import pose_from_twist
from tasks.eval.poses.warp import bilinear_taps, view_from, warp_map

K = camera_matrix()
LIMITS = PnpLimits(min_inliers=100, noise_floor=1e-6, noise_ceiling=2.0)
MOTION = pose_from_twist(np.array([0.03, -0.05, -0.9, 0.01, -0.02, 0.005]))
"""T_later_earlier of a car that goes 0.9 m ahead and nods."""


def cloud(count: int = 400, seed: int = 2) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = rng.uniform(5, 40, count)
    return np.column_stack([rng.uniform(-0.5, 0.5, count) * z, rng.uniform(-0.3, 0.3, count) * z, z])


def seen_by_both(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return project_points(points, K), project_points(points @ MOTION[:3, :3].T + MOTION[:3, 3], K)


@pytest.mark.parametrize("size", [0.0, 1e-6, 1e-3, 0.7, 2.5])
def test_twists_are_the_matrix_exponential(size: float) -> None:
    twist = size * np.array([0.4, -1.0, 0.3, 0.2, 0.5, -0.6])
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = skew_matrix(twist[3:]), twist[:3]
    np.testing.assert_allclose(pose_from_twist(twist), expm(generator), atol=1e-12)


def test_an_inverse_undoes_and_keeps_nan() -> None:
    np.testing.assert_allclose(invert_pose(MOTION) @ MOTION, np.eye(4), atol=1e-15)
    stack = np.stack([MOTION, np.full((4, 4), np.nan)])
    assert np.isnan(invert_pose(stack)[1, :3]).all()


def test_the_adjoint_carries_a_twist_to_the_other_frame() -> None:
    twist = 1e-3 * np.arange(1.0, 7.0)
    carried = pose_from_twist(adjoint_matrix(MOTION) @ twist)
    np.testing.assert_allclose(carried, MOTION @ pose_from_twist(twist) @ invert_pose(MOTION), atol=1e-12)


def test_the_solver_s_sums_are_those_of_its_numpy_twin() -> None:
    points, weight, share = cloud(60), np.linspace(0, 1, 60), 0.3
    pixels = project_points(points, K) + np.random.default_rng(4).normal(size=(60, 2))
    moved = points @ MOTION[:3, :3].T + MOTION[:3, 3]
    J, residual = projection_jacobian(moved, K), pixels - project_points(moved, K)
    a = np.einsum("nij,nj->ni", J[:, :, :3], moved - MOTION[:3, 3]) * share
    inverse = np.linalg.inv(np.eye(2) + a[:, :, None] * a[:, None, :])
    H, gradient = _sum_normal_equations(points, pixels, MOTION, K, share, weight)
    np.testing.assert_allclose(H, np.einsum("n,nai,nab,nbj->ij", weight, J, inverse, J), rtol=1e-9)
    np.testing.assert_allclose(
        gradient, np.einsum("n,nai,nab,nb->i", weight, J, inverse, residual), rtol=1e-8
    )
    size = np.empty(60)
    assert _measure_residuals(points, pixels, MOTION, K, share, size) == 60
    np.testing.assert_allclose(size**2, np.einsum("na,nab,nb->n", residual, inverse, residual), rtol=1e-9)
    points[7, 2] = -5.0
    assert _measure_residuals(points, pixels, MOTION, K, share, size) == 59 and np.isinf(size[7])


def test_an_advance_is_along_the_rig_s_axis_whatever_the_mount() -> None:
    T = make_mount() @ advance_pose(2.0, make_mount()) @ invert_pose(make_mount())
    np.testing.assert_allclose(T[:3, 3], [2.0, 0.0, 0.0], atol=1e-15)


def test_the_projection_s_jacobian_is_its_difference_quotient() -> None:
    points, J = cloud(5), projection_jacobian(cloud(5), K)
    for axis in range(6):
        twist = np.zeros(6)
        twist[axis] = 1e-6
        quotient = []
        for sign in (1, -1):
            T = pose_from_twist(sign * twist)
            quotient.append(project_points(points @ T[:3, :3].T + T[:3, 3], K))
        np.testing.assert_allclose(J[:, :, axis], (quotient[0] - quotient[1]) / 2e-6, rtol=1e-5, atol=1e-4)


def test_exact_points_place_the_camera_exactly_though_a_third_of_them_lie() -> None:
    points = cloud()
    _, pixels = seen_by_both(points)
    pixels[::3] += np.random.default_rng(1).uniform(5, 40, pixels[::3].shape)
    step = solve_pnp(points, pixels, np.eye(4), K, LIMITS)
    assert not step.failure and step.inliers == 266
    np.testing.assert_allclose(invert_pose(step.T_earlier_later), MOTION, atol=1e-9)


def test_the_point_solver_agrees_with_opencv_and_states_its_spread() -> None:
    points, rng = cloud(), np.random.default_rng(7)
    _, exact = seen_by_both(points)
    errors, theirs = [], []
    for _ in range(300):
        pixels = exact + rng.normal(0, 0.3, exact.shape)
        step = solve_pnp(points, pixels, np.eye(4), K, LIMITS)
        off = step.T_earlier_later @ MOTION
        errors.append([*off[:3, 3], off[2, 1], off[0, 2], off[1, 0]])
        _, r, _ = cv2.solvePnP(points, pixels, K, None, flags=cv2.SOLVEPNP_ITERATIVE)
        theirs.append(
            np.linalg.norm(r.ravel() - cv2.Rodrigues(invert_pose(step.T_earlier_later)[:3, :3])[0].ravel())
        )
    stated = np.sqrt(np.diag(step.covariance))
    np.testing.assert_allclose(np.std(errors, axis=0), stated, rtol=0.25)
    assert np.median(theirs) < stated[3:].max()


def test_points_that_do_not_agree_are_a_failure() -> None:
    points = cloud(50)
    pixels = np.random.default_rng(0).uniform(0, 300, (50, 2))
    limits = PnpLimits(min_inliers=45, noise_floor=0.01, noise_ceiling=2.0)
    assert "miss the best pose" in solve_pnp(points, pixels, np.eye(4), K, limits).failure
    _, exact = seen_by_both(points)
    exact[:10] += 30.0
    assert "40 of 50 tracked points agree" in solve_pnp(points, exact, np.eye(4), K, limits).failure


def test_points_that_do_not_fix_the_pose_are_a_failure() -> None:
    points = np.tile([0.5, 0.2, 8.0], (50, 1))
    limits = PnpLimits(min_inliers=30, noise_floor=0.01, noise_ceiling=2.0)
    assert "do not fix the pose" in solve_pnp(points, project_points(points, K), np.eye(4), K, limits).failure


def test_the_solver_s_six_equations_are_solved_as_by_a_library() -> None:
    spread = np.random.default_rng(5).normal(size=(6, 9))
    H, right, x = spread @ spread.T, np.arange(6.0), np.empty(6)
    assert not _solve_symmetric(-H, right, x)
    assert _solve_symmetric(H, right, x)
    np.testing.assert_allclose(x, np.linalg.solve(H, right), rtol=1e-9)


def test_an_error_of_depth_does_less_harm_where_it_is_expected() -> None:
    points, rng = cloud(), np.random.default_rng(11)
    _, exact = seen_by_both(points)
    harm = {0.0: [], 0.02: []}  # by the depth error that the limits state
    for _ in range(60):
        wrong = points * (1 + rng.normal(0, 0.02, (len(points), 1)))
        pixels = exact + rng.normal(0, 0.05, exact.shape)
        for stated, turns in harm.items():
            limits = PnpLimits(min_inliers=100, noise_floor=1e-6, noise_ceiling=5.0, depth_error=stated)
            step = solve_pnp(wrong, pixels, np.eye(4), K, limits)
            off = step.T_earlier_later @ MOTION
            turns.append([off[2, 1], off[0, 2], off[1, 0]])
    assert np.std(harm[0.02]) < 0.7 * np.std(harm[0.0])


@pytest.mark.parametrize(("shift_px", "depth_error"), [(0.3, 0.0), (0.0, 0.01)])
def test_errors_that_stay_in_a_region_for_many_steps_are_in_the_uncertainty(
    shift_px: float, depth_error: float
) -> None:
    points, rng = cloud(), np.random.default_rng(13)
    _, exact = seen_by_both(points)
    column, row = ((exact - exact.min(axis=0)) // 50).astype(int).T
    region, regions = 10 * row + column, 10 * (row.max() + 1)
    limits = replace(LIMITS, depth_error=depth_error, regions=regions)
    errors, stated = [], []
    for _ in range(60):
        pixels = exact + rng.normal(0, shift_px, (regions, 2))[region] + rng.normal(0, 0.03, exact.shape)
        deep = points * (1 + rng.normal(0, depth_error, regions)[region])[:, None]
        for seen, found in ((deep, errors), (points, stated)):
            step = solve_pnp(seen, pixels, np.eye(4), K, limits, region)
            chain = [Placement(anchor=k, step=step) for k in range(6)]
            found.append(integrate_motion("drawn", chain, make_mount()))
    for name in ("pitch", "progress"):
        spread = np.std([getattr(motion, name)[-1] for motion in errors])
        assert np.median([getattr(m, f"{name}_std")[-1] for m in stated]) == pytest.approx(spread, rel=0.35)


def test_turn_direction_depth_and_length_come_out_of_two_views_exactly() -> None:
    points = cloud()
    rays, later_rays = (viewing_rays(p, K) for p in seen_by_both(points))
    later_rays[::5, 0] += 0.05
    t = MOTION[:3, 3]
    start = pose_from_twist(np.array([0, 0, 0, 0.005, 0.005, 0.0]))[:3, :3] @ MOTION[:3, :3]
    R, direction, covariance, weight = refine_essential(
        start, np.array([0.1, 0.0, -1.0]) / np.hypot(0.1, 1), rays, later_rays, 400.0, 1e-7
    )
    np.testing.assert_allclose(R, MOTION[:3, :3], atol=1e-8)
    np.testing.assert_allclose(direction, t / np.linalg.norm(t), atol=1e-7)
    honest = np.arange(len(points)) % 5 != 0
    depth, later_depth, precision = triangulate_points(rays, later_rays, R, direction)
    np.testing.assert_allclose(depth[honest] * np.linalg.norm(t), points[honest, 2], rtol=1e-4)
    np.testing.assert_allclose(
        later_depth[honest] * np.linalg.norm(t), (points @ MOTION[2, :3] + t[2])[honest], rtol=1e-4
    )
    length, _ = step_length(points[:, 2], precision, depth, np.where(weight > 0, precision, 0.0))
    assert length == pytest.approx(np.linalg.norm(t), rel=1e-6)
    step = scaled_step(R, direction, covariance, length, 0.0, 320)
    np.testing.assert_allclose(invert_pose(step.T_earlier_later), MOTION, atol=1e-6)


def test_a_pure_turn_leaves_no_parallax_and_a_way_does() -> None:
    points = cloud()
    R = MOTION[:3, :3]
    turned, rest = fit_rotation(points / points[:, 2:], (points @ R.T) / (points @ R.T)[:, 2:], 400.0)
    np.testing.assert_allclose(turned, R, atol=1e-9)
    assert rest < 1e-6
    rays, later_rays = (viewing_rays(p, K) for p in seen_by_both(points))
    assert fit_rotation(rays, later_rays, 400.0)[1] > 1.0


def test_no_shared_depth_is_no_length() -> None:
    nothing = np.zeros(3)
    assert np.isnan(step_length(np.ones(3), nothing, np.ones(3), np.ones(3))[0])


def test_a_warp_map_says_where_the_sampler_really_looks() -> None:
    ramp = np.tile(np.arange(0, 240, 2, dtype=np.uint8), (60, 1))
    turn = np.eye(4)
    turn[:3, :3] = pose_from_twist(np.array([0, 0, 0, 0.0, 0.0101, 0.0]))[:3, :3]
    k = camera_matrix(120, 60, 100.0)
    where = warp_map(np.zeros((60, 120), np.float32), turn, k)
    np.testing.assert_array_equal(where * 32, np.rint(where * 32))
    inner = (slice(5, -5), slice(5, -5))
    np.testing.assert_allclose(view_from(ramp, where)[inner], 2 * where[inner][..., 0], atol=0.6)


def test_bilinear_taps_are_exact_on_a_plane_and_know_the_edge() -> None:
    v, u = np.mgrid[0:20, 0:30].astype(float)
    plane = 3 * u - 2 * v + 1
    at = np.array([[4.25, 7.5], [29.0, 19.0], [29.5, 3.0], [-0.1, 3.0]], np.float32)
    taps, weights, inside = bilinear_taps(at, plane.shape)
    assert inside.tolist() == [True, True, False, False]
    np.testing.assert_allclose(
        (weights * plane[taps]).sum(axis=0)[:2], [3 * 4.25 - 15 + 1, 87 - 38 + 1], atol=0.01
    )


def test_corners_that_are_tracked_in_two_lots_go_where_they_go_together() -> None:
    rng = np.random.default_rng(8)
    earlier = cv2.GaussianBlur(rng.integers(0, 256, (96, 128)).astype(np.uint8), (0, 0), 1.5)
    later = np.roll(earlier, (1, 2), axis=(0, 1))
    corners = grid_corners(corner_strength(earlier), 16, 6, 0.0).astype(np.float32)
    lot = np.arange(len(corners)) % 3 > 0
    together, first, second = (
        track_corners(earlier, later, some, 11, 1, 0.3) for some in (corners, corners[lot], corners[~lot])
    )
    merged = merge_tracks(lot, first, second)
    assert together.came_back.mean() > 0.5
    for ours, theirs in zip(merged, together, strict=True):
        assert np.array_equal(ours, theirs)
    assert len(track_corners(earlier, later, corners[:0], 11, 1, 0.3).came_back) == 0


def test_a_patch_looks_alike_under_any_light_and_noise_stays_noise() -> None:
    patch = np.random.default_rng(3).integers(60, 180, (40, 50)).astype(np.float64)
    bright = even_contrast(np.rint(patch).astype(np.uint8), 11, 2.0).astype(float)
    dull = even_contrast(np.rint(200 - 0.5 * (200 - patch)).astype(np.uint8), 11, 2.0).astype(float)
    assert np.abs(bright - dull).max() < 4 and bright.std() > 30
    flat = even_contrast(np.full((40, 50), 90, np.uint8) + np.eye(40, 50, dtype=np.uint8), 11, 2.0)
    assert np.abs(flat.astype(float) - 128).max() < 25
