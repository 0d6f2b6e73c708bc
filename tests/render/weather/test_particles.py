"""Drops and flakes in world units: counted, placed, moved and drawn."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.render.lens import Lens, distort_rays
from tasks.render.weather.falling.particles import visible_streaks
from tasks.render.weather.falling.precipitation import drawn_optical_depth, drawn_reach, make_population
from tasks.render.weather.falling.streaks import draw_streaks
from tests.render.weather.conftest import shutter

CALM = np.zeros(3)


@pytest.fixture
def rain(parameters):
    return make_population(parameters.kinds["rain"].particles, 50.0)


@pytest.fixture
def snow(parameters):
    return make_population(parameters.kinds["snow"].particles, 2.0)


@pytest.mark.parametrize(("rate", "frames"), [(50, 12), (1872, 2)])
def test_one_class_has_as_many_drops_in_view_as_density_times_volume(parameters, rate, frames):
    """At the highest rate there is, a cell holds up to 96 drops on average."""
    rain = make_population(parameters.kinds["rain"].particles, rate)
    near = replace(parameters.air.near, fade_share=0.2)
    counts = []
    for seed in range(frames):
        streaks = visible_streaks(rain, near, shutter(exposure_s=1e-6), CALM, seed)
        seen = ((streaks["begin"] > 0) & (streaks["begin"] < (480, 320))).all(axis=1)
        counts.append(np.histogram(streaks["diameter"][seen], bins=1e-3 * rain.edges_mm)[0])
    # the view's solid angle over the sphere of the reach, less the ball that is too near
    rays = np.stack(np.meshgrid(np.linspace(-0.6, 0.6, 401), np.linspace(-0.4, 0.4, 401)), axis=-1)
    solid_angle = np.mean((1 + (rays**2).sum(axis=-1)) ** -1.5) * 1.2 * 0.8
    reach = drawn_reach(rain, near, 400.0)
    expected = rain.density * solid_angle * (reach**3 - near.nearest_m**3) / 3
    found, expected = np.mean(counts, axis=0)[reach > 0], expected[reach > 0]
    assert len(found) > 10
    assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
    many = expected > 30
    assert found[many] == pytest.approx(expected[many], rel=0.12)


@pytest.mark.parametrize("kind", ["rain", "snow"])
def test_any_frame_alone_has_the_bits_it_has_in_sequence(parameters, request, kind):
    falling = request.getfixturevalue(kind)
    near, wind = parameters.air.near, np.array(parameters.air.wind_m_s)
    sequence = [
        visible_streaks(falling, near, shutter(time_s=0.1 * i, x=1.5 * i, speed=15), wind, 5)
        for i in range(6)
    ]
    alone = visible_streaks(falling, near, shutter(time_s=0.1 * 4, x=1.5 * 4, speed=15), wind, 5)
    assert alone.tobytes() == sequence[4].tobytes()
    assert sequence[4].tobytes() != sequence[3].tobytes()


def test_other_seeds_and_other_kinds_are_other_particles(parameters, rain):
    near = parameters.air.near
    first, second = (visible_streaks(rain, near, shutter(), CALM, seed) for seed in (1, 2))
    assert first.tobytes() != second.tobytes()


def test_heavier_rain_keeps_the_drops_of_lighter_rain(parameters):
    near = parameters.air.near
    # sizes follow the distribution of each rate; where a drop is does not
    light, heavy = (
        {
            tuple(streak["direction"])
            for streak in visible_streaks(
                make_population(parameters.kinds["rain"].particles, rate), near, shutter(), CALM, 3
            )
        }
        for rate in (10.0, 25.0)
    )
    assert len(light) > 50
    assert light < heavy


def test_exposure_doubled_makes_streaks_twice_as_long(parameters, rain):
    near = parameters.air.near
    streaks = [visible_streaks(rain, near, shutter(exposure_s=e), CALM, 1) for e in (0.004, 0.008)]
    short, long = (np.linalg.norm(s["end"] - s["begin"], axis=1) for s in streaks)
    centre = 0.5 * (streaks[0]["begin"] + streaks[0]["end"])
    inside = (np.abs(centre - (240, 160)) < (160, 100)).all(axis=1)
    assert inside.sum() > 50
    assert long[inside] == pytest.approx(2 * short[inside], rel=0.02)


def test_a_streak_is_as_long_as_the_fall_during_the_exposure(parameters, rain):
    streaks = visible_streaks(rain, parameters.air.near, shutter(exposure_s=0.01), CALM, 1)
    length = np.linalg.norm(streaks["end"] - streaks["begin"], axis=1)
    index = np.searchsorted(1e-3 * rain.edges_mm, streaks["diameter"]) - 1
    ahead = np.abs(streaks["direction"][:, 2]) < 0.05
    assert ahead.sum() > 20
    expected = 400.0 * rain.speed[index] * 0.01 / streaks["z"]
    assert length[ahead] == pytest.approx(expected[ahead], rel=0.02)


def test_a_particle_is_in_the_next_frame_where_its_velocity_takes_it(parameters, rain):
    near, step = parameters.air.near, 0.002
    wind = np.array([0.0, 1.0, 0.0])
    now, later = (
        visible_streaks(rain, near, shutter(time_s=t, exposure_s=1e-6), wind, 9) for t in (1.0, 1.0 + step)
    )
    pairs = {round(float(d), 12): k for k, d in enumerate(later["diameter"])}
    same = [
        (k, pairs[round(float(d), 12)]) for k, d in enumerate(now["diameter"]) if round(float(d), 12) in pairs
    ]
    assert len(same) > 0.8 * len(now)
    a, b = now[[k for k, _ in same]], later[[k for _, k in same]]
    index = np.searchsorted(1e-3 * rain.edges_mm, a["diameter"]) - 1
    moved = step * np.column_stack((-np.ones(len(a)), rain.speed[index]))
    expected = a["begin"] + 400.0 * moved / a["z"][:, None]
    assert b["begin"] == pytest.approx(expected, abs=0.1)


def test_particles_go_on_after_the_car_has_stopped(parameters, snow):
    near, wind = parameters.air.near, np.array(parameters.air.wind_m_s)
    frames = [visible_streaks(snow, near, shutter(time_s=t), wind, 2) for t in (5.0, 5.1, 5.2)]
    assert len({frame.tobytes() for frame in frames}) == 3
    assert min(len(frame) for frame in frames) > 100


def test_driving_turns_streaks_away_from_the_vanishing_point(parameters, snow):
    streaks = visible_streaks(snow, parameters.air.near, shutter(speed=20.0), CALM, 2)
    outward = 0.5 * (streaks["begin"] + streaks["end"]) - (240, 160)
    motion = streaks["end"] - streaks["begin"]
    far_out = np.linalg.norm(outward, axis=1) > 80
    cosine = (outward * motion).sum(axis=1) / np.linalg.norm(outward, axis=1) / np.linalg.norm(motion, axis=1)
    assert np.median(cosine[far_out]) > 0.95


def test_drawn_coverage_is_the_optical_depth_that_the_air_leaves_out(parameters, snow, rain):
    near = parameters.air.near
    for falling in (rain, snow):
        depth = np.full((320, 480), np.nan, np.float32)
        cover = []
        for seed in range(8):
            streaks = visible_streaks(falling, near, shutter(), CALM, seed)
            layer = draw_streaks(
                streaks, np.ones((len(streaks), 3)), depth, shutter().K, 1e-3 * near.aperture_mm
            )
            cover.append(-np.log(np.maximum(1 - layer.alpha, 1e-3)).mean())
        expected = drawn_optical_depth(falling, near, 400.0, np.array([near.farthest_m]))[0]
        assert np.mean(cover) == pytest.approx(expected, rel=0.08)


def test_a_row_by_row_shutter_sees_each_particle_at_the_time_of_its_row(parameters, rain):
    """The streak in row v is the one that a shutter for all rows sees at the time of row v."""
    near, wind, delay = parameters.air.near, np.array((0.0, 1.0, 0.0)), 7e-5
    still = shutter(exposure_s=1e-4)
    by_rows = visible_streaks(rain, near, replace(still, line_delay_s=delay), wind, 9)
    at_once = {
        round(float(s["diameter"]), 12): s["share"] for s in visible_streaks(rain, near, still, wind, 9)
    }
    at_rows = {round(float(d), 12): k for k, d in enumerate(by_rows["diameter"])}
    compared = 0
    for row in (20.0, 160.0, 300.0):
        time = delay * (row - 160)
        global_then = visible_streaks(rain, near, replace(still, time_s=2.0 + time), wind, 9)
        centre = 0.5 * (global_then["begin"] + global_then["end"])
        for k in np.flatnonzero((np.abs(centre[:, 1] - row) < 4) & (np.abs(centre[:, 0] - 240) < 230)):
            other = at_rows.get(round(float(global_then["diameter"][k]), 12))
            if other is None:
                continue
            seen = 0.5 * (by_rows["begin"][other] + by_rows["end"][other])
            motion = (global_then["end"][k] - global_then["begin"][k]) / 1e-4
            # both lie on the particle's way; it meets its row up to 4 rows earlier or later
            later = delay * (centre[k, 1] - row) / (1 - delay * motion[1])
            np.testing.assert_allclose(seen, centre[k] + motion * later, atol=0.15)
            longer = np.linalg.norm(by_rows["end"][other] - by_rows["begin"][other])
            assert longer == pytest.approx(np.linalg.norm(motion) * 1e-4 / (1 - delay * motion[1]), rel=0.02)
            # in more rows' exposures, with the same light in each
            share = by_rows["share"][other] / at_once[round(float(global_then["diameter"][k]), 12)]
            assert share == pytest.approx(1 / (1 - delay * motion[1]), rel=0.02)
            compared += 1
    assert compared > 20


def test_a_lens_bends_the_way_of_every_particle(parameters, rain):
    lens = Lens(k1=-0.3, k2=0.05)
    near, straight = parameters.air.near, shutter()
    bent = visible_streaks(rain, near, replace(straight, lens=lens), CALM, 4)
    plain = visible_streaks(rain, near, straight, CALM, 4)
    by_size = {round(float(d), 12): k for k, d in enumerate(bent["diameter"])}
    assert len(bent) > len(plain)  # a barrel sees more
    for streak in plain:
        other = bent[by_size[round(float(streak["diameter"]), 12)]]
        for end in ("begin", "end"):
            x, y = (streak[end] - (240, 160)) / 400
            expected = np.array(distort_rays(x, y, lens.coefficients)) * 400 + (240, 160)
            if np.abs(streak[end] - (240, 160)).max() < 240:
                np.testing.assert_allclose(other[end], expected, atol=1e-6)


def test_the_scene_hides_what_falls_behind_it(parameters, snow):
    near = parameters.air.near
    streaks = visible_streaks(snow, near, shutter(), CALM, 4)
    light = np.ones((len(streaks), 3))
    depth = np.full((320, 480), np.nan, np.float32)
    free = draw_streaks(streaks, light, depth, shutter().K, 0.0)
    depth[:, :240] = 0.1
    half = draw_streaks(streaks, light, depth, shutter().K, 0.0)
    assert free.alpha[:, :240].max() > 0.05
    assert half.alpha[:, :240].max() == 0
    assert np.array_equal(half.alpha[:, 240:], free.alpha[:, 240:])


def test_one_streak_covers_its_disc_whatever_blurs_it(parameters, snow):
    streaks = visible_streaks(snow, parameters.air.near, shutter(), CALM, 4)[:1].copy()
    streaks["begin"], streaks["end"], streaks["share"] = (248.3, 137.9), (255.1, 131.2), 1.0
    streaks["z"], streaks["diameter"] = 2.0, 0.012
    depth = np.full((320, 480), np.nan, np.float32)
    area = np.pi / 4 * (400.0 * 0.012 / 2.0) ** 2
    peaks = []
    for aperture in (0.0, 0.03, 0.08):
        layer = draw_streaks(streaks, np.full((1, 3), 0.7), depth, shutter().K, aperture)
        assert layer.alpha.sum() == pytest.approx(area, rel=0.02)
        assert layer.rgb.sum(axis=(0, 1)) == pytest.approx(np.full(3, 0.7 * area), rel=0.02)
        peaks.append(layer.alpha.max())
    assert peaks[0] > 1.5 * peaks[1] > 3 * peaks[2]


def test_two_streaks_over_each_other_let_through_what_both_let_through(parameters, snow):
    streak = visible_streaks(snow, parameters.air.near, shutter(), CALM, 4)[:1].copy()
    streak["begin"], streak["end"], streak["share"] = (248.3, 137.9), (251.1, 135.2), 1.0
    streak["z"], streak["diameter"] = 1.0, 0.012
    depth = np.full((320, 480), np.nan, np.float32)
    one = draw_streaks(streak, np.array([[1.0, 0, 0]]), depth, shutter().K, 0.0)
    both = draw_streaks(np.repeat(streak, 2), np.array([[1.0, 0, 0], [0, 0, 1.0]]), depth, shutter().K, 0.0)
    assert one.alpha.max() > 0.3
    assert both.alpha == pytest.approx(1 - (1 - one.alpha) ** 2, abs=1e-5)
    assert both.rgb[..., 0] == pytest.approx(both.alpha / 2, abs=1e-5)
    assert both.rgb[..., 2] == pytest.approx(both.alpha / 2, abs=1e-5)


def test_air_without_drawn_particles_gives_an_empty_layer(parameters, rain):
    near = replace(parameters.air.near, farthest_m=0.61)
    streaks = visible_streaks(rain, near, shutter(), CALM, 4)
    assert len(streaks) == 0
    layer = draw_streaks(streaks, np.ones((0, 3)), np.ones((320, 480), np.float32), shutter().K, 0.0)
    assert layer.alpha.max() == 0
    assert layer.rgb.max() == 0
