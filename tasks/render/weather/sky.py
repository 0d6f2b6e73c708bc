"""The overcast sky and the light under it.

Clear-weather pictures carry the light they were made in. What they say about its strength is read off the
road, whose reflectance is known well enough: the radiance of a white surface lying in it. Under cloud this
light loses its sun, keeps a share of its strength, and comes from the whole sky.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.coverage_field import FieldParameters, height_field

LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
"""Linear sRGB to luminance (IEC 61966-2-1)."""


@dataclass(frozen=True, kw_only=True)
class SkyParameters:
    """How cloud changes the light.

    Parameters
    ----------
    cloud_transmittance : light under full cloud by light under clear sky, where hardly anything falls [1]
    rain_cloud_transmittance : the same under the thick cloud of heavy precipitation [1]
    thickening_mm_h : rate over which the cloud grows from the one to the other [mm/h]
    tint : colour of daylight under cloud by that of clear daylight, linear red, green, blue [1]
    saturation : share of the clear picture's colour saturation that is left [1]
    zenith_gradient : zenith by horizon radiance of the overcast sky, less 1 [1]
    cloud_base_m : height of the cloud, below which precipitation scatters the gradient away [m]
    cloud_contrast : relative variation of the cloud's radiance [1]
    cloud_size_m : longest wave of that variation [m]
    sky_view : share of the upper hemisphere that is open sky in a street [1]
    asphalt_albedo : reflectance of dry road, from which the light is read [1]
    shadow_kept : power to which large light and shade on the road are left [1]
    far_field_m : distance at which the environment's far field is seen through the air [m]
    eye_height_m : height over the ground from which what lies below the horizon is seen through the air [m]
    """

    cloud_transmittance: float
    rain_cloud_transmittance: float
    thickening_mm_h: float
    tint: tuple[float, float, float]
    saturation: float
    zenith_gradient: float
    cloud_base_m: float
    cloud_contrast: float
    cloud_size_m: float
    sky_view: float
    asphalt_albedo: float
    shadow_kept: float
    far_field_m: float
    eye_height_m: float


@dataclass(frozen=True, kw_only=True)
class SkyLight:
    """The light of one clip.

    Parameters
    ----------
    clear_white : float64 [3] radiance, in clear weather, of a white surface lying on the road [1]
    relight : float64 [3, 3] clear radiance to radiance under cloud [1]
    white : float64 [3] radiance of that white surface under cloud [1]
    gradient : zenith by horizon radiance of the sky, less 1, as the precipitation leaves it [1]
    zenith : float64 [3] radiance of the zenith [1]
    airlight : float64 [3] radiance of air without end: the horizon [1]
    ground : float64 [3] mean radiance of the ground [1]
    """

    clear_white: NDArray[np.float64]
    relight: NDArray[np.float64]
    white: NDArray[np.float64]
    gradient: float
    zenith: NDArray[np.float64]
    airlight: NDArray[np.float64]
    ground: NDArray[np.float64]


def cloud_transmittance(rate_mm_h: float, parameters: SkyParameters) -> float:
    """Light under the cloud by light under a clear sky: the harder it falls, the thicker the cloud.

    Parameters
    ----------
    rate_mm_h : water-equivalent precipitation rate [mm/h]
    parameters : how cloud changes the light

    Returns
    -------
    float
        Transmittance [1].
    """
    p = parameters
    thin = float(np.exp(-rate_mm_h / p.thickening_mm_h))
    return p.rain_cloud_transmittance + (p.cloud_transmittance - p.rain_cloud_transmittance) * thin


def sky_light(
    clear_white: NDArray[np.floating],
    level: float,
    extinction: float,
    ground_albedo: float,
    parameters: SkyParameters,
) -> SkyLight:
    """The light under precipitating cloud.

    The sky is the overcast sky of Moon & Spencer (1942, Trans. Illum. Eng. Soc. 37), radiance proportional to
    1 + b sin(elevation), with b reduced by the precipitation between cloud and ground, and as bright as it must
    be for the irradiance pi L (1 + 2 b / 3) / (1 + b) that the white surface shows.

    Parameters
    ----------
    clear_white : [3] radiance, in clear weather, of a white surface lying on the road [1]
    level : exposed light under cloud by exposed light in clear weather [1]
    extinction : extinction coefficient of the air [m-1]
    ground_albedo : mean reflectance of the ground: wet asphalt, or snow [1]
    parameters : how cloud changes the light

    Returns
    -------
    SkyLight
    """
    p = parameters
    grey = np.outer(np.ones(3), LUMINANCE)
    relight = level * np.diag(p.tint) @ (p.saturation * np.eye(3) + (1 - p.saturation) * grey)
    # light under cloud has no colour but the tint
    white = level * np.array(p.tint) * float(LUMINANCE @ clear_white)
    b = p.zenith_gradient * float(np.exp(-extinction * p.cloud_base_m))
    zenith = white * (1 + b) / (1 + 2 * b / 3)
    return SkyLight(
        clear_white=np.asarray(clear_white, dtype=np.float64),
        relight=relight,
        white=white,
        gradient=b,
        zenith=zenith,
        airlight=zenith / (1 + b),
        ground=ground_albedo * white,
    )


def light_from(sky: SkyLight, up: NDArray[np.floating], parameters: SkyParameters) -> NDArray[np.float64]:
    """Mean radiance of the hemisphere about a direction, sky above and ground below.

    Parameters
    ----------
    sky : the light
    up : [...] vertical component of the unit direction [1]
    parameters : how cloud changes the light

    Returns
    -------
    float64 [..., 3] mean radiance [1]
    """
    above = (1 + np.asarray(up, dtype=np.float64)[..., None]) / 2
    return above * parameters.sky_view * sky.white + (1 - above * parameters.sky_view) * sky.ground


def overcast_environment(
    environment: NDArray[np.floating],
    sky: SkyLight,
    extinction: float,
    parameters: SkyParameters,
    seed: int,
    snow: float = 0.0,
) -> NDArray[np.float32]:
    """The environment under precipitating cloud: new sky, and the far field as the air lets it through.

    Below the horizon the environment is ground, and as near as the eye's height over it says.

    Parameters
    ----------
    environment : [H, W, 3] clear environment, equirectangular, zenith first, +x in the middle column [1]
    sky : the light
    extinction : extinction coefficient of the air [m-1]
    parameters : how cloud changes the light
    seed : visual seed of the clip [1]
    snow : share of the ground that snow covers [1]

    Returns
    -------
    float32 [H, W, 3] linear light [1]
    """
    p = parameters
    height = len(environment)
    elevation = pi / 2 - (np.arange(height) + 0.5) / height * pi
    far = np.asarray(environment, dtype=np.float32)
    distance = np.minimum(p.far_field_m, p.eye_height_m / np.maximum(np.sin(-elevation), 1e-9))
    air = np.exp(-extinction * distance).astype(np.float32)[:, None, None]
    # three by three by hand: a BLAS rounds as its processor likes
    relit = [sum(np.float32(row[c]) * far[..., c] for c in range(3)) for row in sky.relight]
    covered = np.where(elevation < 0, np.float32(snow), np.float32(0))[:, None, None]
    ground = (1 - covered) * np.stack(relit, axis=-1) + covered * sky.ground.astype(np.float32)
    out = air * ground + (1 - air) * sky.airlight.astype(np.float32)
    above = elevation > 0
    cloud = _cloud(elevation[above], environment.shape[1], sky, extinction, p, seed)
    luminance = sum(np.float32(weight) * far[above, :, c] for c, weight in enumerate(LUMINANCE))
    open_sky = _sky_share(np.asarray(luminance), elevation[above])[..., None]
    out[above] += open_sky * (cloud - out[above])
    return out


def _cloud(
    elevation: NDArray[np.float64], width: int, sky: SkyLight, extinction: float, p: SkyParameters, seed: int
) -> NDArray[np.float32]:
    """Radiance of the overcast sky on rows of elevations, with a faint pattern.

    The cloud is a ceiling: its pattern shrinks towards the horizon, and the air hides it there.
    """
    azimuth = pi - (np.arange(width) + 0.5) / width * 2 * pi
    up = np.sin(elevation)
    slant = p.cloud_base_m / np.maximum(up, 0.03)
    away = (slant * np.cos(elevation))[:, None]
    waves = FieldParameters(coarsest_m=p.cloud_size_m, octaves=4, roughness=0.6)
    footprint = (slant * (elevation[0] - elevation[1]) / np.maximum(up, 0.03))[:, None]
    pattern = height_field(away * np.cos(azimuth), away * np.sin(azimuth), waves, seed, "cloud", footprint)
    seen = (p.cloud_contrast * np.exp(-extinction * slant)).astype(np.float32)
    profile = (sky.airlight * (1 + sky.gradient * up[:, None])).astype(np.float32)
    return profile[:, None, :] * (1 + seen[:, None] * np.clip(pattern, -2, 2))[..., None]


def _sky_share(luminance: NDArray[np.float32], elevation: NDArray[np.float64]) -> NDArray[np.float32]:
    """Which part of a clear upper hemisphere is sky: what is high up, or nearly as bright as the sky above it."""
    ring = (elevation > 0.35) & (elevation < 1.05)
    typical = np.median(luminance[ring])
    bright = np.clip((luminance / max(float(typical), 1e-6) - 0.35) / 0.35, 0, 1)
    high = np.clip((elevation - 0.6) / 0.3, 0, 1)[:, None]
    return np.maximum(bright, high).astype(np.float32)
