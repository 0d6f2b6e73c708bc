"""Radiance of the sky in every direction: its gradient, the glow about the sun, and cloud.

Cloud is a ceiling, as high as one unit of length: its waves shrink towards the horizon, where the air hides them.
Scattered cloud is what of a field of waves lies above a level; it is brighter where the field falls towards the sun.
Closed cloud is thinner and thicker as the field is.
"""

from dataclasses import dataclass
from math import acos, cos, exp, pi, sin, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.composition import LUMINANCE
from tasks.render.weather.coverage_field import sum_waves
from tasks.render.weather.random_streams import stream_key, unit_number
from tasks.render.weather.skies import Daylight

OCTAVES = np.int64(6)
LEAST_UP = 0.06
"""Sine of the height that the ceiling does not go below: the earth is round [1]."""


@dataclass(frozen=True, kw_only=True)
class CloudParameters:
    """How sky and cloud look.

    Parameters
    ----------
    zenith, horizon : radiance of the clear sky where the street's own sun stands, red, green, blue [1]
    contrast : standard deviation of the logarithm of closed cloud's radiance [1]
    wave : longest wave of the field by the height of the cloud [1]
    roughness : amplitude of a wave of the field by that of the one twice as long [1]
    edge : rise of the field, in its standard deviations, over which scattered cloud closes [1]
    sunlit, shaded : radiance of scattered cloud by that of a white surface facing the sun, and by the sky's light [1]
    glow : radiance of the sky beside the sun by that of a white surface facing it [1]
    glow_deg : angle to the sun in which the glow falls to 1/e [deg]
    """

    zenith: tuple[float, float, float]
    horizon: tuple[float, float, float]
    contrast: float
    wave: float
    roughness: float
    edge: float
    sunlit: float
    shaded: float
    glow: float
    glow_deg: float


def draw_sunny_sky(
    light: Daylight, p: CloudParameters, seed: int, elevation: NDArray[np.float64], width: int
) -> NDArray[np.float32]:
    """Return the radiance of a sky with a sun, on rows of elevations and all around.

    Parameters
    ----------
    light : of the clip
    p : how sky and cloud look
    seed : visual seed of the clip [1]
    elevation : float64 [h] of the rows, above 0 [rad]
    width : number of columns, from +180 to -180 degrees [1]

    Returns
    -------
    float32 [h, width, 3] [1]
    """
    out = np.empty((len(elevation), width, 3), dtype=np.float32)
    sun, sky, _ = light.colours
    zenith, horizon = light.skylight * np.array(p.zenith), light.skylight * np.array(p.horizon)
    # haze is white, and as bright as the light that it scatters
    hazy = 1 - light.kind.sun_share
    white = float(LUMINANCE @ (zenith + horizon)) / 2 + 0.6 * hazy * float(LUMINANCE @ sky)
    milk = np.clip(1.5 * hazy, 0, 0.9)
    chroma = 0.6 + 0.4 * (sun + sky) / float(LUMINANCE @ (sun + sky))
    zenith, horizon = (one + milk * (white * chroma - one) for one in (zenith, horizon))
    cover = light.kind.cloud_cover
    level = (
        _quantile(1 - np.clip(cover * (0.5 + unit_number(seed, "cloud cover")), 0, 0.95)) if cover else 9.0
    )
    sharp = 1 / np.sqrt(1 + 60 * hazy)
    _fill(
        elevation, pi - (np.arange(width) + 0.5) / width * 2 * pi, zenith, horizon, light.to_sun, sun,
        p.glow * (1 + 2 * hazy), np.radians(p.glow_deg), sharp, level, p.edge,
        p.sunlit * sun + p.shaded * sky, p.shaded * sky, p.wave * (0.6 + 0.8 * unit_number(seed, "cloud size")),
        p.roughness, np.uint64(stream_key(seed, "cloud")), out,
    )  # fmt: skip
    return out


def draw_closed_sky(
    airlight: NDArray[np.float64],
    gradient: float,
    fade: float,
    p: CloudParameters,
    seed: int,
    elevation: NDArray[np.float64],
    width: int,
) -> NDArray[np.float32]:
    """Return the radiance of closed cloud, on rows of elevations and all around.

    Parameters
    ----------
    airlight : [3] radiance at the horizon [1]
    gradient : zenith by horizon radiance, less 1 [1]
    fade : optical depth of the air over the height of the cloud [1]
    p, seed, elevation, width : see `draw_sunny_sky`

    Returns
    -------
    float32 [h, width, 3] [1]
    """
    out = np.empty((len(elevation), width, 3), dtype=np.float32)
    contrast = p.contrast * (0.5 + unit_number(seed, "cloud contrast"))
    _close(
        elevation, pi - (np.arange(width) + 0.5) / width * 2 * pi, airlight, gradient, fade, contrast,
        p.wave * (0.6 + 0.8 * unit_number(seed, "cloud size")), p.roughness, np.uint64(stream_key(seed, "cloud")), out,
    )  # fmt: skip
    return out


