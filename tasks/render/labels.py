"""Ground truth of a frame beyond depth and class: road coordinates, flow, and marks of what changed a pixel."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.camera import Camera
from tasks.render.composition import round_depth
from tasks.render.readout import project_by_rows
from tasks.render.road_edit import Profile
from tasks.render.sight import row_points
from tasks.render.weather.attribution import LAYER_BITS
from tasks.scene.route import Route

OCCLUDED, HAZARD = 32, 64
"""Bits of `marks` beside those of the layers: hidden in the next frame; on the road feature."""
MARK_BITS = LAYER_BITS | {"occluded": OCCLUDED, "hazard": HAZARD}
"""Bit of each mark."""
OCCLUSION_TOLERANCE = 0.05
"""A point is hidden in the next frame if it lies behind the surface there by more than this share of its depth [1]."""
NORMAL_STEPS = 127
"""Steps of a stored normal's component from 0 to 1 [1]."""


@dataclass(frozen=True, kw_only=True)
class MovedPixels:
    """Pixels of a frame that show a moving body, and where the body goes.

    Parameters
    ----------
    shown : bool [H, W]
    T_later_earlier : float64 [4, 4] from world points of the body in this frame to where they are in the next [m]
    """

    shown: NDArray[np.bool_]
    T_later_earlier: NDArray[np.float64]


