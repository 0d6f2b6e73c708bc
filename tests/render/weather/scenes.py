"""Small scenes for weather: a street of surfels, and G-buffers written down by hand."""

import numpy as np

from catalogs.entries import load
from tasks.conventions import SemanticClass
from tasks.render.camera import world_to_camera
from tasks.render.environment import environment_view
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.road_edit import RoadRelief
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.layers import ClearScene, ClipConditions, ClipWeather, weather_scene
from tasks.render.weather.parameters import WeatherParameters
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route
from tasks.scene.spherical_harmonics import C0
from tasks.surface.state import SurfaceParameters, SurfaceState

ASPHALT = 0.17
FOCAL_PX = 120.0
PAVEMENT = load("surface", "dense-asphalt")
TEXTURE_MM = PAVEMENT.texture_depth_mm


def weather_over(
    street: Gaussians, environment: np.ndarray, state: SurfaceState, parameters: WeatherParameters,
    seed: int = 1, route: Route | None = None, relief: RoadRelief | None = None,
    anchors: tuple[SurfaceState, ...] = (), refracts: bool = False,
    pavement: SurfaceParameters = PAVEMENT,
) -> tuple[Gaussians, ClipWeather]:  # fmt: skip
    """The street in a weather, and the weather."""
    clear = ClearScene(gaussians=street, environment=environment, route=route, relief=relief)
    conditions = ClipConditions(
        state=state, pavement=pavement, parameters=parameters, seed=seed, anchors=anchors, refracts=refracts
    )
    return weather_scene(clear, conditions, FOCAL_PX)


def see_sky(environment: np.ndarray, view: Shutter) -> np.ndarray:
    """The part of a panorama that a view sees."""
    viewmat = world_to_camera(view.T_world_camera)
    return environment_view(environment, viewmat, view.K, view.width, view.height)


def surfels(
    points: np.ndarray, normal: tuple[float, float, float], size: float, colour: object, kind: int
) -> Gaussians:
    """Flat Gaussians of one orientation, size [m], linear colour and class."""
    n = len(points)
    scales = np.where(np.abs(normal) > 0.5, 0.003, size)
    colours = np.broadcast_to(np.asarray(colour, dtype=np.float32), (n, 3))
    return Gaussians(
        means=points.astype(np.float32),
        quats_wxyz=np.tile(np.array((1, 0, 0, 0), np.float32), (n, 1)),
        scales=np.tile(scales.astype(np.float32), (n, 1)),
        opacities=np.full(n, 0.95, np.float32),
        sh=((colours - 0.5) / C0)[:, None].astype(np.float32),
        normals=np.tile(np.array(normal, np.float32), (n, 1)),
        class_id=np.full(n, kind, np.uint8),
    )


def road(seed: int = 0, length: float = 16.0, half_width: float = 4.0, spacing: float = 0.07) -> Gaussians:
    """A flat road along +x from 1 m on, with a little grain."""
    rng = np.random.Generator(np.random.Philox(seed))
    x, y = np.meshgrid(np.arange(1, 1 + length, spacing), np.arange(-half_width, half_width, spacing))
    points = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    grain = ASPHALT * (1 + 0.1 * rng.standard_normal((len(points), 1))) * np.ones(3)
    return surfels(points, (0, 0, 1), 0.6 * spacing, grain, SemanticClass.ROAD)


def flat_gbuffer(
    view: Shutter, wall_x: float | None = None, shade: float = ASPHALT
) -> tuple[np.ndarray, GBuffer]:
    """An endless flat road and, where asked for, a wall across it; the clear picture and its G-buffer.

    The wall is striped along y, so that a mirrored stripe can be told from its neighbours.
    """
    K = view.K
    u, v = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    across, down = (u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]
    with np.errstate(divide="ignore"):
        ground = np.where(down > 0, view.T_world_camera[2, 3] / down, np.inf)
    depth = np.where(ground < 80, ground, np.inf)
    normal = np.zeros((view.height, view.width, 3), np.float32)
    picture = np.full((view.height, view.width, 3), 0.5, np.float32)
    kind = np.zeros((view.height, view.width), np.uint8)
    seen = np.isfinite(depth)
    normal[seen], picture[seen], kind[seen] = (0, 0, 1), shade, SemanticClass.ROAD
    if wall_x is not None:
        wall = (depth > wall_x) & (view.T_world_camera[2, 3] - wall_x * down < 3.0)
        stripe = 0.2 + 0.6 * (np.floor(across * wall_x) % 2)
        normal[wall], kind[wall], depth[wall] = (-1, 0, 0), SemanticClass.BUILDING, wall_x
        picture[wall] = stripe[wall][:, None]
    covered = np.isfinite(depth)
    depth = np.where(covered, depth, np.nan).astype(np.float32)
    return picture, GBuffer(
        rgb=np.where(covered[..., None], picture, 0).astype(np.float32),
        depth=depth,
        expected_depth=depth,
        alpha=covered.astype(np.float32),
        normal=normal,
        class_id=kind,
        object_id=np.zeros(kind.shape, np.uint16),
    )


def clear_sky(height: int = 32) -> np.ndarray:
    """A blue sky over grey ground, with a sun."""
    elevation = np.pi / 2 - (np.arange(height) + 0.5) / height * np.pi
    colour = np.where(elevation[:, None] > 0, (0.2, 0.4, 0.8), (0.2, 0.2, 0.2))
    sky = np.repeat(colour[:, None, :], 2 * height, axis=1).astype(np.float32)
    sky[height // 4, height // 2] = 50.0
    return sky
