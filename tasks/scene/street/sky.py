"""The panorama around the street: sky, sun, clouds and far ridges."""

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.light import sun_direction
from tasks.scene.street.noise import fractal_noise, named_generator

Floats = NDArray[np.float64]

_ROWS = 1024
_ZENITH, _HORIZON = np.array([0.10, 0.225, 0.52]), np.array([0.56, 0.69, 0.84])
_CLOUD_LIGHT, _CLOUD_SHADE = np.array([1.05, 1.02, 0.98]), np.array([0.50, 0.55, 0.63])
_GROUND = np.array([0.16, 0.155, 0.145])
_GLOW = np.array([1.0, 0.9, 0.72])
_SUN_RADIUS_DEG = 0.6
_RIDGES = ((0.030, 0.9, np.array([0.19, 0.22, 0.25])), (0.018, 0.4, np.array([0.115, 0.135, 0.13])))
"""Mean height [rad], longest wave by the distance and colour of each ridge of far trees, dimmer than the sky [1]."""
_CLOUD_BASE, _CLOUD_WAVE = 1.0, 0.8
"""Height of the cloud layer and length of its longest wave, in units of that height [1]."""


def draw_panorama(layout: StreetLayout, seed: int) -> NDArray[np.float32]:
    """Draw the equirectangular picture in linear light, as in `Scene.environment`.

    Parameters
    ----------
    layout : direction of the sun
    seed : the street's seed [1]

    Returns
    -------
    float32 [1024, 2048, 3] [1]
    """
    elevation = np.pi / 2 - (np.arange(_ROWS) + 0.5) / _ROWS * np.pi
    azimuth = np.pi - (np.arange(2 * _ROWS) + 0.5) / _ROWS * np.pi
    upper = elevation > 0
    picture = np.empty((_ROWS, 2 * _ROWS, 3), dtype=np.float32)
    picture[upper] = _sky_radiance(layout, seed, elevation[upper, None], azimuth[None, :])
    haze = np.exp(elevation[~upper] / 0.05)[:, None, None]
    picture[~upper] = _GROUND * (1 - haze) + _RIDGES[-1][2] * haze
    return picture


def _sky_radiance(layout: StreetLayout, seed: int, elevation: Floats, azimuth: Floats) -> Floats:
    up, flat = np.sin(elevation), np.cos(elevation)
    sun = sun_direction(layout)
    to_sun = flat * (sun[0] * np.cos(azimuth) + sun[1] * np.sin(azimuth)) + up * sun[2]
    clear = _HORIZON + (_ZENITH - _HORIZON) * (1 - np.exp(-3.2 * up))[..., None]
    off = np.degrees(np.arccos(np.clip(to_sun, -1, 1)))[..., None]
    clear = clear + _GLOW * (0.9 * np.exp(-off / 5) + 0.22 * np.exp(-off / 24))
    light, cover = _draw_clouds(layout, seed, up, flat, azimuth)
    cloud = _CLOUD_SHADE + (_CLOUD_LIGHT - _CLOUD_SHADE) * light[..., None] + 0.5 * _GLOW * np.exp(-off / 12)
    veiled = cover * np.clip((up - 0.02) / 0.10, 0, 1)
    sky = clear * (1 - veiled[..., None]) + cloud * veiled[..., None]
    disc = np.clip((_SUN_RADIUS_DEG - off) / 0.15 + 0.5, 0, 1)
    sky = sky * (1 - disc) + 30 * _GLOW * disc
    return _add_skyline(seed, sky, elevation, azimuth)


def _draw_clouds(
    layout: StreetLayout, seed: int, up: Floats, flat: Floats, azimuth: Floats
) -> tuple[Floats, Floats]:
    """Return the brightness of the clouds (0 shade, 1 sun) and the share of sky that they cover, per direction."""
    slant = _CLOUD_BASE / (up + 0.10)
    x, y = slant * flat * np.cos(azimuth), slant * flat * np.sin(azimuth)
    sun = sun_direction(layout)
    field = fractal_noise(named_generator(seed, "clouds"), x, y, _CLOUD_WAVE, 5)
    towards = fractal_noise(
        named_generator(seed, "clouds"), x + 0.10 * sun[0], y + 0.10 * sun[1], _CLOUD_WAVE, 5
    )
    # the shadows in the street are sharp: no cloud covers the sun
    away = np.hypot(x - sun[0] / (sun[2] + 0.10), y - sun[1] / (sun[2] + 0.10))
    field = field - 2.0 * np.exp(-((away / 0.6) ** 2))
    cover = np.clip((field - 0.75) / 0.8, 0, 1)
    cover = cover * cover * (3 - 2 * cover)
    light = np.clip(0.75 + 0.9 * (field - towards) - 0.22 * np.maximum(field - 0.9, 0), 0, 1)
    return light, 0.92 * cover


def _add_skyline(seed: int, sky: Floats, elevation: Floats, azimuth: Floats) -> Floats:
    """Add ridges of far trees, paler with distance."""
    x, y = np.cos(azimuth[0]), np.sin(azimuth[0])
    for number, (height, wave, colour) in enumerate(_RIDGES):
        rise = fractal_noise(named_generator(seed, f"ridge {number}"), x, y, wave, 3)
        crowns = fractal_noise(named_generator(seed, f"crowns {number}"), x, y, 0.03, 3)
        top = height * np.maximum(1 + 0.35 * rise + 0.10 * crowns, 0.1)
        cover = np.clip((top - elevation) / 0.002, 0, 1)[..., None]
        sky = sky * (1 - cover) + colour * cover
    return sky
