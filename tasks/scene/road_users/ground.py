"""What a road user meets: the ground below it, what stands in its way, and other road users."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene

Floats = NDArray[np.float64]

GROUND = (*ROAD_CLASSES, SemanticClass.KERB, SemanticClass.SIDEWALK, SemanticClass.TERRAIN)
SOLID = (SemanticClass.BUILDING, SemanticClass.VEHICLE, SemanticClass.POLE, SemanticClass.OTHER)
"""Classes that no body passes through; crowns of trees hang above the road."""
NEAR_M, NEIGHBOURS = 0.6, 5
"""Distance within which the ground is read off the scene [m], and number of its Gaussians [1]."""
CLEARANCE_M, LOWEST_M, LEAST_HITS = 0.1, 0.35, 4
"""Part of a body's box at its sides that may touch [m], its lower part that is not asked for, above kerbs [m], and
Gaussians inside that are an obstacle and no stray ones [1]."""


def measure_ground(places: Floats, scene: Scene) -> Floats:
    """Return by how much the ground beside the carriageway lies above places [N, 3] of the road's plane [N] [m].

    Parameters
    ----------
    places : on the plane of the route, world frame [m]
    scene : with classes
    """
    rise = np.zeros(len(places))
    _, lateral, _ = scene.route.project(places)
    beside = np.flatnonzero((lateral > scene.carriageway_left) | (lateral < scene.carriageway_right))
    if not len(beside):
        return rise
    cloud = scene.gaussians
    low, high = places[beside, :2].min(axis=0) - NEAR_M, places[beside, :2].max(axis=0) + NEAR_M
    near = ((cloud.means[:, :2] > low) & (cloud.means[:, :2] < high)).all(axis=1)
    near &= np.isin(cloud.class_id, GROUND)
    ground = cloud.means[near].astype(np.float64)
    if len(ground) < NEIGHBOURS:
        return rise
    distance, index = cKDTree(ground[:, :2]).query(places[beside, :2], k=NEIGHBOURS)
    height = np.median(ground[index, 2], axis=1) - places[beside, 2]
    rise[beside] = np.where(distance[:, -1] < NEAR_M, height, 0.0)
    return rise


def find_obstacle(T_world_body: Floats, size: Floats, cloud: Gaussians) -> tuple[int, SemanticClass] | None:
    """Return the first pose in which a body is in a solid thing, and its class; None where the way is free.

    Parameters
    ----------
    T_world_body : float64 [N, 4, 4] [m]
    size : float64 [3] length, width and height of its box [m]
    cloud : the street
    """
    reach = float(np.hypot(*size[:2])) / 2
    low, high = T_world_body[:, :3, 3].min(axis=0) - reach, T_world_body[:, :3, 3].max(axis=0) + reach
    high[2] += size[2]
    near = ((cloud.means > low) & (cloud.means < high)).all(axis=1) & np.isin(cloud.class_id, SOLID)
    points, kinds = cloud.means[near].astype(np.float64), cloud.class_id[near]
    half = size[:2] / 2 - CLEARANCE_M
    for number, pose in enumerate(T_world_body):
        local = (points - pose[:3, 3]) @ pose[:3, :3]
        inside = (
            (np.abs(local[:, :2]) < half).all(axis=1) & (local[:, 2] > LOWEST_M) & (local[:, 2] < size[2])
        )
        if inside.sum() >= LEAST_HITS:
            return number, SemanticClass(int(np.bincount(kinds[inside]).argmax()))
    return None


def find_meeting(first: Floats, first_size: Floats, second: Floats, second_size: Floats) -> int | None:
    """Return the first pose in which the footprints of two bodies overlap; None where they never do.

    Two rectangles are apart if they are along a side of either (separating axes).

    Parameters
    ----------
    first, second : float64 [N, 4, 4] poses of both at the same times [m]
    first_size, second_size : float64 [3] length, width and height of their boxes [m]
    """
    apart = np.zeros(len(first), np.bool_)
    between = second[:, :2, 3] - first[:, :2, 3]
    for axes in (first[:, :2, :2], second[:, :2, :2]):
        for k in (0, 1):
            axis = axes[:, :, k]
            reach = sum(
                np.abs(np.einsum("ni,nij->nj", axis, poses[:, :2, :2])) @ (size[:2] / 2)
                for poses, size in ((first, first_size), (second, second_size))
            )
            apart |= np.abs(np.einsum("ni,ni->n", axis, between)) > reach
    return None if apart.all() else int((~apart).argmax())
