"""Parked cars and fronts near a clip: fine where its camera comes near, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes.street import load_street_layout
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians, check_gaussians
from tasks.scene.scene import Scene
from tasks.scene.street.build import build_street
from tasks.scene.street.cars.near import LEVELS, detail_cars
from tasks.scene.street.houses.facades import build_facades
from tasks.scene.street.houses.near import detail_fronts
from tasks.scene.street.near import measure_approach
from tasks.scene.street.plan import plan_street
from tests.scene.test_street import viewmat_at

SHORT = replace(load_street_layout(), route_length=12.0, behind=5.0, beyond=20.0, crossing_station=4.0)


@pytest.fixture(scope="module")
def street() -> Scene:
    return build_street(SHORT, 7)


def detail_near_cars(street, stations, focal):
    return detail_cars(
        street.gaussians, SHORT, 7, np.stack([np.linalg.inv(viewmat_at(street, s)) for s in stations]), focal
    )


def test_near_cars_are_fine_in_their_place_and_all_else_is_bitwise_unchanged(street):
    coarse, fine = street.gaussians, detail_near_cars(street, (0.0, 6.0, 12.0), 1200.0)
    check_gaussians(fine)
    other = [np.flatnonzero(cloud.class_id != SemanticClass.VEHICLE) for cloud in (coarse, fine)]
    for name in ("means", "sh", "class_id", "light"):
        np.testing.assert_array_equal(getattr(coarse, name)[other[0]], getattr(fine, name)[other[1]])
    cars = [cloud.means[cloud.class_id == SemanticClass.VEHICLE] for cloud in (coarse, fine)]
    assert len(cars[1]) > 3 * len(cars[0])
    for cloud in cars:
        assert cloud[:, 2].min() > -0.03
    np.testing.assert_allclose(cars[0].min(axis=0), cars[1].min(axis=0), atol=0.2)


def test_fine_cars_have_the_light_of_the_coarse_ones(street):
    fine = detail_near_cars(street, (0.0, 6.0, 12.0), 1200.0)
    means = []
    for cloud in (street.gaussians, fine):
        car = cloud.class_id == SemanticClass.VEHICLE
        area = np.sort(cloud.scales[car], axis=1)[:, 1:].prod(axis=1)
        means.append(np.average(cloud.sh[car, 0] * 0.28209479 + 0.5, axis=0, weights=area))
    np.testing.assert_allclose(means[1], means[0], rtol=0.2)


def test_a_longer_lens_takes_finer_cars_and_the_same_arguments_the_same_bytes(street):
    counts = [len(detail_near_cars(street, (0.0, 6.0), focal)) for focal in (200.0, 400.0, 960.0)]
    assert counts[0] < counts[1] < counts[2]
    first, again = (detail_near_cars(street, (0.0,), 400.0) for _ in range(2))
    assert first.means.tobytes() == again.means.tobytes() and first.sh.tobytes() == again.sh.tobytes()


def test_a_car_behind_the_camera_is_never_near():
    pose = np.eye(4)[None]
    assert measure_approach(np.array([0.0, 0.0, -5.0]), pose) == np.inf
    assert measure_approach(np.array([0.0, 0.0, 5.0]), pose) == pytest.approx(5.0)
    assert list(LEVELS) == sorted(LEVELS)


def test_cars_of_another_street_are_refused(street):
    with pytest.raises(InputError, match="built-in street"):
        detail_cars(street.gaussians, SHORT, 8, np.eye(4)[None], 400.0)


def detail_near_fronts(street: Scene, focal: float, seed: int = 7) -> Gaussians:
    poses = np.stack([np.linalg.inv(viewmat_at(street, s)) for s in (0.0, 6.0, 12.0)])
    return detail_fronts(street.gaussians, SHORT, seed, poses, focal)


def test_near_fronts_are_fine_and_all_else_is_bitwise_unchanged(street):
    coarse, fine = street.gaussians, detail_near_fronts(street, 960.0)
    check_gaussians(fine)
    other = [np.flatnonzero(cloud.class_id != SemanticClass.BUILDING) for cloud in (coarse, fine)]
    for name in ("means", "sh", "light", "surroundings"):
        np.testing.assert_array_equal(getattr(coarse, name)[other[0]], getattr(fine, name)[other[1]])
    walls = [(cloud.class_id == SemanticClass.BUILDING).sum() for cloud in (coarse, fine)]
    assert 1.5 * walls[0] < walls[1] < 6 * walls[0]


def test_a_fine_front_has_the_colours_and_the_area_of_the_coarse_one(street):
    houses = plan_street(SHORT, 7).buildings
    areas, means = [], []
    for edge in (None, 0.04):
        front = build_facades(SHORT, houses, 7, {0: edge})
        flat = np.abs(front.axes[:, 2, 1]) > 0.9
        area = front.scale[flat].prod(axis=1)
        areas.append(area.sum())
        means.append(np.average(front.albedo[flat], axis=0, weights=area))
    assert areas[1] == pytest.approx(areas[0], rel=0.01)
    np.testing.assert_allclose(means[1], means[0], rtol=0.10)


def test_reveals_close_the_far_jamb_and_the_head_of_each_opening_alone(street):
    houses = plan_street(SHORT, 7).buildings
    coarse, fine = (build_facades(SHORT, houses, 7, {0: edge}).axes[:, 2] for edge in (None, 0.04))
    assert (np.abs(coarse[:, 1]) > 0.9).all()
    facing = fine[np.abs(fine[:, 1]) < 0.9]
    assert len(facing) > 100
    np.testing.assert_allclose(facing[:, 0] + facing[:, 2], -1, atol=1e-9)


def test_a_longer_lens_takes_finer_fronts_and_a_short_one_none(street):
    counts = [len(detail_near_fronts(street, focal)) for focal in (100.0, 960.0, 2000.0)]
    assert counts[0] == len(street.gaussians)
    assert counts[0] < counts[1] < counts[2]
    assert detail_near_fronts(street, 960.0).sh.tobytes() == detail_near_fronts(street, 960.0).sh.tobytes()


def test_fronts_of_another_street_are_refused(street):
    with pytest.raises(InputError, match="built-in street"):
        detail_near_fronts(street, 960.0, seed=8)
