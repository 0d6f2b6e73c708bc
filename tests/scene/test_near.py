"""Parked cars and fronts near a clip: fine where its camera comes near, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes.street import load_street_layout
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.gaussians import check_gaussians
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


def detail_near(detail, street, stations, focal):
    return detail(
        street.gaussians, SHORT, 7, np.stack([np.linalg.inv(viewmat_at(street, s)) for s in stations]), focal
    )


@pytest.mark.parametrize(
    ("detail", "kind", "least", "most"),
    [(detail_cars, SemanticClass.VEHICLE, 3.0, np.inf), (detail_fronts, SemanticClass.BUILDING, 1.5, 6.0)],
)
def test_what_is_near_is_fine_in_its_place_and_all_else_is_bitwise_unchanged(
    street, detail, kind, least, most
):
    coarse, fine = street.gaussians, detail_near(detail, street, (0.0, 6.0, 12.0), 1200.0)
    check_gaussians(fine)
    other = [np.flatnonzero(cloud.class_id != kind) for cloud in (coarse, fine)]
    for name in ("means", "sh", "class_id", "light", "surroundings"):
        np.testing.assert_array_equal(getattr(coarse, name)[other[0]], getattr(fine, name)[other[1]])
    own = [cloud.means[cloud.class_id == kind] for cloud in (coarse, fine)]
    assert least * len(own[0]) < len(own[1]) < most * len(own[0])
    assert min(cloud[:, 2].min() for cloud in own) > -0.03
    np.testing.assert_allclose(own[0].min(axis=0), own[1].min(axis=0), atol=0.2)


def test_fine_cars_have_the_light_of_the_coarse_ones_and_mirror_to_the_eye_of_their_clip(street):
    fine, other = (detail_near(detail_cars, street, (station,), 1e4) for station in (5.0, 6.0))
    means = []
    for cloud in (street.gaussians, fine, other):
        car = cloud.class_id == SemanticClass.VEHICLE
        area = np.sort(cloud.scales[car], axis=1)[:, 1:].prod(axis=1)
        matt = (cloud.sh[car, 0] * 0.28209479 + 0.5).sum(axis=1) * (1 - cloud.light[car, 3])
        means.append(np.average(matt, weights=area))
    assert means[1] == pytest.approx(means[0], rel=0.2) and means[2] == pytest.approx(means[1], rel=1e-5)
    assert (np.abs(fine.sh - other.sh).max(axis=(1, 2)) > 0.05).sum() > 300


@pytest.mark.parametrize(
    ("detail", "focals"),
    [(detail_cars, (200.0, 400.0, 960.0)), (detail_fronts, (100.0, 960.0, 2000.0))],
)
def test_a_longer_lens_takes_finer_discs_a_short_one_none_and_each_clip_the_same_bytes(
    street, detail, focals
):
    counts = [len(detail_near(detail, street, (0.0, 6.0), focal)) for focal in focals]
    assert counts[0] == len(street.gaussians)
    assert (np.diff(counts) > 0).all()
    first, again = (detail_near(detail, street, (0.0,), 960.0) for _ in range(2))
    assert first.means.tobytes() == again.means.tobytes() and first.sh.tobytes() == again.sh.tobytes()


def test_a_car_behind_the_camera_is_never_near():
    pose = np.eye(4)[None]
    assert measure_approach(np.array([0.0, 0.0, -5.0]), pose)[0] == np.inf
    assert measure_approach(np.array([0.0, 0.0, 5.0]), pose)[0] == pytest.approx(5.0)
    assert list(LEVELS) == sorted(LEVELS)


def test_a_fine_front_has_the_colours_and_the_area_of_the_coarse_one_and_a_back(street):
    house, *_ = houses = plan_street(SHORT, 7).buildings
    wall = SHORT.front_position(house.side) + house.side * house.setback
    areas, means = [], []
    for edge in (None, 0.04):
        front = build_facades(SHORT, houses, 7, {0: edge})
        back = np.abs(front.centre[:, 1] - wall) > 0.5
        flat = (np.abs(front.axes[:, 2, 1]) > 0.9) & ~back
        area = front.scale.prod(axis=1)
        areas += [area[flat].sum(), area[back].sum()]
        means.append(np.average(front.albedo[flat], axis=0, weights=area[flat]))
    assert areas[1] == 0 and areas[2:] == pytest.approx([areas[0]] * 2, rel=0.01)
    np.testing.assert_allclose(means[1], means[0], rtol=0.10)


def test_reveals_close_the_far_jamb_and_the_head_of_each_opening_alone(street):
    houses = plan_street(SHORT, 7).buildings
    coarse, fine = (build_facades(SHORT, houses, 7, {0: edge}).axes[:, 2] for edge in (None, 0.04))
    assert (np.abs(coarse[:, 1]) > 0.9).all()
    facing = fine[np.abs(fine[:, 1]) < 0.9]
    assert len(facing) > 100
    np.testing.assert_allclose(facing[:, 0] + facing[:, 2], -1, atol=1e-9)


def test_cars_and_fronts_of_another_street_are_refused(street):
    for detail in (detail_cars, detail_fronts):
        with pytest.raises(InputError, match="built-in street"):
            detail(street.gaussians, SHORT, 8, np.linalg.inv(viewmat_at(street, 0.0))[None], 960.0)
