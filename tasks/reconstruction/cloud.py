"""The Gaussians of the samples: road samples moved onto the road, classified, and small where a car may come near."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.reconstruction.normals import turn_to_camera
from tasks.reconstruction.surfels import COVERAGE, Surfels, derive_discs
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route
from tasks.scene.spherical_harmonics import C0

INITIAL_OPACITY = 0.9
LEAST_COSINE = 0.25
"""Least cosine between a surface's normal and the ray, for surfaces other than the ground [1]."""
SADDLE = 0.02
"""Standard deviation of the road surface from the route's plane [m]."""
DISPARITY_ERROR = 0.3
"""Standard deviation of a disparity [px]."""
FAR_GROUND = 14.0
"""Ground farther from the camera than this counts as level, since its measured normal is noise [m]."""
LONGEST = 0.15
"""Largest standard deviation of a Gaussian on the ground [m]."""
BIN = 0.1
"""Lateral step in which the edge is sought [m]."""
LEVEL = 0.06
"""Points within this height of the route are level with it [m]."""
LEVEL_SHARE = 0.7
"""A strip is carriageway while this share of its low points is level [1]."""
LOW = 0.6
"""Points higher than this above the route are not ground [m]."""
NARROWEST = 1.0
"""Least half width, about half a car [m]."""
MEASURED_WELL = 14.0
"""Only points nearer than this to their camera decide about the edge [m]."""
HEIGHT_ERROR = 0.004
"""Growth of the height tolerance with distance from the camera [1]."""
FARTHEST = 60.0
"""Beyond this depth the tolerance grows no further [m]."""
GROUND = 0.3
"""Points within this height of the route, off the carriageway, are terrain [m]."""
GROUND_REACH = 15.0
"""Farther to the side, points are not classified as ground [m]."""


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """Gaussians with the ray of each and the carriageway's extent.

    Parameters
    ----------
    gaussians : N Gaussians, world frame
    rays : float64 [N, 3] world direction along which the depth of each is uncertain, per metre of depth [1]
    extents : left (positive) and right (negative) edge of the carriageway from the route [m]
    """

    gaussians: Gaussians
    rays: NDArray[np.float64]
    extents: tuple[float, float]


def build_cloud(
    surfels: Surfels,
    T_world_camera: NDArray[np.float64],
    route: Route,
    focal_length: float,
    disparity_scale: float,
    carriageway_limit: float,
) -> Cloud:
    """Build Gaussians from the samples: place, class, orientation and size.

    Parameters
    ----------
    surfels : N samples
    T_world_camera : float64 [N, 4, 4] pose of the camera that took each
    route : the route, on the road
    focal_length : of the camera [px]
    disparity_scale : focal length times baseline [px m]
    carriageway_limit : largest extent of the carriageway on either side [m]
    """
    R, t = T_world_camera[:, :3, :3], T_world_camera[:, :3, 3]
    rays = np.einsum("nij,nj->ni", R, surfels.rays)
    station, lateral, height = route.project(rays * surfels.depth[:, None] + t)
    extents = measure_carriageway(station, lateral, height, surfels.depth, route.length, carriageway_limit)
    class_id = classify_points(lateral, height, surfels.depth, extents)
    up = route.pose(np.clip(station, 0, route.length))[:, :3, 2]

    road = class_id == SemanticClass.ROAD
    depth = surfels.depth.copy()
    depth[road] *= _depth_factor_onto_route(
        height[road], -(rays[road] * up[road]).sum(axis=1), depth[road], disparity_scale
    )

    level = road | ((class_id == SemanticClass.TERRAIN) & (depth > FAR_GROUND))
    normals = turn_to_camera(surfels.normals, surfels.rays, LEAST_COSINE)
    normals[level] = np.einsum("nji,nj->ni", R[level], up[level])
    rotation, scales = derive_discs(surfels.rays, depth, normals, surfels.spacing, focal_length)
    rotation = R @ rotation

    ground = np.isin(class_id, (SemanticClass.ROAD, SemanticClass.TERRAIN))
    of, offset = _split_long_discs(scales[:, 0], ground)
    pieces = np.bincount(of, minlength=len(scales))
    means = rays * depth[:, None] + t
    means = means[of] + offset[:, None] * rotation[of, :, 0]
    scales = np.concatenate([scales[:, :1] / pieces[:, None], scales[:, 1:]], axis=1)[of]
    gaussians = Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=Rotation.from_matrix(rotation).as_quat(scalar_first=True)[of].astype(np.float32),
        scales=scales.astype(np.float32),
        opacities=np.full(len(of), INITIAL_OPACITY, dtype=np.float32),
        sh=((surfels.radiance - 0.5) / C0)[of, None, :].astype(np.float32),
        normals=np.ascontiguousarray(rotation[of, :, 2], dtype=np.float32),
        class_id=class_id[of],
        antialiased=True,
    )
    return Cloud(gaussians=gaussians, rays=rays[of], extents=extents)


