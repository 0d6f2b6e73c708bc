"""The steps from pictures to surfaces, each against what it must find."""

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.reconstruction.camera import pixel_rays
from tasks.reconstruction.cloud import (
    LONGEST,
    _depth_factor_onto_route,
    _split_long_discs,
    classify_points,
    measure_carriageway,
)
from tasks.reconstruction.disparity import fill_disparity, match_stereo
from tasks.reconstruction.exposure import estimate_exposure
from tasks.reconstruction.fusion import find_finest_view, fuse_depth
from tasks.reconstruction.normals import estimate_normals, turn_to_camera
from tasks.reconstruction.road_plane import fit_road_plane, lay_route_below, settle_route
from tasks.reconstruction.surfels import COVERAGE, derive_discs, sample_picture
from tasks.render.composition import to_display
from tasks.scene.route import Route
from tests.reconstruction.small_camera import CX, CY, SCALE, SHAPE, F, K, draw_smooth_noise


def plane_depth(normal: tuple[float, float, float], distance: float) -> np.ndarray:
    """Depth picture of the plane normal . X = distance, camera coordinates; NaN where it is not seen."""
    along = pixel_rays(SHAPE, K) @ np.array(normal)
    with np.errstate(divide="ignore"):
        depth = distance / along
    return np.where((depth > 0) & (depth < 200), depth, np.nan).astype(np.float32)


def shift_picture(picture: np.ndarray, by: float) -> np.ndarray:
    """The periodic picture moved to the left by a part of a pixel, by its spectrum."""
    phase = np.exp(2j * np.pi * np.fft.rfftfreq(picture.shape[1]) * by)
    return np.fft.irfft(np.fft.rfft(picture, axis=1) * phase, picture.shape[1], axis=1)


@pytest.mark.parametrize("disparity", [12.0, 12.4, 7.75])
def test_disparity_is_found_to_a_fraction_of_a_pixel(disparity: float) -> None:
    left = draw_smooth_noise((80, 200), 1)
    to_bytes = [np.clip(np.rint(p), 0, 255).astype(np.uint8) for p in (left, shift_picture(left, disparity))]
    found = match_stereo(*to_bytes, 32)
    inner = found[10:-10, 40:-10]
    assert np.isfinite(inner).mean() > 0.97
    assert np.nanmedian(np.abs(inner - disparity)) < 0.08


def test_what_the_right_camera_does_not_see_has_no_disparity() -> None:
    left = draw_smooth_noise((80, 200), 2).clip(0, 255).astype(np.uint8)
    found = match_stereo(left, shift_picture(left.astype(float), 15.0).clip(0, 255).astype(np.uint8), 32)
    assert np.isnan(found[:, :10]).mean() > 0.9


def test_a_gap_is_filled_with_the_farther_neighbour() -> None:
    n = np.nan
    disparity = np.array([[n, 9, n, n, 4, n], [n, n, n, n, n, n]], dtype=np.float32)
    sky = np.zeros((2, 6), bool)
    np.testing.assert_array_equal(fill_disparity(disparity, sky)[0], [9, 9, 4, 4, 4, 4])
    assert np.isnan(fill_disparity(disparity, sky)[1]).all()
    sky[0, 5] = True
    assert np.isnan(fill_disparity(disparity, sky)[0, 5])


def test_plane_of_the_road_is_found_despite_a_kerb() -> None:
    tilt = np.radians(2.0)
    down = (0.02, np.cos(tilt), np.sin(tilt))
    down = tuple(np.array(down) / np.linalg.norm(down))
    disparity = SCALE / plane_depth(down, 1.6)
    disparity[60:, :60] += 1.5
    plane = fit_road_plane(disparity, K, SCALE)
    np.testing.assert_allclose(plane[:3], -np.array(down), atol=2e-3)
    assert plane[3] == pytest.approx(1.6, abs=0.01)


def test_a_picture_without_road_has_no_plane() -> None:
    assert np.isnan(fit_road_plane(np.full(SHAPE, np.nan, np.float32), K, SCALE)).all()


def straight_route(length: float = 20.0) -> Route:
    station = np.arange(0, length + 0.1, 0.5)
    poses = np.tile(np.eye(4), (len(station), 1, 1))
    poses[:, 0, 3] = station
    return Route(station=station, T_world_rig=poses)


def test_route_lies_below_the_cameras_and_ahead_of_them() -> None:
    poses = np.tile(np.eye(4), (11, 1, 1))
    poses[:, 2, 3] = np.arange(11.0)  # along camera z
    planes = np.tile([0.0, -1.0, 0.0, 1.5], (11, 1))
    route = lay_route_below(poses, planes, -1.0, 2.0, 5.0)
    np.testing.assert_allclose(route.T_world_rig[0, :3, 3], [0, 1.5, 3.0], atol=1e-6)
    np.testing.assert_allclose(route.T_world_rig[0, :3, :3].T, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-6)
    assert route.length == pytest.approx(10 - 2 + 5)


