from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.road_edit import RoadRelief, apply_road_profile
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route, route_from_positions
from tasks.surface.road_profile import RoadHazard, road_elevation, road_slope
from tests.toy_street import toy_street

SCENE = toy_street()


def relief_of(hazard: RoadHazard, route: Route = SCENE.route) -> RoadRelief:
    return RoadRelief(
        route=route,
        elevation=lambda s: road_elevation(s, hazard),
        slope=lambda s: road_slope(s, hazard),
        near=hazard.center_m - hazard.length_m / 2,
        far=hazard.center_m + hazard.length_m / 2,
    )


def edit_road(height: float) -> tuple[Gaussians, np.ndarray, RoadHazard]:
    hazard = RoadHazard(center_m=10.0, length_m=3.7, height_m=height)
    cloud, moved = apply_road_profile(SCENE.gaussians, relief_of(hazard), 4.0, -4.0)
    return cloud, moved, hazard


@pytest.mark.parametrize("height", [0.075, -0.08])
def test_road_gaussians_lie_on_the_profile(height):
    cloud, moved, hazard = edit_road(height)
    x = SCENE.gaussians.means[moved, 0].astype(float)
    np.testing.assert_allclose(cloud.means[moved, 2], road_elevation(x, hazard), atol=1e-6)
    assert moved.sum() > 100


@pytest.mark.parametrize("height", [0.075, -0.08])
def test_normals_and_discs_tilt_by_the_slope_of_the_profile(height):
    cloud, moved, hazard = edit_road(height)
    slope = road_slope(SCENE.gaussians.means[moved, 0].astype(float), hazard)
    expected = np.stack([-slope, 0 * slope, np.ones_like(slope)], axis=1) / np.sqrt(1 + slope**2)[:, None]
    np.testing.assert_allclose(cloud.normals[moved], expected, atol=1e-6)
    w, x, y, z = cloud.quats_wxyz[moved].T
    thin_axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    np.testing.assert_allclose(thin_axis, expected, atol=1e-6)


def test_what_is_not_road_or_not_on_the_feature_is_bitwise_unchanged():
    cloud, moved, _ = edit_road(0.075)
    for name in ("means", "quats_wxyz", "normals", "scales", "sh"):
        np.testing.assert_array_equal(getattr(cloud, name)[~moved], getattr(SCENE.gaussians, name)[~moved])
    assert (SCENE.gaussians.class_id[moved] == SemanticClass.ROAD).all()
    assert np.abs(SCENE.gaussians.means[moved, 0] - 10).max() <= 3.7 / 2


def test_a_height_of_zero_is_the_identity():
    cloud, moved, _ = edit_road(0.0)
    assert cloud is SCENE.gaussians
    assert not moved.any()


def test_what_stands_on_the_carriageway_rides_and_what_stands_beside_it_does_not():
    cloud = SCENE.gaussians
    above = np.abs(cloud.means[:, 0] - 10) < 1.0
    label = np.where(cloud.class_id == SemanticClass.ROAD, SemanticClass.VEHICLE, SemanticClass.BUILDING)
    cars = Gaussians(**{**vars(cloud), "class_id": label.astype(np.uint8)})
    hazard = RoadHazard(center_m=10.0, length_m=3.7, height_m=0.1)
    _, moved = apply_road_profile(cars, relief_of(hazard), 2.0, -2.0)
    inside = np.abs(cloud.means[:, 1]) <= 2
    assert moved[above & inside & (label == SemanticClass.VEHICLE)].all()
    assert not moved[~inside].any()
    assert not moved[label == SemanticClass.BUILDING].any()


def test_what_hangs_above_the_tallest_vehicle_stays():
    cloud = SCENE.gaussians
    means = cloud.means + np.float32([0, 0, 5.0])
    wires = replace(cloud, means=means, class_id=np.full(len(cloud), SemanticClass.OTHER, np.uint8))
    hazard = RoadHazard(center_m=10.0, length_m=3.7, height_m=0.1)
    _, moved = apply_road_profile(wires, relief_of(hazard), 4.0, -4.0)
    assert not moved.any()


def test_on_a_climbing_bend_the_road_moves_along_the_route_s_own_normal():
    angle = np.linspace(0, 0.8, 60)
    route = route_from_positions(np.stack([60 * np.sin(angle), 60 * (1 - np.cos(angle)), 4 * angle], axis=1))
    draw = np.random.default_rng(5)
    station, lateral = draw.uniform(15, 25, 400), draw.uniform(-4, 4, 400)
    frame = route.pose(station)
    on_road = frame[:, :3, 3] + lateral[:, None] * frame[:, :3, 1]
    cloud = Gaussians(
        **{name: value[:400] for name, value in vars(SCENE.gaussians).items() if np.ndim(value)}
    )
    cloud = replace(
        cloud,
        means=on_road.astype(np.float32),
        normals=frame[:, :3, 2].astype(np.float32),
        class_id=np.full(400, SemanticClass.ROAD, np.uint8),
    )
    hazard = RoadHazard(center_m=20.0, length_m=4.0, height_m=0.1)
    lifted, moved = apply_road_profile(cloud, relief_of(hazard, route), 4.0, -4.0)
    up, forward = frame[:, :3, 2], frame[:, :3, 0]
    height = road_elevation(station, hazard)[:, None]
    np.testing.assert_allclose(lifted.means, on_road + height * up, atol=1e-4)
    slope = road_slope(station, hazard)[:, None]
    expected = (up - slope * forward) / np.sqrt(1 + slope**2)
    np.testing.assert_allclose(lifted.normals[moved], expected[moved], atol=5e-4)
