"""Air between the eye and the scene: light under cloud, and Koschmieder's veil over distance."""

from dataclasses import dataclass
from math import sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.environment import sample_panorama
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
    clear_environment: NDArray[np.float32],
    environment: NDArray[np.float32],
    sky: SkyLight,
    rays: NDArray[np.float32],
) -> Layer:
    """Return the layer that changes the light of the street to that under cloud and replaces its sky.

    Parameters
    ----------
    picture : float32 [H, W, 3] clear picture, sky included [1]
    gbuffer : the rasterisation it was made from
    clear_environment, environment : float32 [h, w, 3] environment in clear weather, and under cloud [1]
    sky : the light under cloud
    rays : float32 [H, W, 3] world directions of the pixels, of camera z 1 [1]

    Returns
    -------
    Layer
    """
    lit = np.empty_like(picture)
    _relight(
        picture, gbuffer.alpha, clear_environment, environment, sky.relight.astype(np.float32), rays, lit
    )
    return Layer(name="light", gain=np.zeros((1, 1, 1), dtype=np.float32), add=lit)


def air_layer(
    gbuffer: GBuffer, environment: NDArray[np.float32], air: Air, sky: SkyLight, rays: NDArray[np.float32]
) -> Layer:
    """Return the veil of the air over the street; the sky contains the veil already.

    Parameters
    ----------
    gbuffer : the rasterisation
    environment : float32 [h, w, 3] environment under cloud [1]
    air : the air
    sky : the light under cloud
    rays : float32 [H, W, 3] world directions of the pixels, of camera z 1 [1]

    Returns
    -------
    Layer
    """
    height, width = gbuffer.depth.shape
    gain = np.empty((height, width, 1), dtype=np.float32)
    add = np.empty((height, width, 3), dtype=np.float32)
    table = air.drawn.astype(np.float32)
    _veil(
        gbuffer.depth, gbuffer.alpha, rays, environment, sky.airlight.astype(np.float32),
        np.float32(air.extinction), table, np.float32(TABLE_STEPS / air.table_m), gain, add,
    )  # fmt: skip
    return Layer(name="air", gain=gain, add=add)


OPAQUE = 0.995
"""Alpha from which what shines through of the sky behind is not sampled: under the brightest sky it is
one 8-bit step."""


@numba.njit(cache=True, nogil=True)
def _relight(picture, alpha, clear, cloudy, relight, rays, lit):  # type: ignore[no-untyped-def]
    height, width = alpha.shape
    behind, own = np.zeros(3, dtype=np.float32), np.zeros(3, dtype=np.float32)
    for row in range(height):
        for column in range(width):
            left = np.float32(1) - alpha[row, column]
            open_sky = alpha[row, column] < OPAQUE
            ray = rays[row, column]
            for c in range(3):
                own[c] = picture[row, column, c]
            if open_sky:
                if left < 1:
                    sample_panorama(clear, ray[0], ray[1], ray[2], behind)
                for c in range(3):
                    own[c] = max(own[c] - left * behind[c], np.float32(0)) if left < 1 else np.float32(0)
                sample_panorama(cloudy, ray[0], ray[1], ray[2], behind)
            for c in range(3):
                value = relight[c, 0] * own[0] + relight[c, 1] * own[1] + relight[c, 2] * own[2]
                lit[row, column, c] = value + left * behind[c] if open_sky else value


@numba.njit(cache=True, nogil=True)
def _veil(depth, alpha, rays, cloudy, airlight, extinction, drawn, steps_per_m, gain, add):  # type: ignore[no-untyped-def]
    height, width = depth.shape
    behind = np.zeros(3, dtype=np.float32)
    last = len(drawn) - 1
    for row in range(height):
        for column in range(width):
            cover, ray = alpha[row, column], rays[row, column]
            if cover == 0:
                gain[row, column, 0] = 1
                for c in range(3):
                    add[row, column, c] = 0
                continue
            distance = depth[row, column] * sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2])
            place = min(distance * steps_per_m, np.float32(last))
            k = min(int(place), last - 1)
            near = drawn[k] + (place - k) * (drawn[k + 1] - drawn[k])
            through = np.exp(near - extinction * distance)
            gain[row, column, 0] = through
            for c in range(3):
                add[row, column, c] = (1 - through) * cover * airlight[c]
            if cover < OPAQUE:
                sample_panorama(cloudy, ray[0], ray[1], ray[2], behind)
                for c in range(3):
                    add[row, column, c] += (1 - through) * (1 - cover) * behind[c]
