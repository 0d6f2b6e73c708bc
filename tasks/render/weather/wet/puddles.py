"""Smooth water on the road: the level of the film against texture and unevenness, at each pixel."""

from dataclasses import dataclass
from math import erf, exp, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, new_picture, run_on_either
from tasks.render.weather.coverage_field import FieldParameters, read_field, sum_waves
from tasks.render.weather.random_streams import stream_key
from tasks.render.weather.wet.road_view import RoadView


@dataclass(frozen=True, kw_only=True)
class RoadWaterParameters:
    """Parameters of a film of water on the road.

    Parameters
    ----------
    wetting_mm : film depth at which 1 - 1/e of the surface is wet [mm]
    texture_spread_mm : standard deviation of the heights of the texture's peaks [mm]
    unevenness_mm : standard deviation of the road's level over metres; water gathers at low places [mm]
    unevenness : waves of that level
    ripple_slope : standard deviation of the slope of standing water and smooth film [1]
    ripple_m : length of those ripples [m]
    impact_slope : standard deviation of the slope that drops of 1 mm/h leave; it grows with the root of the rate [1]
    """

    wetting_mm: float
    texture_spread_mm: float
    unevenness_mm: float
    unevenness: FieldParameters
    ripple_slope: float
    ripple_m: float
    impact_slope: float


def compute_wetness(film_depth_mm: float, parameters: RoadWaterParameters) -> float:
    """Return the share of the road surface that is wet, 0 on a dry road and rising with the film [1].

    Parameters
    ----------
    film_depth_mm : total film depth h_t [mm]
    parameters : parameters of the film

    Returns
    -------
    float
        Share [1].
    """
    return float(_wet_share(film_depth_mm, parameters.wetting_mm))


def compute_struck_slope(rate_mm_h: float, parameters: RoadWaterParameters) -> float:
    """Return the standard deviation of the slope of a smooth film that drops strike [1].

    Rings of drops that fall independently add up in the square, so that the slope grows with the root of the rate.

    Parameters
    ----------
    rate_mm_h : rate of the rain [mm/h]
    parameters : parameters of the film
    """
    return sqrt(parameters.ripple_slope**2 + parameters.impact_slope**2 * rate_mm_h)


@dataclass(frozen=True, kw_only=True)
class WaterSurface:
    """Smooth water on the road pixels of one frame; 0 elsewhere.

    Parameters
    ----------
    wet : float32 [H, W] share of the pixel that is wet [1]
    smooth : float32 [H, W] share of the pixel under smooth water [1]
    normal : float32 [H, W, 3] unit normals of that water where it mirrors, world frame [1]
    cosine : float32 [H, W] cosine of the angle at which the road is seen [1]
    """

    wet: NDArray[np.float32]
    smooth: NDArray[np.float32]
    normal: NDArray[np.float32]
    cosine: NDArray[np.float32]


def water_surface(
    view: RoadView, film_depth_mm: float, texture_depth_mm: float, parameters: RoadWaterParameters, seed: int
) -> WaterSurface:
    """Return the share of smooth water and the normals of its surface.

    A deep film is level, and deeper by as much as the road is low; a thin one flows together and is deeper by as large
    a part of itself. The texture's peaks are normally distributed about the mean texture depth. The smooth share is the
    probability that a peak is below the water; it rises with the film.

    Parameters
    ----------
    view : the road
    film_depth_mm : total film depth h_t, from the bottom of the texture [mm]
    texture_depth_mm : mean texture depth of the pavement, MTD [mm]
    parameters : parameters of the film
    seed : visual seed of the clip [1]

    Returns
    -------
    WaterSurface
    """
    p = parameters
    surface = WaterSurface(
        wet=new_picture(view.depth),
        smooth=new_picture(view.depth),
        normal=new_picture(view.depth, 3),
        cosine=new_picture(view.depth),
    )
    _water(
        view.depth, view.rays, view.normal, view.road, view.mirrors, view.T_world_camera[:3, 3], float(view.K[1, 1]),
        film_depth_mm, p.wetting_mm, texture_depth_mm, p.texture_spread_mm,
        p.unevenness_mm, p.unevenness.coarsest_m, p.unevenness.octaves, p.unevenness.roughness,
        p.ripple_slope, p.ripple_m, np.uint64(stream_key(seed, "puddles")),
        surface.wet, surface.smooth, surface.normal, surface.cosine,
    )  # fmt: skip
    return surface


@numba.njit(**INLINED)
def _place_water(row, column, depth, rays, normal, eye, focal):  # type: ignore[no-untyped-def]
    """World x and y of a road pixel [m], its width on the road [m] and the cosine at which it is seen [1]."""
    z, rx, ry, rz = depth[row, column], rays[row, column, 0], rays[row, column, 1], rays[row, column, 2]
    nx, ny, nz = normal[row, column, 0], normal[row, column, 1], normal[row, column, 2]
    stretch = sqrt(rx * rx + ry * ry + rz * rz)
    facing = max(-(rx * nx + ry * ny + rz * nz) / stretch, 0.01)
    return eye[0] + z * rx, eye[1] + z * ry, z * stretch / (focal * facing), min(facing, 1.0)