def test_route_settles_on_the_surface_and_rolls_with_it() -> None:
    draw = np.random.Generator(np.random.Philox(4))
    x, y = draw.uniform(0, 12, 4000), draw.uniform(-3, 3, 4000)
    z = 0.05 + 0.03 * y
    z[:500] += 0.25  # a parked car's side, a kerb
    route = settle_route(straight_route(), np.stack([x, y, z], axis=1), np.full(4000, 7.0))
    np.testing.assert_allclose(route.T_world_rig[2:-2, 2, 3], 0.05, atol=0.01)
    np.testing.assert_allclose(route.T_world_rig[2:-2, 1, 2], -0.03, atol=0.006)


def test_carriageway_ends_at_the_kerb_and_at_the_limit() -> None:
    draw = np.random.Generator(np.random.Philox(6))
    station, lateral = draw.uniform(0, 20, 20000), draw.uniform(-8, 8, 20000)
    height = np.where(lateral > 2.3, 0.12, 0.01) + draw.normal(0, 0.01, 20000)
    left, right = measure_carriageway(station, lateral, height, np.full(20000, 8.0), 20.0, 5.0)
    assert left == pytest.approx(2.3, abs=0.11)
    assert right == -5.0


def test_classes_follow_height_and_side() -> None:
    lateral, height = np.array([0, 0, 4, 4, 0]), np.array([0.02, 0.5, 0.1, 2.0, 0.15])
    found = classify_points(lateral, height, np.array([8.0, 8, 8, 8, 40]), (2.0, -2.0))
    road, ground, other = SemanticClass.ROAD, SemanticClass.TERRAIN, SemanticClass.OTHER
    assert found.tolist() == [road, other, ground, other, road]


def test_normals_of_a_plane_are_those_of_the_plane() -> None:
    toward = np.array([0.2, -0.9, -0.3]) / np.linalg.norm([0.2, -0.9, -0.3])
    depth = plane_depth(tuple(-toward), 1.6)
    normals = estimate_normals(depth, K, SCALE)
    near = np.isfinite(depth) & (depth < 6)
    near[:6], near[-6:], near[:, :6], near[:, -6:] = False, False, False, False
    assert (normals[near] @ toward).min() > 0.995


def test_a_surface_seen_too_flat_is_turned_just_enough() -> None:
    rays = np.array([[0, 0, 1.0], [0, 0, 1]])
    normals = np.array([[0.995, 0, -0.0998749], [0, 0.6, -0.8]])
    turned = turn_to_camera(normals, rays, 0.25)
    assert -turned[0, 2] == pytest.approx(0.25)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1)
    np.testing.assert_array_equal(turned[1], normals[1])


def test_the_picture_of_a_disc_is_round_whatever_its_slant() -> None:
    draw = np.random.Generator(np.random.Philox(7))
    rays = np.c_[draw.uniform(-0.4, 0.4, (50, 2)), np.ones(50)]
    normals = turn_to_camera(
        *[v / np.linalg.norm(v, axis=1, keepdims=True) for v in (draw.normal(size=(50, 3)), rays)], 0.2
    )
    depth, spacing = draw.uniform(3, 30, 50), draw.choice([2.0, 4.0], 50)
    rotation, scales = derive_discs(rays, depth, normals, spacing, F)
    np.testing.assert_allclose(np.linalg.det(rotation), 1)
    assert (scales[:, 0] >= scales[:, 1] - 1e-12).all()
    for k in range(50):
        spread = rotation[k, :, :2] * scales[k, :2]
        J = F / depth[k] * np.array([[1, 0, -rays[k, 0]], [0, 1, -rays[k, 1]]])
        np.testing.assert_allclose(
            J @ spread @ spread.T @ J.T, (COVERAGE * spacing[k]) ** 2 * np.eye(2), atol=1e-6
        )


def test_even_blocks_become_one_sample_and_others_keep_the_grid() -> None:
    picture = np.full((*SHAPE, 3), 100, np.uint8)
    picture[:, :80] = draw_smooth_noise((SHAPE[0], 80), 8).clip(0, 255).astype(np.uint8)[..., None]
    depth = np.full(SHAPE, 10.0, np.float32)
    wanted = np.ones(SHAPE, bool)
    wanted[:20] = False
    light = picture.astype(np.float32) / 255
    normals = np.zeros((*SHAPE, 3), np.float32)
    surfels = sample_picture(wanted, depth, normals, picture, light, K, SCALE, 2)
    column, row = surfels.rays[:, 0] * F + CX, surfels.rays[:, 1] * F + CY
    inner = row < 107  # rows 108 and 109 do not fill a block of four
    assert (surfels.spacing[(column > 84) & inner] == 4).all()
    assert (surfels.spacing[column < 76] == 2).mean() > 0.9
    area = (surfels.spacing**2).sum()
    assert area == pytest.approx(wanted.sum(), rel=0.03)
    assert row.min() > 19


