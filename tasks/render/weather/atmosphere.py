"""Air between the eye and the scene: light under cloud, and Koschmieder's veil over distance."""

from dataclasses import dataclass
from math import exp, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, new_picture, run_on_either
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.weather.falling.precipitation import NearField, Population, drawn_optical_depth
from tasks.render.weather.layer import Layer
from tasks.render.weather.sky import SkyLight

CONTRAST_THRESHOLD = 0.05
"""Contrast at the limit of the meteorological optical range (WMO-No. 8, 2018, part I, chapter 9)."""

TABLE_STEPS = 64


@dataclass(frozen=True, kw_only=True)
class Air:
    """Optical depth along any line of sight, without the particles that are drawn one by one.

    Parameters
    ----------
    extinction : extinction coefficient of precipitation and haze [m-1]
    table_m : distance that the table spans [m]
    drawn : float64 [T + 1] optical depth of the drawn particles at even steps of that distance [1]
    """

    extinction: float
    table_m: float
    drawn: NDArray[np.float64]


def extinction_of_visual_range(visual_range_m: float) -> float:
    """Return the extinction by Koschmieder's relation (1924), -ln(contrast threshold) / visual range.

    Parameters
    ----------
    visual_range_m : meteorological optical range [m]

    Returns
    -------
    float
        Extinction coefficient [m-1].
    """
    return -float(np.log(CONTRAST_THRESHOLD)) / visual_range_m


def precipitating_air(
    population: Population | None, near: NearField, focal_px: float, haze_visual_range_m: float
) -> Air:
    """Return the air of one clip: the extinction of all precipitation, less that of the particles drawn one by one.

    Parameters
    ----------
    population : the precipitation; None without precipitation
    near : range in which its particles are drawn one by one
    focal_px : focal length of the camera [px]
    haze_visual_range_m : meteorological optical range of the air without precipitation [m]

    Returns
    -------
    Air
    """
    distance = np.linspace(0, near.farthest_m, TABLE_STEPS + 1)
    haze = extinction_of_visual_range(haze_visual_range_m)
    if population is None:
        return Air(extinction=haze, table_m=near.farthest_m, drawn=np.zeros_like(distance))
    return Air(
        extinction=population.extinction + haze,
        table_m=near.farthest_m,
        drawn=drawn_optical_depth(population, near, focal_px, distance),
    )


def optical_depth(air: Air, distance: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the optical depth of the air without its drawn particles.

    Parameters
    ----------
    air : the air
    distance : [...] distance from the camera [m]

    Returns
    -------
    float64 [...] optical depth [1]
    """
    steps = np.linspace(0, air.table_m, len(air.drawn))
    return air.extinction * np.asarray(distance) - np.interp(distance, steps, air.drawn)


def light_layer(
    picture: NDArray[np.float32],
    gbuffer: GBuffer,
    clear_sky: NDArray[np.float32],
    cloudy_sky: NDArray[np.float32],
    sky: SkyLight,
) -> Layer:
    """Return the layer that changes the light of the street to that under cloud and replaces its sky.

    Parameters
    ----------
    picture : float32 [H, W, 3] clear picture, sky included [1]
    gbuffer : the rasterisation it was made from
    clear_sky, cloudy_sky : float32 [H, W, 3] the pixels' sky in clear weather, and under cloud [1]
    sky : the light under cloud

    Returns
    -------
    Layer
    """
    lit = new_picture(picture, 3)
    _relight(picture, gbuffer.alpha, clear_sky, cloudy_sky, sky.relight.astype(np.float32), lit)
    return Layer(name="light", gain=np.zeros((1, 1, 1), dtype=np.float32), add=lit)


def air_layer(
    gbuffer: GBuffer, cloudy_sky: NDArray[np.float32], air: Air, sky: SkyLight, rays: NDArray[np.float32]
) -> Layer:
    """Return the veil of the air over the street; the sky contains the veil already.

    Parameters
    ----------
    gbuffer : the rasterisation
    cloudy_sky : float32 [H, W, 3] the pixels' sky under cloud [1]
    air : the air
    sky : the light under cloud
    rays : float32 [H, W, 3] world directions of the pixels, of camera z 1 [1]

    Returns
    -------
    Layer
    """
    gain, add = new_picture(gbuffer.depth, 1), new_picture(gbuffer.depth, 3)
    table = air.drawn.astype(np.float32)
    _veil(
        gbuffer.depth, gbuffer.alpha, rays, cloudy_sky, sky.airlight.astype(np.float32),
        np.float32(air.extinction), table, np.float32(TABLE_STEPS / air.table_m), gain, add,
    )  # fmt: skip
    return Layer(name="air", gain=gain, add=add)


@numba.njit(**INLINED)
def _relight_pixel(row, column, picture, alpha, clear, cloudy, relight, lit):  # type: ignore[no-untyped-def]
    zero, one = np.float32(0), np.float32(1)
    left = one - alpha[row, column]
    # where nothing is drawn the picture is the sky's, to the last bit
    own = one if left < one else zero
    red = own * max(picture[row, column, 0] - left * clear[row, column, 0], zero)
    green = own * max(picture[row, column, 1] - left * clear[row, column, 1], zero)
    blue = own * max(picture[row, column, 2] - left * clear[row, column, 2], zero)
    for c in range(3):
        value = relight[c, 0] * red + relight[c, 1] * green + relight[c, 2] * blue
        lit[row, column, c] = value + left * cloudy[row, column, c]


@run_on_either(_relight_pixel)
@numba.njit(**LAW)
def _relight(picture, alpha, clear, cloudy, relight, lit):  # type: ignore[no-untyped-def]
    for row in range(alpha.shape[0]):
        for column in range(alpha.shape[1]):
            _relight_pixel(row, column, picture, alpha, clear, cloudy, relight, lit)


@numba.njit(**INLINED)
def _veil_pixel(  # type: ignore[no-untyped-def]
    row, column, depth, alpha, rays, cloudy, airlight, extinction, drawn, steps_per_m, gain, add
):
    zero, one = np.float32(0), np.float32(1)
    last = len(drawn) - 1
    cover = alpha[row, column]
    if cover == zero:
        gain[row, column, 0] = one
        add[row, column, 0], add[row, column, 1], add[row, column, 2] = zero, zero, zero
        return
    x, y, z = rays[row, column, 0], rays[row, column, 1], rays[row, column, 2]
    distance = depth[row, column] * sqrt(x * x + y * y + z * z)
    place = min(distance * steps_per_m, np.float32(last))
    k = min(int(place), last - 1)
    near = drawn[k] + (place - np.float32(k)) * (drawn[k + 1] - drawn[k])
    through = exp(near - extinction * distance)
    gain[row, column, 0] = through
    for c in range(3):
        light = cover * airlight[c] + (one - cover) * cloudy[row, column, c]
        add[row, column, c] = (one - through) * light


@run_on_either(_veil_pixel)
@numba.njit(**LAW)
def _veil(depth, alpha, rays, cloudy, airlight, extinction, drawn, steps_per_m, gain, add):  # type: ignore[no-untyped-def]
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            _veil_pixel(
                row, column, depth, alpha, rays, cloudy, airlight, extinction, drawn, steps_per_m, gain, add
            )
