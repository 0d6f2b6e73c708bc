"""Classification of the road Gaussians of an unlabelled cloud by route, height and normal, and what is missing."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route

HEIGHT_TOLERANCE = 0.15
"""Signed height within which a Gaussian counts as the road's surface [m]."""
CELL = 2.0
"""Length of the stretches of a route that have a road below them or not [m]."""
ENOUGH = 0.5
"""Least share of a route below which a road has to lie [1]."""
UPRIGHT = np.cos(np.radians(30.0))
"""Least cosine of a road normal to the vertical: 30 degrees (paper, Appendix A.4) [1]."""


def classify_road(
    gaussians: Gaussians, route: Route, carriageway_left: float, carriageway_right: float
) -> Gaussians:
    """Return the cloud with the class ROAD on the carriageway; other classes stay. Road normals point up.

    Parameters
    ----------
    gaussians : the cloud
    route : its road plane and course
    carriageway_left, carriageway_right : lateral extent, left positive [m]
    """
    station, lateral, height = route.project(gaussians.means)
    up = route.pose(np.clip(station, 0, route.length))[:, :3, 2]
    cosine = np.einsum("ni,ni->n", gaussians.normals, up)
    road = (
        (lateral <= carriageway_left)
        & (lateral >= carriageway_right)
        & (np.abs(height) <= HEIGHT_TOLERANCE)
        & (np.abs(cosine) >= UPRIGHT)
    )
    flip = np.where(road & (cosine < 0), -1, 1).astype(np.float32)
    return replace(
        gaussians,
        normals=gaussians.normals * flip[:, None],
        class_id=np.where(road, SemanticClass.ROAD, gaussians.class_id).astype(np.uint8),
    )


def measure_coverage(gaussians: Gaussians, route: Route) -> float:
    """Return the share of the route's length that has road below it [1].

    Parameters
    ----------
    gaussians : with classes
    route : through them
    """
    station, _, _ = route.project(gaussians.means[np.isin(gaussians.class_id, ROAD_CLASSES)])
    return _cover(station, route)


def find_level_surface(
    gaussians: Gaussians, route: Route, carriageway_left: float, carriageway_right: float
) -> float | None:
    """Return the height above the route of a level surface that lies along most of it [m]; None where there is none.

    Parameters
    ----------
    gaussians : the cloud
    route : its road plane and course
    carriageway_left, carriageway_right : lateral extent, left positive [m]
    """
    station, lateral, height = route.project(gaussians.means)
    up = route.pose(np.clip(station, 0, route.length))[:, :3, 2]
    level = np.abs(np.einsum("ni,ni->n", gaussians.normals, up)) >= UPRIGHT
    level &= (lateral <= carriageway_left) & (lateral >= carriageway_right)
    level &= (station >= 0) & (station <= route.length)
    heights = np.sort(height[level])
    if not len(heights):
        return None
    # the band of the road's thickness that holds most of them
    held = np.searchsorted(heights, heights + 2 * HEIGHT_TOLERANCE, side="right") - np.arange(len(heights))
    lowest = heights[held.argmax()]
    band = level & (height >= lowest) & (height <= lowest + 2 * HEIGHT_TOLERANCE)
    return float(np.median(height[band])) if _cover(station[band], route) >= ENOUGH else None


def _cover(station: NDArray[np.float64], route: Route) -> float:
    cells = max(1, round(route.length / CELL))
    hit = np.floor(station / route.length * cells).astype(np.int64)
    return len(np.unique(hit[(hit >= 0) & (hit < cells)])) / cells
