"""The whole weather on a small street: what comes out, what it is made of, and what refuses to run."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.errors import InputError
from tasks.render.composition import encode_8bit, to_linear
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.weather.attribution import LAYER_BITS, attribute_pixels, paper_picture, snow_on
from tasks.render.weather.controls import air_controls
from tasks.render.weather.layer import recompose_layers
from tasks.render.weather.layers import apply_weather
from tasks.render.weather.scene_light import append_gaussians, to_display_unclipped
from tasks.render.weather.snow.layer import GROUND_CLASSES
from tasks.surface.state import SurfaceState
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import PAVEMENT, clear_sky, road, surfels, weather_over

SKY = clear_sky()
RAIN = {
    rate: SurfaceState(kind="rain", precipitation_mm_h=rate, film_depth_mm=film)
    for rate, film in ((2, 0.189), (10, 0.489), (25, 0.839), (50, 1.263))
}
SNOW = {
    rate: SurfaceState(
        kind="snow", precipitation_mm_h=rate, snow_depth_mm=10 * rate, snow_coverage=min(1, rate / 2)
    )
    for rate in (0.5, 1, 2, 3)
}
ICE = SurfaceState(kind="ice", film_depth_mm=0.4)
SIZE = {"width": 144, "height": 96, "focal": 120.0}


@pytest.fixture(scope="module")
def street():
    y, z = np.meshgrid(np.arange(-4, 4, 0.12), np.arange(0, 4, 0.12))
    wall = surfels(
        np.column_stack((np.full(y.size, 16.0), y.ravel(), z.ravel())),
        (-1, 0, 0),
        0.08,
        0.25,
        SemanticClass.BUILDING,
    )
    return append_gaussians(road(), wall)


def frame(
    street, state, parameters, seed=1, time_s=2.0, speed=10.0, exposure_s=0.005, anchors=(), refracts=False,
    pavement=PAVEMENT,
):  # fmt: skip
    view = shutter(time_s=time_s, exposure_s=exposure_s, speed=speed, **SIZE)
    scene, weather = weather_over(
        street, SKY, state, parameters, seed, anchors=anchors, refracts=refracts, pavement=pavement
    )
    gbuffer = rasterise_view(
        prepare_gaussians(scene), np.linalg.inv(view.T_world_camera), view.K, view.width, view.height
    )
    sky = np.broadcast_to(np.float32((0.2, 0.4, 0.8)), gbuffer.rgb.shape)
    picture = gbuffer.rgb + (1 - gbuffer.alpha[..., None]) * sky
    return weather, apply_weather(weather, picture, sky, gbuffer, view), gbuffer, view


def test_dry_weather_changes_no_bit(street, parameters):
    scene, weather = weather_over(street, SKY, SurfaceState(kind="dry"), parameters)
    assert scene is street
    _, drawn, gbuffer, view = frame(street, SurfaceState(kind="dry"), parameters)
    assert drawn.picture is drawn.base
    assert drawn.layers == ()
    assert attribute_pixels(weather, drawn, gbuffer, view).max() == 0


@pytest.mark.parametrize("state", [RAIN[25], SNOW[1], ICE], ids=["rain", "snow", "ice"])
def test_layers_recompose_to_the_picture_bit_for_bit(street, parameters, state):
    _, drawn, _, _ = frame(street, state, parameters)
    assert recompose_layers(drawn.base, drawn.layers).tobytes() == drawn.picture.tobytes()
    names = [layer.name for layer in drawn.layers]
    layers = {"rain": ["light", "wet", "air", "particles"], "snow": ["light", "air", "particles"]}
    assert names == layers.get(state.kind, ["light", "wet", "air"])
    assert np.isfinite(drawn.picture).all()
    assert drawn.picture.min() >= 0
    assert drawn.picture.dtype == np.float32


def test_a_picture_without_normals_is_the_same_where_the_weather_reads_none(street, parameters):
    for state in (SurfaceState(kind="dry"), RAIN[10], SNOW[2], ICE):
        weather, drawn, gbuffer, view = frame(street, state, parameters)
        sky = np.broadcast_to(np.float32((0.2, 0.4, 0.8)), gbuffer.rgb.shape)
        other = replace(gbuffer, normal=np.ones_like(gbuffer.normal))
        flat = apply_weather(weather, drawn.base, sky, other, view)
        assert np.array_equal(flat.picture, drawn.picture) != weather.reads_normals, state.kind


@pytest.mark.parametrize("state", [RAIN[25], SNOW[1]], ids=["rain", "snow"])
def test_the_same_inputs_give_the_same_bytes(street, parameters, state):
    first, second = (frame(street, state, parameters)[1].picture for _ in range(2))
    assert first.tobytes() == second.tobytes()
    assert first.tobytes() != frame(street, state, parameters, seed=2)[1].picture.tobytes()


@pytest.mark.parametrize("state", [RAIN[50], SNOW[2]], ids=["rain", "snow"])
def test_when_the_car_stands_only_particles_move(street, parameters, state):
    now = frame(street, state, parameters, speed=0, time_s=3.0)[1]
    later = frame(street, state, parameters, speed=0, time_s=3.1)[1]
    for first, second in zip(now.layers, later.layers, strict=True):
        same = first.gain.tobytes() == second.gain.tobytes() and first.add.tobytes() == second.add.tobytes()
        assert same == (first.name != "particles")
    assert now.base.tobytes() == later.base.tobytes()


def test_the_road_is_white_where_the_pavements_own_cover_depth_has_snow(street, parameters):
    """On a pavement that 40 mm cover, 22 mm leave 45 % of the road bare; 20 mm cover asphalt."""
    state = SurfaceState(kind="snow", precipitation_mm_h=2.2, snow_depth_mm=22, snow_coverage=0.55)
    later = replace(PAVEMENT, full_cover_depth_mm=40)
    weather, drawn, gbuffer, view = frame(street, state, parameters, pavement=later)
    road = np.isin(gbuffer.class_id, ROAD_CLASSES)
    covered, light = snow_on(ROAD_CLASSES, weather, gbuffer, view), drawn.base.mean(axis=-1)
    assert 0.4 < covered[road].mean() < 0.8
    assert np.median(light[road & ~covered]) < 0.5 * np.median(light[covered])


def test_a_coarser_texture_mirrors_less(street, parameters):
    coarse = replace(PAVEMENT, texture_depth_mm=1.5)
    fine, rough = (
        frame(street, RAIN[50], parameters, pavement=one)[1].layers[1].add for one in (PAVEMENT, coarse)
    )
    assert rough.sum() < 0.9 * fine.sum()


def test_severity_is_ordered(street, parameters):
    """Rain: less contrast of the far wall, more mirrored light; snow: more snow, then deeper veil."""
    wet = [frame(street, state, parameters)[1].layers[1].add.sum() for state in RAIN.values()]
    assert np.all(np.diff(wet) > 0)
    masks = []
    for state in SNOW.values():
        weather, _, gbuffer, view = frame(street, state, parameters)
        masks.append(snow_on(ROAD_CLASSES, weather, gbuffer, view))
    road = (gbuffer.class_id == SemanticClass.ROAD) & (gbuffer.alpha > 0.5)
    assert masks[0].sum() < masks[1].sum() < masks[2].sum()
    assert np.array_equal(masks[3], road)
    for states in (RAIN, SNOW):
        veil = [frame(street, state, parameters)[1].layers[-2].gain[48, 72, 0] for state in states.values()]
        assert np.all(np.diff(veil) < 0)


def test_particles_hide_more_as_the_rate_rises(street, parameters):
    for states in (RAIN, SNOW):
        cover = [
            (1 - frame(street, state, parameters)[1].layers[-1].gain).mean() for state in states.values()
        ]
        assert np.all(np.diff(cover) > 0)


def test_attribution_names_the_layers_that_changed_a_pixel(street, parameters):
    weather, drawn, gbuffer, view = frame(street, RAIN[50], parameters)
    bits = attribute_pixels(weather, drawn, gbuffer, view)
    road = gbuffer.class_id == SemanticClass.ROAD
    assert (bits[road] & LAYER_BITS["wet"] > 0).mean() > 0.95
    # the outline of what stands beside it shows road in part
    about = cv2.dilate(road.astype(np.uint8), np.ones((5, 5))) > 0
    assert not (bits[~about] & LAYER_BITS["wet"]).any()
    assert not (bits & LAYER_BITS["snow"]).any()
    falls = bits & LAYER_BITS["particles"] > 0
    assert 0 < falls.mean() < 0.6
    assert (drawn.layers[-1].gain[..., 0][falls] < 1).all()

    weather, drawn, gbuffer, view = frame(street, SNOW[1], parameters)
    snow = attribute_pixels(weather, drawn, gbuffer, view) & LAYER_BITS["snow"] > 0
    white = drawn.base[..., 0] > 0.6
    on_road = gbuffer.class_id == SemanticClass.ROAD
    assert (snow == white)[on_road].mean() > 0.8


def test_the_mark_of_snow_is_on_level_ground_beside_the_road_too(street, parameters):
    weather, _, gbuffer, view = frame(street, SNOW[1], parameters)
    road = gbuffer.class_id == SemanticClass.ROAD
    left = road & (np.arange(144) < 72)
    pavement = np.where(left, np.uint8(SemanticClass.SIDEWALK), gbuffer.class_id)
    beside = replace(gbuffer, class_id=pavement)
    marked, on_road = (
        snow_on(GROUND_CLASSES, weather, beside, view),
        snow_on(ROAD_CLASSES, weather, gbuffer, view),
    )
    # wheels leave the road bare, and nothing the ground beside it
    assert marked[left & (gbuffer.alpha > 0.5)].all()
    assert np.array_equal(marked[~left], on_road[~left])
    assert not snow_on(ROAD_CLASSES, weather, beside, view)[left].any()
    upright = replace(beside, normal=np.where(left[..., None], np.float32((1, 0, 0)), gbuffer.normal))
    assert not snow_on(GROUND_CLASSES, weather, upright, view)[left].any()


def test_the_paper_s_composition_adds_the_residual_of_8_bit_pictures(street, parameters):
    _, drawn, _, _ = frame(street, SNOW[2], parameters)
    ours = encode_8bit(drawn.picture)
    # without a wet layer the residual is added to the very picture it was taken from
    assert np.array_equal(paper_picture(drawn), ours)
    _, wet, _, _ = frame(street, RAIN[50], parameters)
    apart = np.abs(paper_picture(wet).astype(int) - encode_8bit(wet.picture))
    assert 0 < apart.max() < 40
    assert apart.mean() < 1


def test_display_values_go_on_beyond_white():
    display = np.linspace(0, 1.5, 1001)
    assert to_display_unclipped(to_linear(display)) == pytest.approx(display, abs=1e-6)


def test_every_rule_that_a_state_breaks_is_told_at_once():
    with pytest.raises(InputError) as caught:
        SurfaceState(kind="snow", precipitation_mm_h=-1.0, snow_coverage=1.2, snow_depth_mm=float("nan"))
    text = "\n".join(caught.value.problems)
    for part in (
        "snow_coverage must not exceed 1; it is 1.2",
        "snow_depth_mm",
        "precipitation_mm_h must be a number",
    ):
        assert part in text
    assert len(caught.value.problems) == 3


def test_nothing_falls_at_no_rate_and_an_unknown_kind_is_refused(street, parameters):
    assert weather_over(street, SKY, SurfaceState(kind="snow"), parameters)[1].outside.population is None
    with pytest.raises(InputError, match=r"must be dry, rain.*it is 'hail'"):
        weather_over(street, SKY, SurfaceState(kind="hail"), parameters)


def test_a_scene_without_road_is_refused(street, parameters):
    bare = replace(street, class_id=np.full(len(street), SemanticClass.BUILDING, np.uint8))
    with pytest.raises(InputError, match="no Gaussian of the scene has class road"):
        weather_over(bare, SKY, RAIN[10], parameters)


def test_between_two_anchors_the_papers_picture_blends_theirs(street, parameters):
    """Still pictures by the rate, particles by their number; the frames of the anchors are those of their rates."""
    pair = RAIN[10], RAIN[25]
    _, drawn, _, _ = frame(street, replace(RAIN[10], precipitation_mm_h=15), parameters, anchors=pair)
    low, high = drawn.blend.low, drawn.blend.high
    for state, shown in zip(pair, (low, high), strict=True):
        assert frame(street, state, parameters)[1].picture.tobytes() == shown.picture.tobytes()
    less, own, more = (air_controls("rain", rate, parameters).particles_m3 for rate in (10, 15, 25))
    assert drawn.blend.still == pytest.approx((15 - 10) / (25 - 10))
    assert drawn.blend.falling == pytest.approx((own - less) / (more - less))
    assert drawn.blend.still < drawn.blend.falling

    still, falls = [], []
    for shown in (low, high):
        without = [layer for layer in shown.layers if layer.name in {"light", "air"}]
        dry = encode_8bit(recompose_layers(shown.base, without)).astype(float)
        falls.append(encode_8bit(recompose_layers(shown.base, [*without, shown.layers[-1]])) - dry)
        still.append(encode_8bit(recompose_layers(shown.base, shown.layers[:-1])).astype(float))
    expected = still[0] + (still[1] - still[0]) / 3
    expected += falls[0] + drawn.blend.falling * (falls[1] - falls[0])
    assert np.abs(paper_picture(drawn) - np.clip(expected, 0, 255)).max() <= 0.51
    assert np.array_equal(
        paper_picture(replace(drawn, blend=replace(drawn.blend, still=0, falling=0))), paper_picture(low)
    )


def test_the_anchors_of_a_refracting_film_refract_too_and_change_a_pixel_by_one_grey_level_at_most(
    street, parameters
):
    """At the paper's rates: a tenth of a pixel of shift over this street's texture."""
    pair = RAIN[25], RAIN[50]
    one = replace(RAIN[25], precipitation_mm_h=35, film_depth_mm=1.02)
    plain, refracted = (
        frame(street, one, parameters, anchors=pair, refracts=refracts)[1] for refracts in (False, True)
    )
    for a, b in (
        (plain, refracted),
        (plain.blend.low, refracted.blend.low),
        (plain.blend.high, refracted.blend.high),
    ):
        apart = np.abs(encode_8bit(a.picture).astype(int) - encode_8bit(b.picture))
        assert not np.array_equal(a.picture, b.picture) and apart.max() <= 1
