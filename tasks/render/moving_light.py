"""The light on a body that moves through a scene: its colours, and the shade that it casts on the ground.

The colours of a scene carry its clear light; under cloud a layer of the weather changes the whole picture
(`tasks.render.weather.atmosphere.light_layer`). So a body gets the radiance that this layer takes for a clear one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.render.composition import LUMINANCE
from tasks.render.weather.ground_grid import read_between
from tasks.render.weather.layers import ClipWeather
from tasks.render.weather.relief import clear_light
from tasks.render.weather.scene_light import GroundLight, ground_light
from tasks.render.weather.sky import light_from
from tasks.scene.bodies import Body
from tasks.scene.gaussians import Gaussians
from tasks.scene.road_users.bodies import RoadUserBody
from tasks.scene.scene import Scene

Floats = NDArray[np.float64]

DARKEST, REACH_M = 0.88, 0.28
"""Share of the ambient light that is hidden under a body [1], and length over which that fades beside it [m]: those of
the parked cars (`tasks.scene.street.light`)."""
FARTHEST_M = 1.2
"""Distance beside a footprint at which the shade is below a hundredth [m]."""
LONGEST_SHADOW = 6.0
"""Longest shadow by the body's height that is followed [1]: a sun 9.5 degrees high."""
EDGE_M = 0.12
"""Chord through a caster from which on the sun is hidden: the shadow's edge is soft over as much [m]."""


@dataclass(frozen=True, kw_only=True)
class BodyLight:
    """Light of a clip on bodies, relative to that on flat ground in the open.

    Parameters
    ----------
    white : float64 [3] radiance of a white surface that lies on the lit road, as the scene's colours have it [1]
    sun_share : share of that light that comes straight from the sun; 0 under cloud [1]
    to_sun : float64 [3] unit vector to the sun, world frame [1]
    ground : radiance of the ground by that of the white surface [1]
    shade : where the sun reaches the road; None without a sun
    """

    white: Floats
    sun_share: float
    to_sun: Floats
    ground: float
    shade: GroundLight | None

    def sun_at(self, place: NDArray[np.floating]) -> Floats:
        """Return the share of the sun that reaches ground at places [N, 2] [m], past the street alone [1]."""
        if self.shade is None:
            return np.zeros(len(place))
        relative = read_between(self.shade.grid, self.shade.illumination, place)
        return np.clip((relative - (1 - self.sun_share)) / self.sun_share, 0, 1)


def find_body_light(scene: Scene, weathered: Gaussians, weather: ClipWeather) -> BodyLight:
    """Return the light on bodies: that of the clip's sky where it is known, else what the scene's road tells.

    Parameters
    ----------
    scene : in its own light
    weathered : its Gaussians in the light of the clip
    weather : of the clip
    """
    p, outside = weather.parameters.sky, weather.outside
    if outside is None:
        light = clear_light(scene.gaussians, scene.environment, p, scene.to_sun)
        lit = light.shade.lit if light.shade is not None else np.full(3, light.ground)
        return BodyLight(
            white=lit / p.asphalt_albedo,
            sun_share=light.sun_share,
            to_sun=light.to_sun,
            ground=p.asphalt_albedo,
            shade=light.shade,
        )
    sky, daylight = outside.sky, outside.daylight
    if daylight is not None and daylight.has_sun:
        sun, above, around = (float(LUMINANCE @ colour) for colour in daylight.colours)
        falling = sun * float(daylight.to_sun[2])
        return BodyLight(
            white=sky.clear_white,
            sun_share=falling / (falling + above),
            to_sun=daylight.to_sun,
            ground=around / (falling + above),
            shade=ground_light(weathered, SemanticClass.ROAD),
        )
    flat, level = (float(LUMINANCE @ light_from(sky, np.array(up), p)) for up in (1.0, -1.0))
    return BodyLight(
        white=sky.clear_white,
        sun_share=0.0,
        to_sun=np.array((0.0, 0.0, 1.0)),
        ground=level / flat,
        shade=None,
    )


def light_body(body: Body, mirrored: Floats, light: BodyLight, T_world_body: Floats) -> Floats:
    """Return the radiance [N, 3] of a body's discs where it stands [1].

    Parameters
    ----------
    body : with reflectances
    mirrored : float64 [N, 3] what its lacquer and glass mirror in the light of open ground [1]
    light : of the clip
    T_world_body : float64 [4, 4] [m]
    """
    normal = body.gaussians.normals @ T_world_body[:3, :3].T
    up = (1 + normal[:, 2]) / 2
    facing = np.maximum(normal @ light.to_sun, 0) / max(float(light.to_sun[2]), 1e-3)
    sun = light.sun_share * float(light.sun_at(T_world_body[None, :2, 3])[0])
    around = (1 - light.sun_share) * up + light.ground * (1 - up)
    received = sun * facing + body.openness * around
    brightness = float(LUMINANCE @ light.white) * (sun + (1 - light.sun_share))
    return body.albedo * received[:, None] * light.white + mirrored * brightness


def shade_ground(points: Floats, body: RoadUserBody, T_world_body: Floats, light: BodyLight) -> Floats:
    """Return the share of its light that a body leaves to the ground: under and beside it, and where it hides the sun.

    Parameters
    ----------
    points : float64 [N, 3] of the ground, world frame [m]
    body, T_world_body : the body where it stands [m]
    light : of the clip

    Returns
    -------
    float64 [N] [1]
    """
    within = (points - T_world_body[:3, 3]) @ T_world_body[:3, :3]
    beside = np.maximum(np.abs(within[:, :2]) - body.footprint, 0.0)
    ambient = 1 - DARKEST * np.exp(-np.hypot(beside[:, 0], beside[:, 1]) / REACH_M)
    if not light.sun_share:
        return ambient
    direct = light.sun_share * light.sun_at(points[:, :2])
    left = direct * (1 - _hide_sun(within, light.to_sun @ T_world_body[:3, :3], body.casters))
    return (left + (1 - light.sun_share) * ambient) / (direct + (1 - light.sun_share))


def reach_of_shade(body: RoadUserBody, light: BodyLight) -> float:
    """Return the distance from a body's middle within which it shades the ground [m]."""
    reach = float(np.hypot(*body.size[:2])) / 2 + FARTHEST_M
    if not light.sun_share:
        return reach
    along = float(np.hypot(*light.to_sun[:2])) / max(float(light.to_sun[2]), 1e-3)
    return reach + float(body.size[2]) * min(along, LONGEST_SHADOW)


def _hide_sun(points: Floats, to_sun: Floats, casters: Floats) -> Floats:
    """Return the share of the sun that boxes hide from points [N, 3], all in body axes [N] [1]."""
    hidden = np.zeros(len(points))
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in casters:
            a, b = (low - points) / to_sun, (high - points) / to_sun
            enter = np.maximum(np.fmin(a, b).max(axis=1), 0.0)
            hidden = np.maximum(hidden, np.clip((np.fmax(a, b).min(axis=1) - enter) / EDGE_M, 0, 1))
    return hidden