@numba.njit(**INLINED)
def _wet_share(depth, wetting):  # type: ignore[no-untyped-def]
    return 1 - exp(-depth / wetting)


@numba.njit(**INLINED)
def _lay_film(row, column, film, uneven, low, wetting, texture, spread, wet, smooth):  # type: ignore[no-untyped-def]
    """Write how much of a pixel the film wets, and how much lies under its smooth surface.

    A road that lies low by ``low`` standard deviations has a film deeper by that, but by no larger part of a thin one.
    """
    depth = film * exp(uneven * low / (film + uneven))
    covered = _wet_share(depth, wetting)
    wet[row, column] = covered
    smooth[row, column] = covered * 0.5 * (1 + erf((depth - texture) / (spread * sqrt(2.0))))


@numba.njit(**INLINED)
def _tilt_water(row, column, normal, slope, along, across, water):  # type: ignore[no-untyped-def]
    wx = normal[row, column, 0] - slope * along
    wy = normal[row, column, 1] - slope * across
    wz = normal[row, column, 2]
    length = sqrt(wx * wx + wy * wy + wz * wz)
    water[row, column, 0] = wx / length
    water[row, column, 1] = wy / length
    water[row, column, 2] = wz / length


RIPPLE_OCTAVES, RIPPLE_ROUGHNESS = np.int64(2), 0.6
_ALONG, _ACROSS = np.uint64(1000), np.uint64(2000)
"""What the keys of the ripples' two slopes have over that of the level."""


@numba.njit(**LAW)
def _water_pixel(  # type: ignore[no-untyped-def]
    row, column, depth, rays, normal, road, mirrors, eye, focal, film, wetting, texture, spread, uneven, coarsest,
    octaves, roughness, ripple_slope, ripple, key, wet, smooth, water, cosine,
):  # fmt: skip
    if not road[row, column]:
        return
    x, y, size, cosine[row, column] = _place_water(row, column, depth, rays, normal, eye, focal)
    low = read_field(x, y, size, coarsest, octaves, roughness, key)
    _lay_film(row, column, film, uneven, low, wetting, texture, spread, wet, smooth)
    if mirrors[row, column]:
        along = read_field(x, y, size, ripple, RIPPLE_OCTAVES, RIPPLE_ROUGHNESS, key + _ALONG)
        across = read_field(x, y, size, ripple, RIPPLE_OCTAVES, RIPPLE_ROUGHNESS, key + _ACROSS)
        _tilt_water(row, column, normal, ripple_slope, along, across, water)


@run_on_either(_water_pixel)
@numba.njit(cache=True, nogil=True, error_model="numpy")
def _water(  # type: ignore[no-untyped-def]
    depth, rays, normal, road, mirrors, eye, focal, film, wetting, texture, spread, uneven, coarsest, octaves,
    roughness, ripple_slope, ripple, key, wet, smooth, water, cosine,
):  # fmt: skip
    """Row after row, the waves of all its road pixels at once."""
    width = road.shape[1]
    columns = np.empty(width, dtype=np.int64)
    places, turned = np.empty((2, width)), np.empty((2, width))
    size, along, across = np.empty(width), np.empty(width), np.empty(width)
    for row in range(road.shape[0]):
        count = np.int64(0)
        for column in range(width):
            if not road[row, column]:
                continue
            places[0, count], places[1, count], size[count], cosine[row, column] = _place_water(
                row, column, depth, rays, normal, eye, focal
            )
            columns[count] = column
            count += 1
        _copy_places(count, places, turned)
        sum_waves(count, turned, size, coarsest, octaves, roughness, key, along)
        mirroring = np.int64(0)
        for i in range(count):
            column = columns[i]
            _lay_film(row, column, film, uneven, along[i], wetting, texture, spread, wet, smooth)
            if mirrors[row, column]:
                places[0, mirroring], places[1, mirroring], size[mirroring] = (
                    places[0, i],
                    places[1, i],
                    size[i],
                )
                columns[mirroring] = column
                mirroring += 1
        for own, out in ((_ALONG, along), (_ACROSS, across)):
            _copy_places(mirroring, places, turned)
            sum_waves(mirroring, turned, size, ripple, RIPPLE_OCTAVES, RIPPLE_ROUGHNESS, key + own, out)
        for i in range(mirroring):
            _tilt_water(row, columns[i], normal, ripple_slope, along[i], across[i], water)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _copy_places(count, places, to):  # type: ignore[no-untyped-def]
    for i in range(count):
        to[0, i], to[1, i] = places[0, i], places[1, i]
