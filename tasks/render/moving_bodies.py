"""Road users in the pictures of a clip: rigid bodies of Gaussians, prepared once where their light stays the same."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tasks.render.composition import LUMINANCE
from tasks.render.moving_light import BodyLight, find_body_light, light_body, reach_of_shade, shade_ground
from tasks.render.rasterise.backend import Backend
from tasks.render.rasterise.placed_body import PlacedBody, Shade
from tasks.render.weather.layers import ClipWeather
from tasks.render.weather.scene_light import mean_colours, to_display_unclipped
from tasks.render.weather.snow.bearing import GROUND_CLASSES
from tasks.render.weather.snow.field import LyingSnow
from tasks.render.weather.snow.layer import whiten_gaussians
from tasks.render.weather.wet.puddles import compute_wetness
from tasks.render.weather.wet.wet_road import wet_albedo_ratio
from tasks.scene.gaussians import Gaussians
from tasks.scene.road_users.bodies import RoadUserBody
from tasks.scene.scene import Scene
from tasks.scene.spherical_harmonics import C0
from tasks.scene.street.cars.parked import mirror_surroundings
from tasks.scene.surroundings import add_surroundings

Floats = NDArray[np.float64]

STOP_LAMP, POSITION_LAMP = np.array((0.8, 0.045, 0.03)), np.array((0.12, 0.007, 0.005))
"""Radiance of lit stop lamps, and of rear position lamps where something falls, by that of a white surface in the sun
[1]: 60 cd on 0.01 m2 (UN Regulation 7) and a tenth of it, next to 100 klx."""


@dataclass(frozen=True, kw_only=True)
class MovingBody:
    """A body on its way through a clip.

    Parameters
    ----------
    number : in the array of instances, from 1 on [1]
    body : in its own axes
    T_world_body : float64 [F, 4, 4] where it stands in each frame [m]
    velocity : float64 [F, 3] of its origin, world frame [m/s]
    braking : bool [F] its stop lamps are lit
    """

    number: int
    body: RoadUserBody
    T_world_body: Floats
    velocity: Floats
    braking: NDArray[np.bool_]


class BodiesInClip:
    """The moving bodies of a clip, ready to be drawn.

    Parameters
    ----------
    bodies : that move
    scene : in clear weather, whose Gaussians' kind theirs take
    weathered : its Gaussians in the weather of the clip
    weather : of the clip
    backend : the rasteriser
    T_world_camera : float64 [F, 4, 4] camera poses [m]
    """

    def __init__(
        self,
        bodies: Sequence[MovingBody],
        scene: Scene,
        weathered: Gaussians,
        weather: ClipWeather,
        backend: Backend,
        T_world_camera: Floats,
    ) -> None:
        self._bodies, self._weather, self._backend = tuple(bodies), weather, backend
        self._display_encoded = scene.gaussians.display_encoded
        if not bodies:
            return
        self._light: BodyLight = find_body_light(scene, weathered, weather)
        self._clouds = [_wrap_body(moving.body, scene.gaussians) for moving in bodies]
        self._mirrored = [_mirror_from(moving, T_world_camera) for moving in bodies]
        self._ground = np.flatnonzero(np.isin(weathered.class_id, GROUND_CLASSES))
        self._places = weathered.means[self._ground].astype(np.float64)
        self._tree = cKDTree(self._places[:, :2])
        self._kept: dict[tuple[int, bool], Any] = {}

    def place(self, frame: int) -> list[PlacedBody]:
        """Return the bodies where they stand in a frame."""
        return [
            PlacedBody(
                prepared=self._prepare(place, frame),
                T_world_body=moving.T_world_body[frame],
                number=moving.number,
            )
            for place, moving in enumerate(self._bodies)
        ]

    def shade(self, frame: int) -> Shade | None:
        """Return the shade of the bodies on the ground in a frame; None without bodies."""
        if not self._bodies:
            return None
        share = np.ones(len(self._ground))
        for moving in self._bodies:
            pose = moving.T_world_body[frame]
            near = self._tree.query_ball_point(pose[:2, 3], reach_of_shade(moving.body, self._light))
            share[near] *= shade_ground(self._places[near], moving.body, pose, self._light)
        shaded = np.flatnonzero(share != 1)
        left = share[shaded] ** (1 / 2.2) if self._display_encoded else share[shaded]
        return Shade(index=self._ground[shaded], share=left.astype(np.float32))

    def wrap(self, place: int, frame: int) -> Gaussians:
        """Return the Gaussians of a body in its own axes, in the light of a frame.

        Parameters
        ----------
        place : of the body among those of the clip
        frame : number in the clip
        """
        radiance = self._colour(place, frame)
        return _colour_cloud(self._clouds[place], radiance, self._display_encoded)

    def _prepare(self, place: int, frame: int) -> Any:
        """Return a body's cloud in the light of a frame; under cloud that of the first frame with the same lamps."""
        braking = bool(self._bodies[place].braking[frame])
        first = int(np.argmax(self._bodies[place].braking == braking))
        if (place, braking) not in self._kept:
            self._kept[place, braking] = self._backend.prepare_gaussians(self.wrap(place, first))
        if self._light.sun_share and frame != first:
            return self._backend.recolour(self._kept[place, braking], self.wrap(place, frame).sh)
        return self._kept[place, braking]

    def _colour(self, place: int, frame: int) -> Floats:
        """Return the radiance of each Gaussian [N, 3], in clear light, with water, snow and lamps [1]."""
        moving, weather = self._bodies[place], self._weather
        body, braking = moving.body, bool(moving.braking[frame])
        radiance = light_body(body.body, self._mirrored[place], self._light, moving.T_world_body[frame])
        falls = False
        if (outside := weather.outside) is not None:
            falls = outside.population is not None
            film, cover = outside.look.film, outside.look.snow_cover
            if film is not None and body.porous:
                soaked = compute_wetness(weather.state.film_depth_mm, film.water)
                albedo = body.body.albedo.mean(axis=1)
                ratio = wet_albedo_ratio(albedo, film.refractive_index, film.diffuse_reflectance)
                radiance *= (1 - soaked * (1 - ratio))[:, None]
            if cover is not None and outside.snow is not None:
                amount = LyingSnow(
                    coverage=outside.road.snow_coverage,
                    depth_mm=outside.road.snow_depth_mm,
                    full_cover_mm=weather.pavement.full_cover_depth_mm,
                )
                # snow lies on a body as it did where the body stood first
                standing = _stand(_colour_cloud(self._clouds[place], radiance, False), moving.T_world_body[0])
                standing = replace(standing, display_encoded=False)
                radiance = mean_colours(
                    whiten_gaussians(standing, outside.snow, self._light.white, amount, cover)
                )
        if braking or falls:
            white = float(LUMINANCE @ self._light.white)
            radiance = radiance.copy()
            radiance[body.stop_lamps] += white * (STOP_LAMP if braking else POSITION_LAMP)
        return radiance


