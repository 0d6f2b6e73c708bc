"""Crowns and rings of drops on the wet road: as many as the rain brings, where road is, and the same in any order."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.weather.falling.precipitation import make_population
from tasks.render.weather.wet.impacts import CHORDS, visible_impacts
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import flat_gbuffer

VIEW = {"width": 640, "height": 400, "focal": 500.0}


def strike(parameters, time_s=2.0, rate=20.0, film=1.0, **changes):
    rain = parameters.kinds["rain"]
    view = shutter(time_s=time_s, **VIEW)
    _, gbuffer = flat_gbuffer(view)
    road = gbuffer.class_id == SemanticClass.ROAD
    smooth = np.full(road.shape, film, np.float32)
    look = replace(rain.film.impacts, **changes)
    population = make_population(rain.particles, rate)
    return visible_impacts(population, look, view, gbuffer.depth, road, smooth, 1)


def test_as_many_crowns_stand_as_the_rain_brings(parameters):
    rain = parameters.kinds["rain"]
    population = make_population(rain.particles, 20.0)
    large = population.edges_mm[:-1] >= 1.2 - 1e-9
    flux = float((population.density * population.speed)[large].sum())
    times = np.arange(40) * 0.31
    crowns = [strike(parameters, t, ring_mm=9.0) for t in times]
    # the trapezium of road between 4 and 4.5 m before the camera, all of which is in view
    near = [((c["z"] + 0.04 > 4.0) & (c["z"] + 0.04 < 4.5)).sum() for c in crowns]
    area = 0.5 * 4.25 * VIEW["width"] / VIEW["focal"]
    expected = flux * area * rain.film.impacts.crown_s * len(times)
    assert sum(near) == pytest.approx(expected, abs=5 * expected**0.5)


def test_a_ring_grows_at_its_speed_from_one_frame_to_the_next(parameters):
    both = [strike(parameters, t, crown_s=0.0) for t in (2.0, 2.02)]
    rings = []
    for streaks in both:
        pieces = streaks["begin"].reshape(-1, CHORDS, 2)
        rings.append((pieces.mean(axis=1), np.ptp(pieces[..., 0], axis=1), streaks["z"][::CHORDS]))
    away = np.linalg.norm(rings[0][0][:, None] - rings[1][0][None], axis=2)
    pair = away.argmin(axis=1)
    together = away[np.arange(len(pair)), pair] < 0.3
    assert together.sum() > 30
    wider = rings[1][1][pair][together] - rings[0][1][together]
    z = rings[0][2][together] + 0.04
    shown = 2 * parameters.kinds["rain"].film.impacts.ring_speed_m_s * 0.02 * VIEW["focal"] / z
    # the ends of the chords nearest to left and right are not its widest points
    np.testing.assert_allclose(np.median(wider / shown), 1, atol=0.08)


def test_rings_need_a_film_and_crowns_do_not(parameters):
    wet, dry = (strike(parameters, film=film) for film in (1.0, 0.0))
    assert len(wet) == len(dry)
    ring = np.isclose(wet["diameter"], parameters.kinds["rain"].film.impacts.ring_width_m)
    assert wet["share"][ring].min() > 0
    assert not dry["share"][ring].any() and dry["share"][~ring].min() > 0


def test_nothing_strikes_where_no_road_is_seen(parameters):
    rain = parameters.kinds["rain"]
    view = shutter(**VIEW)
    _, gbuffer = flat_gbuffer(view)
    no_road = np.zeros(gbuffer.depth.shape, bool)
    population = make_population(rain.particles, 50.0)
    struck = visible_impacts(
        population, rain.film.impacts, view, gbuffer.depth, no_road, no_road * np.float32(1), 1
    )
    assert not len(struck)
    for place in ("begin", "end"):
        assert np.isfinite(strike(parameters)[place]).all()


def test_a_crown_hides_its_share_of_its_own_area(parameters):
    crowns = strike(parameters, ring_mm=9.0)
    look = parameters.kinds["rain"].film.impacts
    tall = np.abs(crowns["begin"][:, 1] - crowns["end"][:, 1]) / VIEW["focal"] * (crowns["z"] + 0.04)
    reach = 1e-3 * look.smallest_mm * look.crown_height * VIEW["focal"] / look.smallest_px
    high = tall > pi / 4 * crowns["diameter"]
    near = np.minimum(1, 2 * (1 - (crowns["z"] + 0.04) / reach))
    hidden = crowns["share"] * pi / 4 * crowns["diameter"] ** 2
    np.testing.assert_allclose(
        hidden[high], (near * look.crown_cover * crowns["diameter"] * tall)[high], rtol=0.02
    )
