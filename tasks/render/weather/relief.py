"""The light on a road feature: a surface that turns away from flat gets more or less of the sun and of the sky.

The colours of a scene carry the light on a flat road. Where the road is lifted they are multiplied by the
irradiance at the turned normal over that on the flat; the feature runs across the whole road, so that both
follow from its station. Hidden by the feature itself are the sun, where it is low, and part of the sky.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.composition import LUMINANCE
from tasks.render.road_edit import RoadRelief
from tasks.render.weather.ground_grid import read_between
from tasks.render.weather.scene_light import GroundLight, ground_light, recolour_gaussians
from tasks.render.weather.sky import SkyLight, SkyParameters
from tasks.scene.gaussians import Gaussians

Floats = NDArray[np.float64]

PROFILE_STEP_M = 0.01
"""Stations at which the light is computed; between them it is straight."""
PANORAMA_ROWS = 48
"""Rows to which the panorama is averaged: irradiance is smooth, and this keeps it to a thousandth."""
SUN_OVER_SKY = 8.0
"""Brightness over the middle sky from which a spot of the panorama is the sun; clouds stay below 3 [1]."""
SUN_RADIUS = np.radians(0.267)
"""Angular radius of the sun [rad]."""
LONGEST_SHADOW_M = 20.0
"""Reach over which a feature's shadow on the flat road is followed [m]."""
HIDDEN_HEIGHTS = 20.0
"""Distance, by a hump's height, from which it hides less than a thousandth of the sky [1]."""
WIDEST_ROAD_M = 30.0
"""No road Gaussian of a cross-section lies further from the route [m]."""


@dataclass(frozen=True, kw_only=True)
class ReliefLight:
    """Light of sky, sun and ground on a flat road.

    Parameters
    ----------
    sky : float64 [h, w] luminance of the panorama without the sun, rows from zenith to nadir [1]
    ground : luminance of the ground about the feature [1]
    to_sun : float64 [3] unit vector to the sun, world frame [1]
    sun_share : share of the light on flat sunlit road that comes straight from the sun; 0 without one [1]
    shade : where the sun reaches the road; None without one
    """

    sky: Floats
    ground: float
    to_sun: Floats
    sun_share: float
    shade: GroundLight | None


def sun_in(environment: NDArray[np.floating]) -> Floats | None:
    """Unit vector to the sun of a panorama [3], world frame; None where no spot is so bright.

    Parameters
    ----------
    environment : [H, W, 3] panorama as in `Scene.environment` [1]
    """
    luminance = np.asarray(environment, dtype=np.float64) @ LUMINANCE
    directions, _ = _directions(luminance.shape)
    above = directions[..., 2] > 0
    bright = above & (luminance > SUN_OVER_SKY * np.median(luminance[above]))
    if not bright.any():
        return None
    towards = (luminance[bright, None] * directions[bright]).sum(axis=0)
    return towards / float(np.linalg.norm(towards))


