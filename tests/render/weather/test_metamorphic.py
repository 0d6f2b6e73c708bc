"""Changes that must follow in a finished frame when one thing about it changes."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.composition import compose_over_sky, encode_8bit
from tasks.render.environment import environment_view
from tasks.render.labels import compute_flow
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.weather.atmosphere import air_layer, light_layer, precipitating_air
from tasks.render.weather.attribution import snow_on
from tasks.render.weather.falling.precipitation import make_population
from tasks.render.weather.layer import recompose_layers
from tasks.render.weather.layers import apply_weather
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.scene_light import append_gaussians
from tasks.render.weather.sky import sky_light
from tasks.surface.state import SurfaceState
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import flat_gbuffer, road, see_sky, surfels, weather_over

SIZE = {"width": 144, "height": 96, "focal": 120.0}
RAIN = SurfaceState(kind="rain", precipitation_mm_h=25, film_depth_mm=0.839)
SNOW = SurfaceState(kind="snow", precipitation_mm_h=1, snow_depth_mm=10, snow_coverage=0.5)


def even_sky():
    """A sky without a sun, the same to either side."""
    height = np.linspace(1, 0.2, 32)[:, None, None]
    return np.ascontiguousarray(np.broadcast_to(height * (0.5, 0.7, 1.0), (32, 64, 3)), dtype=np.float32)


@pytest.fixture(scope="module")
def street():
    """A road, a striped wall across it, and a block to one side."""
    y, z = (part.ravel() for part in np.meshgrid(np.arange(-4, 4, 0.1), np.arange(0, 4, 0.1)))
    stripes = 0.15 + 0.4 * (np.floor(1.5 * y) % 2)[:, None] * np.ones(3)
    wall = surfels(
        np.column_stack((np.full(y.size, 16.0), y, z)), (-1, 0, 0), 0.08, stripes, SemanticClass.BUILDING
    )
    near = (y > 1.5) & (y < 2.8) & (z < 1.6)
    block = surfels(
        np.column_stack((np.full(near.sum(), 9.0), y[near], z[near])),
        (-1, 0, 0),
        0.08,
        0.3,
        SemanticClass.VEHICLE,
    )
    return append_gaussians(append_gaussians(road(), wall), block)


def rendered(street, state, parameters, time_s=2.0, x=0.0, speed=10.0):
    view = shutter(time_s=time_s, x=x, speed=speed, exposure_s=0.005, **SIZE)
    scene, weather = weather_over(street, even_sky(), state, parameters)
    viewmat = np.linalg.inv(view.T_world_camera)
    gbuffer = rasterise_view(prepare_gaussians(scene), viewmat, view.K, view.width, view.height)
    sky = environment_view(even_sky(), viewmat, view.K, view.width, view.height)
    picture = compose_over_sky(gbuffer, sky, street.display_encoded)
    return weather, apply_weather(weather, picture, sky, gbuffer, view), gbuffer, view


@pytest.mark.parametrize("state", [RAIN, SNOW], ids=["rain", "snow"])
def test_frame_57_alone_is_frame_57_in_sequence(street, parameters, state):
    frames = {
        k: rendered(street, state, parameters, time_s=k / 10, x=0.02 * k)[1].picture for k in (55, 56, 57)
    }
    alone = rendered(street, state, parameters, time_s=5.7, x=0.02 * 57)[1].picture
    assert alone.tobytes() == frames[57].tobytes()
    assert alone.tobytes() != frames[56].tobytes()


def test_snow_that_covers_more_leaves_no_covered_pixel_bare(street, parameters):
    masks = []
    for coverage in (0.1, 0.3, 0.6, 0.9):
        weather, _, _, view = rendered(street, replace(SNOW, snow_coverage=coverage), parameters)
        # the same pixels' points, or the snow's own height would shift them
        masks.append(snow_on(ROAD_CLASSES, weather, flat_gbuffer(view)[1], view))
    for less, more in pairwise(masks):
        assert not (less & ~more).any()
        assert more.sum() > less.sum()


def test_a_deeper_film_mirrors_more_and_a_longer_exposure_leaves_the_street_as_it_is(street, parameters):
    light = [
        rendered(street, replace(RAIN, film_depth_mm=film), parameters)[1].layers[1].add.sum()
        for film in (0.05, 0.2, 0.5, 0.84, 1.3)
    ]
    assert np.all(np.diff(light) > 0)
    _, drawn, gbuffer, view = rendered(street, RAIN, parameters)
    weather, picture = rendered(street, RAIN, parameters)[0], drawn.base
    sky = see_sky(even_sky(), view)
    longer = apply_weather(weather, picture, sky, gbuffer, replace(view, exposure_s=2 * view.exposure_s))
    for before, after in zip(drawn.layers[:-1], longer.layers[:-1], strict=True):
        assert before.add.tobytes() == after.add.tobytes()
    # twice as long and half as strong: as much light is taken
    lost = [(1 - frame.layers[-1].gain).sum() for frame in (drawn, longer)]
    assert lost[1] == pytest.approx(lost[0], rel=0.1)


@pytest.mark.parametrize("state", [SurfaceState(kind="dry"), SNOW], ids=["dry", "snow"])
def test_the_next_frame_warped_back_by_the_flow_is_this_one(street, parameters, state):
    """Median difference of what stays in sight: at most two grey levels."""
    (_, now, here, view), (_, later, there, next_view) = (
        rendered(street, state, parameters, time_s=2 + 0.1 * k, x=1.5 + 0.6 * k, speed=6) for k in (0, 1)
    )
    flow, occluded = compute_flow(
        here.depth, there.depth, view.K, view.T_world_camera, next_view.T_world_camera
    )
    first, second = (encode_8bit(frame.picture).astype(float).mean(axis=2) for frame in (now, later))
    rows, columns = np.indices(first.shape)
    with np.errstate(invalid="ignore"):
        u, v = columns + flow[..., 0], rows + flow[..., 1]
        inside = ~occluded & np.isfinite(u) & (u > 0) & (u < 142) & (v > 0) & (v < 94)
    u, v = u[inside], v[inside]
    c, r = u.astype(int), v.astype(int)
    tx, ty = u - c, v - r
    warped = (1 - ty) * ((1 - tx) * second[r, c] + tx * second[r, c + 1])
    warped += ty * ((1 - tx) * second[r + 1, c] + tx * second[r + 1, c + 1])
    assert inside.mean() > 0.4
    assert np.median(np.abs(warped - first[inside])) <= 2.0
    unmoved = np.median(np.abs(second[inside] - first[inside]))
    assert np.median(np.abs(warped - first[inside])) < unmoved


def test_a_mirrored_street_makes_the_mirrored_frame(street, parameters):
    """Left and right swapped, up to rounding; fields and particles have no mirror, so they are left out."""
    # Gaussians of equal depth would be drawn in the order they are stored in
    apart = np.random.default_rng(1).uniform(0, 0.02, len(street.means))[:, None] * (1, 0, 0)
    uneven = replace(street, means=(street.means + apart).astype(np.float32))
    mirrored = replace(
        uneven, means=uneven.means * np.float32((1, -1, 1)), normals=uneven.normals * np.float32((1, -1, 1))
    )
    air = precipitating_air(
        make_population(parameters.kinds["rain"].particles, 25.0), parameters.air.near, 120.0, 12000.0
    )
    sky = sky_light(np.full(3, 1.7), 0.5, air.extinction, 0.1, parameters.sky)
    pictures = []
    for side in (uneven, mirrored):
        _, drawn, gbuffer, view = rendered(side, SurfaceState(kind="dry"), parameters)
        around = see_sky(even_sky(), view)
        layers = [
            light_layer(drawn.base, gbuffer, around, around, sky),
            air_layer(gbuffer, around, air, sky, pixel_rays(view)),
        ]
        pictures.append((drawn.base, recompose_layers(drawn.base, layers), gbuffer.depth))
    assert np.abs(pictures[0][0] - pictures[0][0][:, ::-1]).max() > 0.1
    for straight, turned in zip(*pictures, strict=True):
        close = np.isclose(turned[:, ::-1], straight, atol=2e-4, rtol=1e-3, equal_nan=True)
        assert close.mean() > 0.995


def test_koschmieder_at_the_visual_range_leaves_five_percent_of_a_black_target(parameters):
    """Pinned: a black object shows L_air (1 - exp(-2.996 d / V)); V by the 5 % threshold of WMO-No. 8."""
    view = shutter(**SIZE)
    picture, gbuffer = flat_gbuffer(view, shade=0.0)
    air = replace(
        precipitating_air(
            make_population(parameters.kinds["rain"].particles, 25.0), parameters.air.near, 120.0, 12000.0
        ),
        extinction=2.995732 / 50.0, drawn=np.zeros(65),
    )  # fmt: skip
    sky = sky_light(np.full(3, 1.7), 0.5, air.extinction, 0.1, parameters.sky)
    veil = recompose_layers(
        picture, [air_layer(gbuffer, see_sky(even_sky(), view), air, sky, pixel_rays(view))]
    )
    distance = gbuffer.depth * np.linalg.norm(pixel_rays(view), axis=-1)
    for share, at in ((0.05, 50.0), (0.5, 50.0 * np.log(2) / np.log(20)), (0.814, 50.0 * 0.0687)):
        row, column = np.unravel_index(np.nanargmin(np.abs(distance - at)), distance.shape)
        left = 1 - veil[row, column] / sky.airlight
        off = np.exp(2.995732 / 50 * (distance[row, column] - at))
        assert left * off == pytest.approx(np.full(3, share), rel=2e-3)