def compute_flow(
    depth: NDArray[np.float32],
    next_depth: NDArray[np.float32],
    K: NDArray[np.float64],
    T_world_camera: NDArray[np.float64],
    next_T_world_camera: NDArray[np.float64],
    moved: Sequence[MovedPixels] = (),
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the optical flow to the next frame: depth and the poses of camera and bodies determine it.

    Parameters
    ----------
    depth, next_depth : float32 [H, W] camera z, NaN where nothing is seen [m]
    K : float64 [3, 3] intrinsics, pixel centres at +0.5 [px]
    T_world_camera, next_T_world_camera : float64 [4, 4] poses [m]
    moved : bodies that do not stand still as the street does

    Returns
    -------
    flow : float32 [H, W, 2] right and down; NaN without depth, and where the point falls behind the camera [px]
    occluded : bool [H, W] the point leaves the picture or lies behind the surface that the next frame shows there
    """
    height, width = depth.shape
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.stack(((u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones_like(u)), axis=-1)
    into_next = np.linalg.inv(next_T_world_camera)
    T = into_next @ T_world_camera
    points = (rays * depth[..., None]) @ T[:3, :3].T + T[:3, 3]
    for body in moved:
        T = into_next @ body.T_later_earlier @ T_world_camera
        points[body.shown] = (rays * depth[..., None])[body.shown] @ T[:3, :3].T + T[:3, 3]
    x, y, z = np.moveaxis(points, -1, 0)
    z = np.where(z > 0, z, np.nan)
    return compute_flow_and_occlusion(
        depth, next_depth, K[0, 0] * x / z + K[0, 2], K[1, 1] * y / z + K[1, 2], z
    )


def compute_row_flow(
    depth: NDArray[np.float32],
    next_depth: NDArray[np.float32],
    directions: NDArray[np.float64],
    camera: Camera,
    T_world_rows: NDArray[np.float64],
    next_T_world_rows: NDArray[np.float64],
    moved: Sequence[MovedPixels] = (),
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return `compute_flow` for a camera with a lens or a rolling shutter, between pixels as they are stored.

    Parameters
    ----------
    depth, next_depth : float32 [H, W] z in the camera at the pixel's own time; NaN where nothing is seen [m]
    directions : float64 [H, W, 2] right and down per forward of the pixels [1]
    camera : intrinsics and lens
    T_world_rows, next_T_world_rows : float64 [H, 4, 4] camera poses at the rows' times [m]
    moved : as of `compute_flow`; a body stands still while a frame is read out

    Returns
    -------
    As `compute_flow`.
    """
    points = row_points(directions, depth, T_world_rows)
    for body in moved:
        T = body.T_later_earlier
        points[body.shown] = points[body.shown] @ T[:3, :3].T + T[:3, 3]
    there = project_by_rows(points, next_T_world_rows, camera)
    return compute_flow_and_occlusion(depth, next_depth, there[..., 0], there[..., 1], there[..., 2])


def compute_flow_and_occlusion(
    depth: NDArray[np.float32],
    next_depth: NDArray[np.float32],
    there_u: NDArray[np.float64],
    there_v: NDArray[np.float64],
    z: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return flow and occlusion of points that lie at (there_u, there_v) of the next frame, at depth z.

    Parameters
    ----------
    depth, next_depth : as `compute_flow` takes them
    there_u, there_v : [H, W] places in the next frame; NaN where there is none [px]
    z : [H, W] camera z there [m]

    Returns
    -------
    As `compute_flow`.
    """
    height, width = depth.shape
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    with np.errstate(invalid="ignore"):
        inside = (there_u >= 0) & (there_u < width) & (there_v >= 0) & (there_v < height)
        column, row = (np.where(inside, np.floor(there), 0).astype(np.int64) for there in (there_u, there_v))
        hidden = z > (1 + OCCLUSION_TOLERANCE) * next_depth[row, column]
    flow = np.stack((there_u - u, there_v - v), axis=-1).astype(np.float32)
    return flow, np.isfinite(depth) & (~inside | hidden)


def locate_road_pixels(
    class_id: NDArray[np.uint8], points: NDArray[np.floating], route: Route
) -> NDArray[np.float32]:
    """Return the station along the route and the lateral position of every road pixel.

    Parameters
    ----------
    class_id : uint8 [H, W] classes of one view
    points : [H, W, 3] points that its pixels show, world frame; NaN where nothing is seen [m]
    route : the undisturbed route

    Returns
    -------
    float32 [H, W, 2] station and lateral, leftward positive; NaN off the road [m]
    """
    road = np.isin(class_id, ROAD_CLASSES) & np.isfinite(points[..., 2])
    place = np.full((*road.shape, 2), np.nan, np.float32)
    station, lateral, _ = route.project(points[road])
    place[road] = np.stack((station, lateral), axis=-1)
    return place


def mark_hazard(place: NDArray[np.float32], elevation: Profile) -> NDArray[np.uint8]:
    """Return `HAZARD` where the profile H_g(s) [m] moves the road at road coordinates [H, W, 2], else 0."""
    on_road = np.isfinite(place[..., 0])
    lifted = elevation(np.where(on_road, place[..., 0], -1e9).astype(np.float64)) != 0
    return np.where(on_road & lifted, HAZARD, 0).astype(np.uint8)


def label_frame(
    normal: NDArray[np.float32],
    class_id: NDArray[np.uint8],
    points: NDArray[np.floating],
    changes: NDArray[np.uint8],
    route: Route,
    elevation: Profile | None,
) -> dict[str, NDArray[np.generic]]:
    """Return the labels of a frame that need no other frame.

    Parameters
    ----------
    normal : float32 [H, W, 3] world normals, zero where nothing is seen [1]
    class_id, points, route : as `locate_road_pixels` takes them
    changes : uint8 [H, W] `LAYER_BITS` of the layers that changed each pixel
    elevation : H_g(s) [m] at stations [m]; None for a flat road

    Returns
    -------
    ``normal`` int8 [H, W, 3] world normal in steps of 1/127; ``road`` float32 [H, W, 2] station and lateral of road
    pixels, else NaN [m]; ``marks`` uint8 [H, W] `MARK_BITS` without ``occluded``
    """
    place = locate_road_pixels(class_id, points, route)
    return {
        "normal": np.rint(normal * NORMAL_STEPS).astype(np.int8),
        "road": round_depth(place),
        "marks": changes if elevation is None else changes | mark_hazard(place, elevation),
    }


def compute_clip_flow(
    depth: NDArray[np.float32], flow_from: Callable[[int], tuple[NDArray[np.float32], NDArray[np.bool_]]]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return the flow of every frame to the next, and the mark of points hidden there; the last frame has neither.

    Parameters
    ----------
    depth : float32 [F, H, W] camera z [m]
    flow_from : frame number to flow and occlusion, as `compute_flow` and `compute_row_flow` return them

    Returns
    -------
    float32 [F, H, W, 2] [px] and uint8 [F, H, W]
    """
    flow = np.full((*depth.shape, 2), np.nan, np.float32)
    marks = np.zeros(depth.shape, np.uint8)
    for k in range(len(depth) - 1):
        moved, occluded = flow_from(k)
        flow[k] = round_depth(moved)
        marks[k] = np.where(occluded, OCCLUDED, 0)
    return flow, marks
