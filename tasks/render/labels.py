"""Ground truth of a frame beyond depth and class: where on the road, where it moves to, and what changed it."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.composition import round_depth
from tasks.render.gbuffer import GBuffer
from tasks.render.road_edit import Profile
from tasks.render.weather.attribution import LAYER_BITS, attribution
from tasks.render.weather.layers import ClipWeather, WeatherFrame, pixel_rays
from tasks.render.weather.particles import Shutter
from tasks.scene.route import Route

OCCLUDED, HAZARD = 32, 64
"""Bits of `marks` beside those of the layers: out of sight in the next frame; on the road feature."""
MARK_BITS = LAYER_BITS | {"occluded": OCCLUDED, "hazard": HAZARD}
"""Bit of each mark."""
OCCLUSION_TOLERANCE = 0.05
"""Share of its depth by which a point must lie behind what the next frame shows to be hidden there [1]."""
NORMAL_STEPS = 127
"""Steps of a stored normal's component from 0 to 1 [1]."""


def forward_flow(
    depth: NDArray[np.float32],
    next_depth: NDArray[np.float32],
    K: NDArray[np.float64],
    T_world_camera: NDArray[np.float64],
    next_T_world_camera: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Where each pixel's point lies in the next frame: the street stands still, so depth and poses say it all.

    Parameters
    ----------
    depth, next_depth : float32 [H, W] camera z, NaN where nothing is seen [m]
    K : float64 [3, 3] intrinsics, pixel centres at +0.5 [px]
    T_world_camera, next_T_world_camera : float64 [4, 4] poses [m]

    Returns
    -------
    flow : float32 [H, W, 2] right and down; NaN without depth, and where the point falls behind the camera [px]
    occluded : bool [H, W] the point leaves the picture or lies behind what the next frame shows there
    """
    height, width = depth.shape
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.stack(((u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones_like(u)), axis=-1)
    T = np.linalg.inv(next_T_world_camera) @ T_world_camera
    x, y, z = np.moveaxis((rays * depth[..., None]) @ T[:3, :3].T + T[:3, 3], -1, 0)
    z = np.where(z > 0, z, np.nan)
    there_u, there_v = K[0, 0] * x / z + K[0, 2], K[1, 1] * y / z + K[1, 2]
    with np.errstate(invalid="ignore"):
        inside = (there_u >= 0) & (there_u < width) & (there_v >= 0) & (there_v < height)
        column, row = (np.where(inside, np.floor(there), 0).astype(np.int64) for there in (there_u, there_v))
        hidden = z > (1 + OCCLUSION_TOLERANCE) * next_depth[row, column]
    flow = np.stack((there_u - u, there_v - v), axis=-1).astype(np.float32)
    return flow, np.isfinite(depth) & (~inside | hidden)


def road_coordinates(
    gbuffer: GBuffer, rays: NDArray[np.float32], eye: NDArray[np.float64], route: Route
) -> NDArray[np.float32]:
    """Station along the route and lateral position of every road pixel.

    Parameters
    ----------
    gbuffer : one view
    rays : float32 [H, W, 3] world directions of its pixels, camera z 1 [1]
    eye : [3] camera centre [m]
    route : the undisturbed route

    Returns
    -------
    float32 [H, W, 2] station and lateral, leftward positive; NaN off the road [m]
    """
    road = np.isin(gbuffer.class_id, ROAD_CLASSES) & np.isfinite(gbuffer.depth)
    place = np.full((*road.shape, 2), np.nan, np.float32)
    station, lateral, _ = route.project(eye + gbuffer.depth[road, None] * rays[road])
    place[road] = np.stack((station, lateral), axis=-1)
    return place


def hazard_mark(place: NDArray[np.float32], elevation: Profile) -> NDArray[np.uint8]:
    """`HAZARD` where the road profile lifts or lowers the road, by road coordinates [H, W, 2] and H_g(s) [m]."""
    on_road = np.isfinite(place[..., 0])
    lifted = elevation(np.where(on_road, place[..., 0], -1e9).astype(np.float64)) != 0
    return np.where(on_road & lifted, HAZARD, 0).astype(np.uint8)


def frame_labels(
    weather: ClipWeather,
    finished: WeatherFrame,
    gbuffer: GBuffer,
    shutter: Shutter,
    route: Route,
    elevation: Profile,
) -> dict[str, NDArray[np.generic]]:
    """What one frame says of its pixels by itself.

    Parameters
    ----------
    weather, finished, gbuffer, shutter : as `attribution` takes them
    route : the undisturbed route
    elevation : H_g(s) [m] at stations [m]

    Returns
    -------
    ``normal`` int8 [H, W, 3] world normal in steps of 1/127, zero where nothing is seen; ``road`` float32 [H, W, 2]
    station and lateral of road pixels, else NaN [m]; ``marks`` uint8 [H, W] `MARK_BITS` without ``occluded``
    """
    place = road_coordinates(gbuffer, pixel_rays(shutter), shutter.T_world_camera[:3, 3], route)
    return {
        "normal": np.rint(gbuffer.normal * NORMAL_STEPS).astype(np.int8),
        "road": round_depth(place),
        "marks": attribution(weather, finished, gbuffer, shutter) | hazard_mark(place, elevation),
    }


def clip_flow(
    depth: NDArray[np.float32], K: NDArray[np.float64], T_world_camera: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Flow of every frame to its next, and the mark of what is out of sight there; the last frame has neither.

    Parameters
    ----------
    depth : float32 [F, H, W] camera z [m]
    K, T_world_camera : as `forward_flow` takes them, poses [F, 4, 4]

    Returns
    -------
    float32 [F, H, W, 2] [px] and uint8 [F, H, W]
    """
    flow = np.full((*depth.shape, 2), np.nan, np.float32)
    marks = np.zeros(depth.shape, np.uint8)
    for k in range(len(depth) - 1):
        moved, occluded = forward_flow(depth[k], depth[k + 1], K, T_world_camera[k], T_world_camera[k + 1])
        flow[k] = round_depth(moved)
        marks[k] = np.where(occluded, OCCLUDED, 0)
    return flow, marks