def test_pieces_of_a_long_disc_cover_what_it_covered() -> None:
    length, splittable = np.array([0.6, 0.6, 0.1]), np.array([True, False, True])
    of, offset = _split_long_discs(length, splittable)
    assert np.bincount(of).tolist() == [4, 1, 1]
    pieces = offset[of == 0]
    assert pieces.mean() == pytest.approx(0)
    np.testing.assert_allclose(np.diff(pieces), 0.6 / COVERAGE / 4)
    assert LONGEST >= 0.6 / 4
    assert offset[of != 0].tolist() == [0, 0]


def test_far_road_is_put_on_the_route_and_near_road_stays_as_measured() -> None:
    depth, camera_height = np.array([4.0, 60.0]), 1.5
    measured = np.array([0.01, 0.3])
    descent = (camera_height - measured) / depth
    factor = _depth_factor_onto_route(measured, descent, depth, 380.0)
    height = camera_height - descent * depth * factor
    assert height[0] == pytest.approx(measured[0], abs=0.002)
    assert abs(height[1]) < 0.15 * measured[1]


def facing_wall() -> tuple[np.ndarray, np.ndarray]:
    """Depth pictures and poses of three cameras that approach a wall, from 12 m by 1 m each."""
    depth = np.stack([np.full(SHAPE, 12.0 - n, np.float32) for n in range(3)])
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 2, 3] = np.arange(3)
    return depth, poses


def test_depth_is_averaged_over_pictures_that_agree() -> None:
    depth, poses = facing_wall()
    depth[0] += 0.4
    fused, confirmed = fuse_depth(depth, np.zeros(depth.shape, bool), K, SCALE, poses)
    inner = np.s_[30:80, 40:120]
    assert confirmed[0][inner].all()
    assert fused[0][inner].max() < 12.3
    assert fused[2][inner].min() >= 10.0


def test_what_others_look_through_is_not_confirmed() -> None:
    depth, poses = facing_wall()
    depth[1, 50:56, 80:86] = 5.0  # a speck in the air
    _, confirmed = fuse_depth(depth, np.zeros(depth.shape, bool), K, SCALE, poses)
    assert not confirmed[1, 50:56, 80:86].any()
    assert confirmed[1, 30:45, 60:100].all()


def test_a_guess_is_kept_only_where_nobody_measured() -> None:
    depth, poses = facing_wall()
    guessed = np.zeros(depth.shape, bool)
    guessed[1, 40:60, 60:100] = True
    _, confirmed = fuse_depth(depth, guessed, K, SCALE, poses)
    assert not confirmed[1, 45:55, 70:90].any()
    guessed[:, 40:60, 60:100] = True
    _, confirmed = fuse_depth(depth, guessed, K, SCALE, poses)
    assert confirmed[1, 45:55, 70:90].all()


def test_a_surface_is_taken_from_the_picture_that_shows_it_largest() -> None:
    depth, poses = facing_wall()
    _, confirmed = fuse_depth(depth, np.zeros(depth.shape, bool), K, SCALE, poses)
    shares = [find_finest_view(n, depth, confirmed, K, SCALE, poses)[20:90, 30:130].mean() for n in range(3)]
    assert shares[2] == 1
    assert shares[0] == 0
    # the nearest picture does not show the rim of the one before it
    assert find_finest_view(1, depth, confirmed, K, SCALE, poses)[2, 40:120].all()


def test_gains_and_lens_shading_are_found_together() -> None:
    scene = draw_smooth_noise((600, 600), 9) / 255 * 0.4 + 0.2
    rays = pixel_rays(SHAPE, K)[..., :2]
    falloff = np.exp(-0.4 * (rays**2).sum(axis=-1))
    gains, depths = np.array([1.0, 1.2, 0.8, 1.1]), np.array([14.0, 12.5, 11.0, 9.5])
    pictures = []
    for gain, depth in zip(gains, depths, strict=True):
        place = np.rint(300 + rays * depth * 30).astype(int)
        light = scene[place[..., 1], place[..., 0]] * gain * falloff
        pictures.append(np.rint(255 * to_display(light)).astype(np.uint8))
    disparity = np.stack([np.full(SHAPE, SCALE / depth, np.float32) for depth in depths])
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, 2, 3] = depths[0] - depths
    exposure = estimate_exposure(np.array(pictures), disparity, K, SCALE, poses, np.arange(4))
    np.testing.assert_allclose(exposure.gains / exposure.gains[0], gains, rtol=0.05)
    assert exposure.falloff[5, 5] == pytest.approx(falloff[5, 5], abs=0.03)
    light = exposure.to_radiance(np.repeat(pictures[1][..., None], 3, axis=2), 1)
    np.testing.assert_allclose(exposure.to_picture(light, 1)[..., 0], pictures[1] / 255, atol=2e-3)