def clear_light(
    gaussians: Gaussians,
    environment: NDArray[np.floating],
    parameters: SkyParameters,
    to_sun: NDArray[np.floating] | None = None,
) -> ReliefLight:
    """The light in clear weather, read off the scene.

    What a road of known reflectance sends back tells the light on it; what the panorama's sky gives, as far as
    the street lets it in, is skylight, and the rest is the sun's, if the scene has one.

    Parameters
    ----------
    gaussians : the clear scene
    environment : [H, W, 3] its panorama [1]
    parameters : reflectance of the road and share of open sky
    to_sun : [3] unit vector to a sun that the panorama does not show; None looks for it there [1]

    Returns
    -------
    ReliefLight
    """
    shade = ground_light(gaussians, SemanticClass.ROAD)
    sun = sun_in(environment) if to_sun is None else np.asarray(to_sun, dtype=np.float64)
    luminance = np.asarray(environment, dtype=np.float64) @ LUMINANCE
    limit = SUN_OVER_SKY * np.median(luminance[: len(luminance) // 2])
    lit = float(LUMINANCE @ shade.lit)
    light = ReliefLight(
        sky=_coarse(np.minimum(luminance, limit)), ground=lit, to_sun=np.array((0.0, 0.0, 1.0)),
        sun_share=0.0, shade=None,
    )  # fmt: skip
    if sun is None:
        return light
    directions, solid_angle = _directions(light.sky.shape)
    falling = np.maximum(directions[..., 2], 0) * solid_angle
    skylight = parameters.sky_view * float((light.sky * falling).sum()) / np.pi
    share = 1 - skylight * parameters.asphalt_albedo / lit
    return ReliefLight(
        sky=light.sky, ground=lit, to_sun=sun, sun_share=max(share, 0.0), shade=shade if share > 0 else None
    )


def light_outside(
    gaussians: Gaussians,
    environment: NDArray[np.floating],
    sky: SkyLight,
    parameters: SkyParameters,
    to_sun: NDArray[np.floating] | None = None,
) -> ReliefLight:
    """The light of a clip's sky: with a sun as `clear_light` reads it, under cloud sky and ground alone.

    Parameters
    ----------
    gaussians : the scene in that light, before its exposure
    environment : [H, W, 3] exposed panorama [1]
    sky : the light of the clip
    parameters : reflectance of the road and share of open sky
    to_sun : [3] unit vector to the sun; None under cloud [1]
    """
    if to_sun is not None:
        return clear_light(gaussians, environment / sky.relight[0, 0], parameters, to_sun)
    return ReliefLight(
        sky=_coarse(np.asarray(environment, dtype=np.float64) @ LUMINANCE),
        ground=float(LUMINANCE @ sky.ground),
        to_sun=np.array((0.0, 0.0, 1.0)),
        sun_share=0.0,
        shade=None,
    )


def relief_ratios(relief: RoadRelief, light: ReliefLight) -> tuple[Floats, Floats, Floats]:
    """Irradiance on the feature by that on the flat road, from the sun and from all else.

    Parameters
    ----------
    relief : the road feature
    light : what lights the flat road

    Returns
    -------
    stations : float64 [S] ascending; beyond them both ratios are 1 [m]
    sun : float64 [S] N L over that of the flat, 0 in the feature's own shadow [1]
    sky : float64 [S] from the sky above and the ground below the horizon that the feature leaves [1]
    """
    frame = relief.route.pose((relief.near + relief.far) / 2)[:3, :3]
    to_sun = light.to_sun @ frame
    height = max(float(relief.elevation(_stations(relief.near, relief.far)).max()), 0.0)
    shadow = height * abs(to_sun[0]) / max(to_sun[2], 1e-6) if light.sun_share else 0.0
    reach = max(min(shadow, LONGEST_SHADOW_M), HIDDEN_HEIGHTS * height)
    station = _stations(relief.near - reach, relief.far + reach)
    ahead, behind = _horizons(station, relief)
    slope = relief.slope(station)
    normal = np.stack((-slope, 0 * slope, np.ones_like(slope)), axis=1) / np.sqrt(1 + slope**2)[:, None]

    over, hidden = (to_sun[0], ahead) if to_sun[0] >= 0 else (-to_sun[0], behind)
    clearance = np.arctan2(to_sun[2], over) - hidden
    seen = np.clip(clearance / (2 * SUN_RADIUS) + 0.5, 0, 1)
    sun = seen * np.maximum(normal @ to_sun, 0) / max(to_sun[2], 1e-6)

    directions, solid_angle = _directions(light.sky.shape)
    x, up = (directions @ frame)[..., 0].ravel(), (directions @ frame)[..., 2].ravel()
    angle = np.arctan2(up, np.abs(x))
    flat = _irradiance(np.zeros(1), np.zeros(1), np.zeros(1), x, up, angle, solid_angle.ravel(), light)
    sky = _irradiance(slope, ahead, behind, x, up, angle, solid_angle.ravel(), light) / flat
    return station, sun, sky


def relight_gaussians(gaussians: Gaussians, relief: RoadRelief, light: ReliefLight) -> Gaussians:
    """The scene with the road feature in its light.

    Parameters
    ----------
    gaussians : a scene with the feature's shape but the flat road's light in its colours
    relief : the road feature
    light : what lights the flat road

    Returns
    -------
    Gaussians
        Road Gaussians on the feature and in its shadow have other colours.
    """
    station, sun, sky = relief_ratios(relief, light)
    middle = relief.route.pose((station[0] + station[-1]) / 2)[:3, 3]
    # the road is much narrower than this, and no station lies further from the middle than half the stretch
    radius = (station[-1] - station[0]) / 2 + WIDEST_ROAD_M
    near = np.linalg.norm(gaussians.means - middle, axis=1) < radius
    index = np.flatnonzero(near & np.isin(gaussians.class_id, ROAD_CLASSES))
    along, _, _ = relief.route.project(gaussians.means[index])
    direct = np.interp(along, station, sun, left=1, right=1)
    diffuse = np.interp(along, station, sky, left=1, right=1)
    sunny = np.zeros(len(index))
    if light.shade is not None:
        relative = read_between(light.shade.grid, light.shade.illumination, gaussians.means[index, :2])
        sunny = np.clip((relative - (1 - light.sun_share)) / light.sun_share, 0, 1)
    flat = light.sun_share * sunny + (1 - light.sun_share)
    gain = (light.sun_share * sunny * direct + (1 - light.sun_share) * diffuse) / flat
    index, gain = index[gain != 1], gain[gain != 1]
    every = np.ones(len(gaussians))
    every[index] = gain
    sh = gaussians.sh.copy()
    sh[index] = recolour_gaussians(gaussians, every, np.zeros((len(gaussians), 3))).sh[index]
    return replace(gaussians, sh=sh)


def _stations(first: float, last: float) -> Floats:
    return np.linspace(first, last, max(round((last - first) / PROFILE_STEP_M), 2) + 1)


def _horizons(station: Floats, relief: RoadRelief) -> tuple[Floats, Floats]:
    """Elevation of the horizon ahead and behind in the plane along the road [rad]; flat road ends at 0."""
    crest = _stations(relief.near, relief.far)
    rise = relief.elevation(crest)[None, :] - relief.elevation(station)[:, None]
    run = crest[None, :] - station[:, None]
    apart = np.abs(run) > PROFILE_STEP_M / 2
    angle = np.where(apart, np.arctan2(rise, np.abs(run)), 0.0)
    ahead = np.where(run > 0, angle, 0.0).max(axis=1)
    behind = np.where(run < 0, angle, 0.0).max(axis=1)
    return ahead, behind


def _irradiance(
    slope: Floats, ahead: Floats, behind: Floats, x: Floats, up: Floats, angle: Floats, solid_angle: Floats,
    light: ReliefLight,
) -> Floats:  # fmt: skip
    """Irradiance from sky and ground on facets of the road, float64 [S]."""
    sky, row = light.sky.ravel(), np.pi / len(light.sky)
    out = np.empty(len(slope))
    for k in range(len(slope)):
        facing = np.maximum(up - slope[k] * x, 0) * solid_angle
        # the share of a pixel below the horizon, so that a rising horizon takes no whole rows at once
        hidden = np.clip((np.where(x >= 0, ahead[k], behind[k]) - angle) / row + 0.5, 0, 1)
        out[k] = (facing * (sky + hidden * (light.ground - sky))).sum()
    return out / np.sqrt(1 + slope**2)


def _directions(shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """World direction [h, w, 3] and solid angle [h, w] of each pixel of a panorama."""
    height, width = shape
    elevation = np.pi / 2 - (np.arange(height) + 0.5) / height * np.pi
    azimuth = np.pi - (np.arange(width) + 0.5) / width * 2 * np.pi
    flat = np.cos(elevation)[:, None]
    up = np.sin(elevation)[:, None] * np.ones(width)
    directions = np.stack((flat * np.cos(azimuth), flat * np.sin(azimuth), up), axis=-1)
    # exact between the rows' edges, so that a uniform sky adds up to pi
    band = np.sin(elevation + np.pi / 2 / height) - np.sin(elevation - np.pi / 2 / height)
    return directions, np.repeat(band[:, None] * 2 * np.pi / width, width, axis=1)


def _coarse(luminance: Floats) -> Floats:
    """A panorama averaged to at most `PANORAMA_ROWS` rows and twice as many columns."""
    rows = min(PANORAMA_ROWS, len(luminance))
    r = np.arange(rows + 1) * len(luminance) // rows
    columns = min(2 * PANORAMA_ROWS, luminance.shape[1])
    c = np.arange(columns + 1) * luminance.shape[1] // columns
    sums = np.add.reduceat(np.add.reduceat(luminance, r[:-1], axis=0), c[:-1], axis=1)
    return sums / np.outer(np.diff(r), np.diff(c))
