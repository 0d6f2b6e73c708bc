"""Grade and curvature of a route: those of its poses, over a length that no dent and no noise of a survey reaches."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes.street import load_street_layout
from tasks.scene.route import Route, route_from_positions
from tasks.scene.route_shape import find_lateral_demand, sample_curvature, sample_grade
from tasks.scene.street.bend import integrate_course, lay_route
from tests.toy_street import toy_street


def helix(radius: float, grade: float, length: float = 200.0, noise: float = 0.0) -> Route:
    """A route that climbs and turns left all the way, a pose a metre."""
    s = np.arange(0.0, length + 1)
    flat = s * np.sqrt(1 - grade**2) / radius
    points = np.stack([radius * np.sin(flat), radius * (1 - np.cos(flat)), grade * s], axis=1)
    return route_from_positions(points + noise * np.random.default_rng(1).normal(size=points.shape))


def test_a_level_route_has_no_grade_to_the_last_bit():
    assert sample_grade(toy_street().route).is_level
    assert sample_grade(helix(100.0, 0.0)).rise == (0.0,) * 100


def test_the_grade_is_the_rise_per_metre_of_way():
    grade = sample_grade(helix(100.0, 0.08))
    np.testing.assert_allclose(grade.rise, 0.08, atol=2e-4)
    assert grade.at(1e4) == grade.rise[-1]


def test_a_survey_s_noise_of_a_centimetre_is_no_hill():
    assert np.abs(np.array(sample_grade(helix(100.0, 0.0, noise=0.01)).rise)).max() < 0.005


def test_the_curvature_is_that_of_the_circle_whatever_the_grade():
    station, curvature = sample_curvature(helix(50.0, 0.1))
    inside = (station > 10) & (station < 180)
    np.testing.assert_allclose(curvature[inside], np.sqrt(1 - 0.1**2) / 50, rtol=2e-3)


def test_a_bend_asks_for_speed_squared_over_its_radius_and_for_nothing_beyond_the_route():
    asked = find_lateral_demand(helix(50.0, 0.0), np.array([50.0, 100.0, 1e4]), np.array([10.0, 20.0, 20.0]))
    np.testing.assert_allclose(asked, [2.0, 8.0, 0.0], rtol=2e-3)


def test_the_street_s_grade_is_a_field_of_its_layout():
    street = load_street_layout()
    course = replace(
        street.course, length=(10, 30, 140, 130), curvature=(0, 0, 1 / 450, 1 / 110), grade=(0, 0.08, 0.08, 0.08),
        transition=(0, 30, 60, 60),
    )  # fmt: skip
    layout = replace(street, course=course)
    route = lay_route(layout, integrate_course(layout))
    grade = sample_grade(route)
    assert np.allclose(grade.rise[:2], 0) and grade.rise[-1] == pytest.approx(0.08, abs=1e-9)
    station = np.linspace(0.0, route.length, 10_001)
    climbed = np.trapezoid(grade.at(station), station)
    assert climbed == pytest.approx(route.pose(route.length)[2, 3], abs=0.01) == pytest.approx(12.4, abs=0.01)
    # the rig stands square on the road: x along it, and a way of a metre is a metre
    ahead = np.diff(route.T_world_rig[:, :3, 3], axis=0)
    np.testing.assert_allclose(np.linalg.norm(ahead, axis=1), 0.5, atol=1e-4)
    along = np.einsum("ni,ni->n", ahead, route.T_world_rig[:-1, :3, 0])
    np.testing.assert_allclose(along, 0.5, atol=1e-3)
