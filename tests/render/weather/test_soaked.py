"""Wet walls: darker by Lekner & Dorf, more saturated, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.weather.scene_light import mean_colours
from tasks.render.weather.wet.soaked import soak_gaussians
from tests.render.weather.scenes import surfels

POINTS = np.random.Generator(np.random.Philox(3)).uniform(0, 300, (400, 3))
COLOUR = (0.4, 0.2, 0.1)


def soak(parameters, kind, normal=(0, 1, 0), mirrors=0.0, **changes):
    rain = parameters.kinds["rain"]
    scene = surfels(POINTS, normal, 0.05, COLOUR, kind)
    walls = replace(rain.walls, **changes)
    soaked = soak_gaussians(scene, mirrors, np.ones(3), rain.film, walls, 1)
    return mean_colours(soaked) / mean_colours(scene)


def test_a_soaked_wall_darkens_by_lekner_and_dorf_and_grows_more_saturated(parameters):
    ratio = soak(parameters, SemanticClass.BUILDING, share=1.0, spread=0.0)
    # p = 1 - .934 / 1.333^2 = .47437; .934 (1 - p) / (1 - p A)
    np.testing.assert_allclose(ratio, np.tile((0.60588, 0.54241, 0.51539), (400, 1)), atol=2e-4)


def test_a_roof_takes_all_and_a_wall_its_share(parameters):
    roof, wall = (
        soak(parameters, SemanticClass.BUILDING, normal, spread=0.0)[0, 0]
        for normal in ((0, 0, 1), (1, 0, 0))
    )
    share = parameters.kinds["rain"].walls.share
    assert 1 - wall == pytest.approx(share * (1 - roof), rel=1e-4)


def test_streaks_keep_the_mean_and_run_down(parameters):
    even, streaked = (soak(parameters, SemanticClass.BUILDING, spread=spread)[:, 0] for spread in (0.0, 0.2))
    assert streaked.std() > 0.02
    assert streaked.mean() == pytest.approx(even.mean(), abs=0.03)


@pytest.mark.parametrize("kind", [SemanticClass.VEHICLE, SemanticClass.ROAD, SemanticClass.POLE])
def test_what_takes_up_no_water_keeps_its_colour(parameters, kind):
    assert (soak(parameters, kind) == 1).all()


def test_panes_keep_what_they_mirror(parameters):
    np.testing.assert_allclose(soak(parameters, SemanticClass.BUILDING, mirrors=1.0), 1, atol=1e-6)