def _depth_factor_onto_route(
    height: NDArray[np.float64],
    descent: NDArray[np.float64],
    depth: NDArray[np.float64],
    disparity_scale: float,
) -> NDArray[np.float64]:
    """Return the factor of a road point's depth that makes its height the most likely one.

    The height error of stereo grows as depth squared times the ray's descent; on the route the height is 0 except for
    the unevenness of the road. Near the camera the stereo height dominates, far away the route.

    Parameters
    ----------
    height : [N] measured height over the route [m]
    descent : [N] how far the ray descends per metre of depth [1]
    depth : [N] camera z [m]
    disparity_scale : focal length times baseline [px m]
    """
    error = depth**2 * descent * DISPARITY_ERROR / disparity_scale
    lowered = height * error**2 / (error**2 + SADDLE**2)
    return np.clip(1 + lowered / np.maximum(descent * depth, 1e-3), 0.5, 2.0)


def _split_long_discs(
    length: NDArray[np.float64], splittable: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Split Gaussians that are too long: return the parent of each piece, and its offset along the first axis.

    A disc seen at a grazing angle from afar is metres long. For a camera that later drives over it, it would cover the
    whole picture, since a Gaussian is projected as an ellipse around its middle.

    Parameters
    ----------
    length : [N] standard deviation along the first axis [m]
    splittable : bool [N] Gaussians that may be split
    """
    pieces = np.where(splittable, np.maximum(np.ceil(length / LONGEST), 1), 1).astype(np.int64)
    of = np.repeat(np.arange(len(length)), pieces)
    place = np.arange(len(of)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    distance = length / COVERAGE / pieces
    return of, (place - (pieces[of] - 1) / 2) * distance[of]


def measure_carriageway(
    station: NDArray[np.float64],
    lateral: NDArray[np.float64],
    height: NDArray[np.float64],
    depth: NDArray[np.float64],
    route_length: float,
    limit: float,
) -> tuple[float, float]:
    """Return the extent of the level strip around the route to the left (positive) and right (negative) [m].

    A kerb, a verge or parked cars end it: in either direction the first strip in which too few of the
    points near the ground are level with the route.

    Parameters
    ----------
    station, lateral, height : float64 [N] route coordinates of the points [m]
    depth : float64 [N] distance from the camera that measured them [m]
    route_length : points beyond the route do not count [m]
    limit : largest extent on either side [m]
    """
    used = (depth < MEASURED_WELL) & (np.abs(height) < LOW) & (station > 0) & (station < route_length)
    count = int(np.ceil(limit / BIN))
    strip = np.floor(lateral[used] / BIN).astype(np.int64) + count
    inside = (strip >= 0) & (strip < 2 * count)
    level = np.bincount(strip[inside], np.abs(height[used][inside]) < LEVEL, minlength=2 * count)
    total = np.bincount(strip[inside], minlength=2 * count)
    ended = level < LEVEL_SHARE * np.maximum(total, 1)
    left = next((k for k in range(count) if ended[count + k]), count) * BIN
    right = next((k for k in range(count) if ended[count - 1 - k]), count) * BIN
    return max(left, NARROWEST), -max(right, NARROWEST)


def classify_points(
    lateral: NDArray[np.float64],
    height: NDArray[np.float64],
    depth: NDArray[np.float64],
    extents: tuple[float, float],
) -> NDArray[np.uint8]:
    """Classify points: ROAD on the carriageway, TERRAIN on the ground beside it, OTHER elsewhere.

    Parameters
    ----------
    lateral, height : float64 [N] route coordinates [m]
    depth : float64 [N] distance from the camera that measured the point [m]
    extents : left (positive) and right (negative) edge of the carriageway [m]
    """
    tolerance = LEVEL + HEIGHT_ERROR * np.minimum(depth, FARTHEST)
    on_carriageway = (lateral < extents[0]) & (lateral > extents[1])
    road = on_carriageway & (np.abs(height) < tolerance)
    ground = ~on_carriageway & (np.abs(height) < GROUND + tolerance) & (np.abs(lateral) < GROUND_REACH)
    return np.select([road, ground], [SemanticClass.ROAD, SemanticClass.TERRAIN], SemanticClass.OTHER).astype(
        np.uint8
    )
