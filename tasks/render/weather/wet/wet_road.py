"""The wet road and pavement: darker under a film, and a mirror where the film lies over the texture.

Kerbs and earth drain: water fills their pores, so that they are darker, but no film stands on them.

Refraction moves the texture below by under a tenth of a pixel at 480x320: it is drawn where it is asked for.
"""

from dataclasses import dataclass, replace
from math import sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.composition import LUMINANCE
from tasks.render.pixels import (
    INLINED,
    LAW,
    blur,
    bring_to_host,
    find_classes,
    find_namespace,
    new_picture,
    run_on_either,
)
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.falling.precipitation import Population
from tasks.render.weather.falling.streaks import draw_streaks
from tasks.render.weather.layer import Layer
from tasks.render.weather.sky import SkyLight
from tasks.render.weather.wet.impacts import ImpactParameters, visible_impacts
from tasks.render.weather.wet.lobe import average_over_lobe
from tasks.render.weather.wet.puddles import (
    RoadWaterParameters,
    compute_struck_slope,
    compute_wetness,
    water_surface,
)
from tasks.render.weather.wet.reflection import mirrored_scene
from tasks.render.weather.wet.refraction import compute_film_shift, see_through_film
from tasks.render.weather.wet.road_view import RoadView


@dataclass(frozen=True, kw_only=True)
class RoadFilmParameters:
    """Optics of a road under a film of water or of ice.

    Parameters
    ----------
    water : how the film lies
    refractive_index : of water or ice [1]
    diffuse_reflectance : mean reflectance of the film's surface for diffuse light from above [1]
    rough_slope : standard deviation of the slopes of coated texture that stands out of the film [1]
    normal_window : width of the window over which road normals are averaged, by picture height [1]
    impacts : what drops leave where they strike it; None shows none
    """

    water: RoadWaterParameters
    refractive_index: float
    diffuse_reflectance: float
    rough_slope: float
    normal_window: float
    impacts: ImpactParameters | None = None


@dataclass(frozen=True, kw_only=True)
class RoadFilm:
    """The film on the road of one clip.

    Parameters
    ----------
    depth_mm : total film depth h_t [mm]
    texture_depth_mm : mean texture depth of the pavement, MTD [mm]
    parameters : optics of the wet road
    seed : visual seed of the clip [1]
    rate_mm_h : rate of the rain that strikes it [mm/h]
    falling : that rain; None where none falls
    refracts : whether the texture below is drawn where the film shows it
    """

    depth_mm: float
    texture_depth_mm: float
    parameters: RoadFilmParameters
    seed: int
    rate_mm_h: float = 0.0
    falling: Population | None = None
    refracts: bool = False


@dataclass(frozen=True, kw_only=True)
class LightOnRoad:
    """Light that a wet road mirrors beside the picture itself.

    Parameters
    ----------
    environment : float32 [h, w, 3] sky and far field under cloud [1]
    sky : the light under cloud
    extinction : extinction coefficient of the air [m-1]
    """

    environment: NDArray[np.float32]
    sky: SkyLight
    extinction: float


@numba.njit(cache=True, nogil=True, error_model="numpy")
def fresnel_reflectance(cosine, refractive_index):  # type: ignore[no-untyped-def]
    """Unpolarised reflectance of a smooth surface (Fresnel; Born & Wolf 1999, section 1.5).

    Parameters
    ----------
    cosine : cosine of the angle of incidence, in air [1]
    refractive_index : of the medium below [1]

    Returns
    -------
    float, reflectance [1]
    """
    n = refractive_index
    inside = sqrt(n * n - 1 + cosine * cosine)
    across = (cosine - inside) / (cosine + inside)
    along = (n * n * cosine - inside) / (n * n * cosine + inside)
    return (across * across + along * along) / 2


