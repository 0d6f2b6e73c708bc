"""The course of a street: stretches, what a seed draws of them, and sun and leaves by place, day and hour."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes import find_recipe
from catalogs.scenes.street import STREET_FILE, load_street_layout
from catalogs.street_names import KINDS
from tasks.errors import InputError
from tasks.scene.route_shape import sample_curvature, sample_grade
from tasks.scene.street.bend import integrate_course, lay_route
from tasks.scene.street.course import Stretches
from tasks.scene.street.road import build_road
from tasks.scene.street.season import find_foliage, find_sun, light_of

RIGHT_UPHILL = Stretches(
    length=(20.0, 160.0), curvature=(0.0, -1 / 80), grade=(0.0, 0.08), transition=(0.0, 30.0), bloss_share=0.0
)


def layout_of(name: str):
    changes, seed = find_recipe(name)
    return load_street_layout(STREET_FILE, *changes, seed=seed)


def test_a_right_bend_turns_right_and_climbs_as_its_stretches_say():
    layout = replace(load_street_layout(), course=RIGHT_UPHILL)
    route = lay_route(layout, integrate_course(layout))
    station, curvature = sample_curvature(route)
    rise = np.array(sample_grade(route).rise)
    inside = (station > 60) & (station < 170)
    assert curvature[inside] == pytest.approx(-1 / (80 * np.sqrt(1 - 0.08**2)), rel=0.01)
    assert rise[inside] == pytest.approx(0.08, abs=1e-4)
    assert route.T_world_rig[-1, 1, 3] < -20
    left = route.T_world_rig[:, :3, 1]
    assert left[:, 2] == pytest.approx(0, abs=1e-9)


def test_on_a_clothoid_the_curvature_changes_evenly_and_its_integral_is_the_turn():
    station = np.linspace(20, 50, 61)
    found = RIGHT_UPHILL.curvature_at(station)
    assert np.diff(found) == pytest.approx(-1 / 80 / 60, rel=1e-9)
    assert RIGHT_UPHILL.curvature_at(np.array([0.0, 19.0]))[1] == 0
    assert RIGHT_UPHILL.knots.tolist() == [0, 20, 50]


@pytest.mark.parametrize("change", [{"length": (20.0,)}, {"grade": (0.0, 1.0)}])
def test_stretches_that_do_not_fit_are_refused(change):
    with pytest.raises(InputError, match="course"):
        replace(RIGHT_UPHILL, **change)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_bends_both_ways_within_its_ranges(kind):
    layouts = [layout_of(f"{kind}-{seed}") for seed in range(30)]
    for layout in layouts:
        course, on_route = layout.course, layout.course.starts < layout.route_length
        assert course.curvature_at(np.linspace(-layout.behind, 12, 20)) == pytest.approx(0)
        assert max(map(abs, course.grade)) <= 0.08
        assert np.abs(np.array(course.curvature)[on_route]).max() <= 1 / 145
    bends = np.concatenate([np.array(layout.course.curvature) for layout in layouts])
    assert (bends > 0).sum() > 10 and (bends < 0).sum() > 10


@pytest.mark.parametrize("width", [2.5, 2.75, 2.8, 3.0, 3.5, 4.2])
def test_a_lane_of_any_width_can_be_paved(width):
    short = Stretches(length=(9.0,), curvature=(0.0,), grade=(0.0,), transition=(0.0,), bloss_share=0.0)
    layout = replace(
        load_street_layout(), lane_width=width, route_length=9.0, behind=5.0, beyond=5.0, crossing_length=0.0,
        course=short,
    )  # fmt: skip
    assert build_road(layout, 1).scale.min() > 0


def test_the_sun_stands_where_the_almanac_has_it():
    """Berlin, 21 June, noon: 60.9 deg in the south; Quito at the equinox: overhead; sunrise in the east."""
    azimuth, elevation = find_sun(52.5, 172, 0.5)
    assert (azimuth, elevation) == pytest.approx((180, 90 - 52.5 + 23.44), abs=0.1)
    assert find_sun(0.0, 80.5, 0.5)[1] > 89
    azimuth, elevation = find_sun(40.0, 80.5, 0.0)
    assert (azimuth, elevation) == pytest.approx((90, 0), abs=1.0)
    assert find_sun(40.0, 80.5, 1.0)[0] == pytest.approx(270, abs=1.0)


def test_leaves_come_turn_and_fall():
    assert find_foliage(15)["leaf_share"] == 0
    assert find_foliage(180) == {
        "leaf_share": 1.0,
        "autumn_share": 0.0,
        "dead_grass_share": pytest.approx(0.2, abs=0.1),
    }
    assert find_foliage(295)["autumn_share"] > 0.8 and find_foliage(295)["leaf_share"] > 0.7
    assert find_foliage(340)["leaf_share"] == 0


def test_a_low_sun_is_redder_and_the_light_of_the_street_s_own_sun_stays():
    colours = (1.95, 1.80, 1.56), (0.38, 0.46, 0.57), (0.21, 0.19, 0.17)
    assert np.array(light_of(46.0, *colours)) == pytest.approx(np.array(colours))
    low = light_of(8.0, *colours)[0]
    assert low[0] / low[2] > 2 * 1.95 / 1.56