def _wrap_body(body: RoadUserBody, like: Gaussians) -> Gaussians:
    """Return a body's Gaussians as the scene has its own, without colour."""
    cloud = replace(body.body.gaussians, antialiased=like.antialiased, display_encoded=like.display_encoded)
    return cloud if like.surroundings is None else add_surroundings(cloud)


def _colour_cloud(cloud: Gaussians, radiance: Floats, display_encoded: bool) -> Gaussians:
    colour = to_display_unclipped(radiance) if display_encoded else radiance
    return replace(cloud, sh=((colour - 0.5) / C0).astype(np.float32)[:, None])


def _mirror_from(moving: MovingBody, T_world_camera: Floats) -> Floats:
    """Return what a body's lacquer and glass mirror [N, 3], as the camera sees it in the middle of the clip [1]."""
    middle = len(T_world_camera) // 2
    pose = moving.T_world_body[middle]
    eye = (T_world_camera[middle, :3, 3] - pose[:3, 3]) @ pose[:3, :3]
    return mirror_surroundings(moving.body.body, eye)


def _stand(cloud: Gaussians, T_world_body: Floats) -> Gaussians:
    """Return a cloud in the world; its colour has no direction."""
    R = T_world_body[:3, :3]
    quats = Rotation.from_matrix(R) * Rotation.from_quat(cloud.quats_wxyz, scalar_first=True)
    return replace(
        cloud,
        means=(cloud.means @ R.T + T_world_body[:3, 3]).astype(np.float32),
        quats_wxyz=quats.as_quat(scalar_first=True).astype(np.float32),
        normals=(cloud.normals @ R.T).astype(np.float32),
    )
