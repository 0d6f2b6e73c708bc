"""The sky over a clip and the light under it.

A scene carries the light it was made in. How strong that is follows from the light on its road: where the scene does
not know it, the road's reflectance, which is known well enough, tells the radiance of a white surface lying there.
Under cloud this light loses its sun, keeps a share of its strength, and comes from the whole sky. The camera opens by
part of what the light loses, once for the clip, as one that meters road and street does: a bright sky may clip.
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from tasks.render.composition import LUMINANCE
from tasks.render.weather.clouds import CloudParameters
from tasks.render.weather.random_streams import unit_number
from tasks.render.weather.skies import Skies, SunParameters


@dataclass(frozen=True, kw_only=True)
class SkyParameters:
    """Light of the sky, and how cloud changes it.

    Parameters
    ----------
    skies : the kinds of sky
    sun : how sunlight comes through the air
    clouds : how sky and cloud look
    exposure_compensation : share of the light's loss, in stops, by which the camera opens [1]
    least_vividness, largest_vividness : range of the saturation that a clip's camera gives, by that of the light [1]
    brightest_ground : radiance of the ground beyond which the camera opens no further [1]
    exposure_spread_ev : largest error of the camera's metering, which a clip draws [EV]
    white_balance_spread : largest error of its red gain, which a clip draws; that of blue is its opposite [1]
    cloud_transmittance : light under full cloud by light under clear sky, where hardly anything falls [1]
    rain_cloud_transmittance : the same under the thick cloud of heavy precipitation [1]
    thickening_mm_h : rate over which the cloud grows from the one to the other [mm/h]
    tint : colour of daylight under cloud by that of clear daylight, linear red, green, blue [1]
    saturation : share of the clear picture's colour saturation that is left [1]
    zenith_gradient : zenith by horizon radiance of the overcast sky, less 1, on average [1]
    gradient_spread : largest relative deviation of a clip's gradient from it [1]
    cloud_base_m : height of the cloud, below which precipitation scatters the gradient away [m]
    sky_view : share of the upper hemisphere that is open sky in a street [1]
    asphalt_albedo : reflectance of dry road, from which the light is read [1]
    shadow_kept : power to which light and shade are left on the ground of a scene that does not know its light [1]
    far_field_m : distance at which the environment's far field is seen through the air [m]
    eye_height_m : height over the ground from which what lies below the horizon is seen through the air [m]
    """

    skies: Skies
    sun: SunParameters
    clouds: CloudParameters
    exposure_compensation: float
    brightest_ground: float
    exposure_spread_ev: float
    white_balance_spread: float
    least_vividness: float
    largest_vividness: float
    cloud_transmittance: float
    rain_cloud_transmittance: float
    thickening_mm_h: float
    tint: tuple[float, float, float]
    saturation: float
    zenith_gradient: float
    gradient_spread: float
    cloud_base_m: float
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
    *,
    true_colours: bool = False,
    zenith_gradient: float | None = None,
) -> SkyLight:
    """Return the light under closed cloud.

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
    true_colours : the scene's colours are those of its surfaces, without those of sun and shade
    zenith_gradient : of the clip; None for the mean one [1]

    Returns
    -------
    SkyLight
    """
    p = parameters
    kept = 1.0 if true_colours else p.saturation
    grey = np.outer(np.ones(3), LUMINANCE)
    relight = level * np.diag(p.tint) @ (kept * np.eye(3) + (1 - kept) * grey)
    # light under cloud has no colour but the tint
    white = level * np.array(p.tint) * float(LUMINANCE @ clear_white)
    rise = p.zenith_gradient if zenith_gradient is None else zenith_gradient
    b = rise * float(np.exp(-extinction * p.cloud_base_m))
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


def sunny_light(
    white: NDArray[np.floating],
    level: float,
    rows: NDArray[np.float32],
    ground_albedo: float,
) -> SkyLight:
    """Return the light under a sky with a sun.

    Parameters
    ----------
    white : [3] radiance of a white surface lying on the sunny road, as bright as in the scene's own light [1]
    level : exposed light by that of the scene's own light [1]
    rows : float32 [h, w, 3] exposed radiance of the sky, from the zenith to the horizon [1]
    ground_albedo : mean reflectance of the ground [1]
    """
    zenith, horizon = (rows[k].mean(axis=0).astype(np.float64) for k in (0, -1))
    return SkyLight(
        clear_white=np.asarray(white, dtype=np.float64),
        relight=level * np.eye(3),
        white=level * np.asarray(white, dtype=np.float64),
        gradient=float(LUMINANCE @ zenith / (LUMINANCE @ horizon)) - 1,
        zenith=zenith,
        airlight=horizon,
        ground=ground_albedo * level * np.asarray(white, dtype=np.float64),
    )


def expose_light(strength: float, ground: float, parameters: SkyParameters, seed: int) -> float:
    """Return how much further the camera opens under a light than in the scene's own [1].

    Parameters
    ----------
    strength : light on the road by that of the scene's own light [1]
    ground : radiance of the brightest ground under it, before the camera opens; snow, where some lies [1]
    parameters : share of the loss that the camera makes up for, and the error of its metering
    seed : visual seed of the clip [1]
    """
    error = parameters.exposure_spread_ev * (2 * unit_number(seed, "exposure") - 1)
    opened = strength**-parameters.exposure_compensation * 2**error
    return float(min(opened, parameters.brightest_ground / ground))


def draw_camera_colours(parameters: SkyParameters, seed: int) -> NDArray[np.float64]:
    """Return how a clip's camera renders colours: linear light to linear light, float64 [3, 3] [1].

    Parameters
    ----------
    parameters : largest error of its white balance, and its vividness
    seed : visual seed of the clip [1]
    """
    p = parameters
    warmer = p.white_balance_spread * (2 * unit_number(seed, "white balance") - 1)
    vivid = p.least_vividness + (p.largest_vividness - p.least_vividness) * unit_number(seed, "vividness")
    grey = np.outer(np.ones(3), LUMINANCE)
    return np.array((1 + warmer, 1.0, 1 - warmer))[:, None] * (vivid * np.eye(3) + (1 - vivid) * grey)


def see_in_colours(sky: SkyLight, colours: NDArray[np.float64]) -> SkyLight:
    """Return the light as a camera renders it.

    Parameters
    ----------
    sky : the light
    colours : of `draw_camera_colours`
    """
    seen = {
        name: np.maximum(colours @ getattr(sky, name), 0)
        for name in ("white", "zenith", "airlight", "ground")
    }
    return replace(sky, relight=colours @ sky.relight, **seen)


def replace_sky(
    environment: NDArray[np.floating],
    rows: NDArray[np.float32],
    sky: SkyLight,
    extinction: float,
    parameters: SkyParameters,
    snow: float = 0.0,
) -> NDArray[np.float32]:
    """Return the environment in another light: its sky replaced, and the far field as the air lets it through.

    Below the horizon the environment is ground, and as near as the eye's height over it says.

    Parameters
    ----------
    environment : [H, W, 3] clear environment, equirectangular, zenith first, +x in the middle column [1]
    rows : float32 [h, W, 3] radiance of the new sky on the rows above the horizon [1]
    sky : the light
    extinction : extinction coefficient of the air [m-1]
    parameters : distance of the far field
    snow : share of the ground that snow covers [1]

    Returns
    -------
    float32 [H, W, 3] linear light [1]
    """
    p = parameters
    elevation = row_elevations(len(environment))
    far = np.asarray(environment, dtype=np.float32)
    distance = np.minimum(p.far_field_m, p.eye_height_m / np.maximum(np.sin(-elevation), 1e-9))
    air = np.exp(-extinction * distance).astype(np.float32)[:, None, None]
    # three by three by hand: a BLAS rounds as its processor likes
    relit = [sum(np.float32(row[c]) * far[..., c] for c in range(3)) for row in sky.relight]
    covered = np.where(elevation < 0, np.float32(snow), np.float32(0))[:, None, None]
    ground = (1 - covered) * np.stack(relit, axis=-1) + covered * sky.ground.astype(np.float32)
    out = air * ground + (1 - air) * sky.airlight.astype(np.float32)
    above = elevation > 0
    luminance = sum(np.float32(weight) * far[above, :, c] for c, weight in enumerate(LUMINANCE))
    open_sky = _sky_share(np.asarray(luminance), elevation[above])[..., None]
    out[above] += open_sky * (rows - out[above])
    return out


def row_elevations(height: int) -> NDArray[np.float64]:
    """Return the elevation of each row of a panorama [rad].

    Parameters
    ----------
    height : number of rows [1]
    """
    return pi / 2 - (np.arange(height) + 0.5) / height * pi


def _sky_share(luminance: NDArray[np.float32], elevation: NDArray[np.float64]) -> NDArray[np.float32]:
    """Which part of a clear upper hemisphere is sky: what is high up, or nearly as bright as the sky above it."""
    ring = (elevation > 0.35) & (elevation < 1.05)
    typical = np.median(luminance[ring])
    bright = np.clip((luminance / max(float(typical), 1e-6) - 0.35) / 0.35, 0, 1)
    high = np.clip((elevation - 0.6) / 0.3, 0, 1)[:, None]
    return np.maximum(bright, high).astype(np.float32)