@numba.njit(cache=True, nogil=True, error_model="numpy")
def wet_albedo_ratio(albedo, refractive_index, diffuse_reflectance):  # type: ignore[no-untyped-def]
    """Diffuse reflectance of a surface under a water film by its dry one.

    Lekner & Dorf (1988, doi:10.1364/AO.27.001278), after Angstrom: light that the surface scatters back meets the
    water surface from below and is returned with probability p = 1 - (1 - R) / n^2; summed over all returns,
    (1 - R) A (1 - p) / (1 - p A) comes out.

    Parameters
    ----------
    albedo : number or array, dry reflectance A [1]
    refractive_index : n of water [1]
    diffuse_reflectance : R of the water surface for diffuse light from above [1]

    Returns
    -------
    number or array, wet by dry reflectance [1]
    """
    p = 1 - (1 - diffuse_reflectance) / refractive_index**2
    return (1 - diffuse_reflectance) * (1 - p) / (1 - p * albedo)


def wet_layer(
    picture: NDArray[np.float32],
    gbuffer: GBuffer,
    shutter: Shutter,
    rays: NDArray[np.float32],
    film: RoadFilm,
    light: LightOnRoad,
) -> Layer:
    """Return the layer of water on the road and on the ground beside it.

    Parameters
    ----------
    picture : float32 [H, W, 3] the dry scene in its light, without the veil of the air [1]
    gbuffer : the rasterisation
    shutter : pose and intrinsics
    rays : float32 [H, W, 3] world directions of the pixels, of camera z 1 [1]
    film : the water
    light : what it mirrors beside the picture

    Returns
    -------
    Layer
    """
    p, sky = film.parameters, light.sky
    focal_px = float(shutter.K[1, 1])
    xp = find_namespace(picture)
    road, share = soften_mask(find_classes(gbuffer.class_id, PAVED_CLASSES) & (gbuffer.alpha > 0.5))
    road &= xp.isfinite(gbuffer.depth)  # a single pixel of sky between those of a road mirrors nothing
    window = 2 * round(p.normal_window * shutter.height / 2) + 1
    # a slope s along the line of sight turns the mirrored ray by 2 s: a lobe is as high as its slopes, and
    # narrow across at grazing angles
    struck_slope = compute_struck_slope(film.rate_mm_h, p.water)
    smooth_reach, rough_reach = (round(slope * focal_px) for slope in (struck_slope, p.rough_slope))
    mirrors = xp.asarray(road, copy=True)
    if smooth_reach >= LEAST_REACH:
        mirrors[1::2] &= ~road[: shutter.height // 2 * 2 : 2]
    view = RoadView(
        road=road,
        mirrors=mirrors,
        depth=gbuffer.depth,
        normal=_road_normals(gbuffer.normal, road, window),
        rays=rays,
        T_world_camera=shutter.T_world_camera,
        K=shutter.K,
    )
    water = water_surface(view, film.depth_mm, film.texture_depth_mm, p.water, film.seed)
    mirrored = mirrored_scene(
        picture, replace(view, normal=water.normal), light.environment, light.extinction, sky.airlight
    )
    sharp, rough = (
        average_over_lobe(mirrored, view, reach, slope * focal_px * water.cosine)
        for reach, slope in ((smooth_reach, struck_slope), (rough_reach, p.rough_slope))
    )
    gain, add = new_picture(picture, 1), new_picture(picture, 3)
    gain += 1
    drained = soaked_share(gbuffer, road)
    _wet(
        picture, road, drained, water.wet, water.smooth, water.cosine, sharp, rough,
        compute_wetness(film.depth_mm, p.water),
        p.water.ripple_slope, p.rough_slope, p.refractive_index, p.diffuse_reflectance,
        LUMINANCE / float(LUMINANCE @ sky.white), share, gain, add,
    )  # fmt: skip
    if film.refracts:
        shift = compute_film_shift(view, 1e-3 * film.depth_mm, p.refractive_index)
        below = see_through_film(picture, view, shift) - picture
        add += gain * water.smooth[..., None] * below
    if p.impacts is not None and film.falling is not None:
        depth, wetted, smooth = map(bring_to_host, (gbuffer.depth, road, water.smooth))
        struck = visible_impacts(film.falling, p.impacts, shutter, depth, wetted, smooth, film.seed)
        bright = np.broadcast_to(p.impacts.light * sky.white, (len(struck), 3))
        splashed = draw_streaks(struck, bright, gbuffer.depth, shutter.K, 0.0)
        _cover_where(splashed.alpha, splashed.rgb, gain, add)
    return Layer(name="wet", gain=gain, add=add)


def soften_mask(mask: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Return a mask without single pixels of another class, and the share of it about each of its pixels.

    Parameters
    ----------
    mask : bool [H, W]

    Returns
    -------
    mask : bool [H, W] where most of the pixels about one are in it
    share : float32 [H, W] rising from a half at its edge to 1; 0 outside
    """
    width = 2 * round(EDGE_WINDOW * len(mask) / 2) + 1
    xp = find_namespace(mask)
    smooth = blur(xp.asarray(mask, dtype=xp.float32), width) > 0.5
    return smooth, xp.where(smooth, blur(xp.asarray(smooth, dtype=xp.float32), 3), 0.0)


def soaked_share(gbuffer: GBuffer, road: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return how wet the ground beside the road gets by that of the road, and what stands on it by its foot.

    Parameters
    ----------
    gbuffer : the rasterisation
    road : bool [H, W] pixels of the road

    Returns
    -------
    float32 [H, W] share; 0 on the road [1]
    """
    xp = find_namespace(road)
    facing = xp.clip(gbuffer.normal[..., 2] / STEEPEST_SOAKED, 0, 1)
    drained = find_classes(gbuffer.class_id, DRAINED_CLASSES)
    # the outline of what stands on wet ground shows ground in part
    soaked = blur(xp.where(drained, facing, 0.0), 3)
    return xp.where(road, 0.0, soaked)


EDGE_WINDOW = 0.014
"""Width of the window in which most pixels decide whether one is road, by picture height [1]."""
PAVED_CLASSES = (*ROAD_CLASSES, SemanticClass.SIDEWALK)
"""Ground on which a film stands."""
DRAINED_CLASSES = (SemanticClass.KERB, SemanticClass.TERRAIN)
"""Ground that water runs off, or into."""
LEAST_REACH = 4
"""Rows to either side over which mirrored light is averaged, from which on a pixel leaves its own light out where the
pixel above it has some [px]."""
STEEPEST_SOAKED = 0.5
"""Upward part of a normal from which on ground is soaked through: 60 deg steep, it still gets half the rain [1]."""
ALBEDO_RANGE = (0.02, 0.9)
"""Reflectances that a road's own paint and stone can have; beyond them it is the light that was misread."""


@numba.njit(**INLINED)
def _wet_pixel(  # type: ignore[no-untyped-def]
    row, column, picture, road, drained, wet, smooth, cosine, sharp, rough, soaking, ripple_slope, rough_slope, index,
    diffuse, to_albedo, on_road, gain, add,
):  # fmt: skip
    """Mirror lobes of smooth water and of wet texture over the darkened road.

    Facets tilted towards the eye meet its line of sight more steeply than the mean surface: a lobe of slope s
    reflects as a mirror does at the cosine sqrt(cos^2 + s^2). Drained ground is as wet as it faces the rain.
    At the road's edge a pixel is road in part.
    """
    one = np.float32(1)
    soaked = wet[row, column] if road[row, column] else soaking * drained[row, column]
    if soaked <= 0:
        return
    albedo = 0.0
    for c in range(3):
        albedo += to_albedo[c] * picture[row, column, c]
    albedo = min(max(albedo, ALBEDO_RANGE[0]), ALBEDO_RANGE[1])
    darker = 1 - soaked * (1 - wet_albedo_ratio(albedo, index, diffuse))
    if not road[row, column]:
        gain[row, column, 0] = darker
        return
    share, steep = smooth[row, column], cosine[row, column] * cosine[row, column]
    mirror = share * fresnel_reflectance(min(1.0, sqrt(steep + ripple_slope * ripple_slope)), index)
    sheen = (soaked - share) * fresnel_reflectance(min(1.0, sqrt(steep + rough_slope * rough_slope)), index)
    part = on_road[row, column]
    gain[row, column, 0] = one - part * (one - np.float32((1 - mirror - sheen) * darker))
    for c in range(3):
        mirrored = mirror * sharp[row, column, c] + sheen * rough[row, column, c]
        add[row, column, c] = np.float32(mirrored) * part


@run_on_either(_wet_pixel)
@numba.njit(**LAW)
def _wet(  # type: ignore[no-untyped-def]
    picture, road, drained, wet, smooth, cosine, sharp, rough, soaking, ripple_slope, rough_slope, index, diffuse,
    to_albedo, on_road, gain, add,
):  # fmt: skip
    for row in range(road.shape[0]):
        for column in range(road.shape[1]):
            _wet_pixel(
                row, column, picture, road, drained, wet, smooth, cosine, sharp, rough, soaking, ripple_slope,
                rough_slope, index, diffuse, to_albedo, on_road, gain, add,
            )  # fmt: skip


def _road_normals(normal: NDArray[np.float32], road: NDArray[np.bool_], window: int) -> NDArray[np.float32]:
    """Road normals averaged over a window of the road alone; up where there is no road."""
    mean = new_picture(normal, 3)
    mean[..., 2] = 1
    rows = np.flatnonzero(bring_to_host(road.any(1)))
    if len(rows):
        # the window reaches no further than this; a road fills half of the picture at most
        near = slice(max(rows[0] - window, 0), rows[-1] + window + 1)
        on_road = new_picture(normal[near], 3)
        _copy_where(road[near], normal[near], on_road)
        _normalise_where(road[near], blur(on_road, window), mean[near])
    return mean


@numba.njit(**INLINED)
def _cover_pixel(row, column, alpha, light, gain, add):  # type: ignore[no-untyped-def]
    """Put what hides a share of the layer before it."""
    if alpha[row, column] > 0:
        through = 1 - alpha[row, column]
        gain[row, column, 0] *= through
        for c in range(3):
            add[row, column, c] = through * add[row, column, c] + light[row, column, c]


@run_on_either(_cover_pixel)
@numba.njit(**LAW)
def _cover_where(alpha, light, gain, add):  # type: ignore[no-untyped-def]
    for row in range(alpha.shape[0]):
        for column in range(alpha.shape[1]):
            _cover_pixel(row, column, alpha, light, gain, add)


@numba.njit(**INLINED)
def _copy_pixel(row, column, road, normal, out):  # type: ignore[no-untyped-def]
    if road[row, column]:
        for c in range(3):
            out[row, column, c] = normal[row, column, c]


@run_on_either(_copy_pixel)
@numba.njit(**LAW)
def _copy_where(road, normal, out):  # type: ignore[no-untyped-def]
    for row in range(road.shape[0]):
        for column in range(road.shape[1]):
            _copy_pixel(row, column, road, normal, out)


@numba.njit(**INLINED)
def _normalise_pixel(row, column, road, normal, out):  # type: ignore[no-untyped-def]
    if road[row, column]:
        x, y, z = normal[row, column, 0], normal[row, column, 1], normal[row, column, 2]
        length = sqrt(x * x + y * y + z * z)
        out[row, column, 0], out[row, column, 1], out[row, column, 2] = x / length, y / length, z / length


@run_on_either(_normalise_pixel)
@numba.njit(**LAW)
def _normalise_where(road, normal, out):  # type: ignore[no-untyped-def]
    for row in range(road.shape[0]):
        for column in range(road.shape[1]):
            _normalise_pixel(row, column, road, normal, out)