def _quantile(share: float) -> float:
    """Return the value below which a normal number lies with a chance (logistic approximation) [1]."""
    return float(np.log(share / (1 - share)) / 1.702)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _fill(  # type: ignore[no-untyped-def]
    elevation, azimuth, zenith, horizon, to_sun, sun, glow, glow_width, sharp, level, edge, lit, shade, wave,
    roughness, key, out,
):  # fmt: skip
    low = exp(-to_sun[2] / 0.15)
    flat_sun = sqrt(max(1 - to_sun[2] * to_sun[2], 1e-9))
    step = abs(elevation[0] - elevation[-1]) / max(len(elevation) - 1, 1)
    width = len(azimuth)
    places, field, toward = np.empty((2, width)), np.empty(width), np.empty(width)
    for i in range(len(elevation)):
        up, flat = sin(elevation[i]), cos(elevation[i])
        gradient = 1 - exp(-3.2 * up)
        slant = 1 / (up + LEAST_UP)
        seen = min(up / 0.08, 1.0)
        footprint = np.full(width, slant * slant * step)
        if level < 5:
            for values, ahead in ((field, 0.0), (toward, 0.12)):
                for j in range(width):
                    places[0, j] = slant * flat * cos(azimuth[j]) + ahead * to_sun[0]
                    places[1, j] = slant * flat * sin(azimuth[j]) + ahead * to_sun[1]
                sum_waves(width, places, footprint, wave, OCTAVES, roughness, key, values)
        for j in range(width):
            x, y = cos(azimuth[j]), sin(azimuth[j])
            along = x * to_sun[0] + y * to_sun[1]
            cosine = min(max(flat * along + up * to_sun[2], -1.0), 1.0)
            off = acos(cosine)
            bright = glow * (exp(-off / glow_width) + 0.25 * exp(-off / (5 * glow_width)))
            # a low sun colours the air along the horizon, below it more than elsewhere
            band = 0.5 * low * exp(-up / 0.12) * (0.35 + 0.65 * max(along / flat_sun, 0.0))
            disc = 30 * sharp * min(max((0.0105 / sharp - off) / 0.0026 + 0.5, 0.0), 1.0)
            cover, lightness = 0.0, 0.0
            if level < 5:
                cover = min(max((field[j] - level) / edge, 0.0), 1.0)
                cover = cover * cover * (3 - 2 * cover) * seen
                thick = max(field[j] - level - edge, 0.0)
                lightness = min(
                    max(0.6 + 0.8 * (field[j] - toward[j]) - 0.3 * thick + 0.5 * bright, 0.0), 1.3
                )
            for c in range(3):
                clear = horizon[c] + (zenith[c] - horizon[c]) * gradient + sun[c] * (bright + band)
                cloud = shade[c] + (lit[c] - shade[c]) * lightness
                value = clear + cover * (cloud - clear)
                out[i, j, c] = value + (1 - cover) * disc * sun[c]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _close(elevation, azimuth, horizon, rise, fade, contrast, wave, roughness, key, out):  # type: ignore[no-untyped-def]
    step = abs(elevation[0] - elevation[-1]) / max(len(elevation) - 1, 1)
    width = len(azimuth)
    places, field = np.empty((2, width)), np.empty(width)
    for i in range(len(elevation)):
        up, flat = sin(elevation[i]), cos(elevation[i])
        slant = 1 / (up + LEAST_UP)
        strength = contrast * exp(-fade * slant)
        mean = (1 + rise * up) * exp(-0.5 * strength * strength)
        footprint = np.full(width, slant * slant * step)
        for j in range(width):
            # rolls: longer across the wind than along it
            places[0, j] = 0.6 * (slant * flat * cos(azimuth[j]))
            places[1, j] = 1.3 * (slant * flat * sin(azimuth[j]))
        sum_waves(width, places, footprint, wave, OCTAVES, roughness, key, field)
        for j in range(width):
            bright = mean * exp(strength * min(max(field[j], -2.5), 2.5))
            for c in range(3):
                out[i, j, c] = horizon[c] * bright
