"""Parked cars near a clip: fine where its camera comes near, in the same place and light, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes.street import load_street_layout
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.gaussians import check_gaussians
from tasks.scene.street.build import build_street
from tasks.scene.street.cars.near import LEVELS, detail_cars
from tasks.scene.street.near import measure_approach
from tests.scene.test_street import viewmat_at

SHORT = replace(load_street_layout(), route_length=12.0, behind=5.0, beyond=20.0, crossing_station=4.0)


@pytest.fixture(scope="module")
def street():
    return build_street(SHORT, 7)


def detail(street, stations, focal):
    return detail_cars(
        street.gaussians, SHORT, 7, np.stack([np.linalg.inv(viewmat_at(street, s)) for s in stations]), focal
    )


def test_near_cars_are_fine_in_their_place_and_all_else_is_bitwise_unchanged(street):
    coarse, fine = street.gaussians, detail(street, (0.0, 6.0, 12.0), 1200.0)
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
    fine = detail(street, (0.0, 6.0, 12.0), 1200.0)
    means = []
    for cloud in (street.gaussians, fine):
        car = cloud.class_id == SemanticClass.VEHICLE
        area = np.sort(cloud.scales[car], axis=1)[:, 1:].prod(axis=1)
        means.append(np.average(cloud.sh[car, 0] * 0.28209479 + 0.5, axis=0, weights=area))
    np.testing.assert_allclose(means[1], means[0], rtol=0.2)


def test_a_longer_lens_takes_finer_cars_and_the_same_arguments_the_same_bytes(street):
    counts = [len(detail(street, (0.0, 6.0), focal)) for focal in (200.0, 400.0, 960.0)]
    assert counts[0] < counts[1] < counts[2]
    first, again = (detail(street, (0.0,), 400.0) for _ in range(2))
    assert first.means.tobytes() == again.means.tobytes() and first.sh.tobytes() == again.sh.tobytes()


def test_a_car_behind_the_camera_is_never_near():
    pose = np.eye(4)[None]
    assert measure_approach(np.array([0.0, 0.0, -5.0]), pose) == np.inf
    assert measure_approach(np.array([0.0, 0.0, 5.0]), pose) == pytest.approx(5.0)
    assert list(LEVELS) == sorted(LEVELS)


def test_another_street_is_refused(street):
    with pytest.raises(InputError, match="built-in street"):
        detail_cars(street.gaussians, SHORT, 8, np.eye(4)[None], 400.0)
