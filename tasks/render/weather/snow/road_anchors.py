"""Which Gaussians are the road's surface, and how that surface lies (paper, Appendix A.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.weather.ground_grid import ground_grid, window_sums
from tasks.scene.gaussians import Gaussians

PLANE_CELL_M = 0.5
"""Neighbours are the road Gaussians of 3 x 3 such cells."""


@dataclass(frozen=True, kw_only=True)
class AnchorParameters:
    """Limits within which a road Gaussian carries snow.

    Parameters
    ----------
    height_tolerance_m : largest distance from the local road plane [m]
    tilt_limit_deg : largest tilt of the normal from up [deg]
    flatness : shortest by middle axis below which a Gaussian's own axis is its normal [1]
    """

    height_tolerance_m: float
    tilt_limit_deg: float
    flatness: float


@dataclass(frozen=True, kw_only=True)
class RoadAnchors:
    """Road Gaussians that carry snow.

    Parameters
    ----------
    index : int64 [A] their numbers in the cloud [1]
    normal : float64 [A, 3] unit normals of the surface there, upward [1]
    flat : bool [A] the normal is the Gaussian's own shortest axis
    """

    index: NDArray[np.int64]
    normal: NDArray[np.float64]
    flat: NDArray[np.bool_]


def road_anchors(
    gaussians: Gaussians, parameters: AnchorParameters, lift: NDArray[np.floating] | None = None
) -> RoadAnchors:
    """Gaussians of the road surface that carry snow.

    An anchor is of a road class, lies within the height tolerance of the plane through its neighbours, and its
    normal is within the tilt limit of up. The normal is the shortest axis where the Gaussian is flat enough,
    else the neighbours' plane.

    Parameters
    ----------
    gaussians : the scene
    parameters : tolerance and limits
    lift : [N] height of a road feature that each Gaussian lies on, which is no distance from the road [m]; None
        for a road as it was built

    Returns
    -------
    RoadAnchors
    """
    p = parameters
    index = np.flatnonzero(np.isin(gaussians.class_id, ROAD_CLASSES))
    if not len(index):
        return RoadAnchors(index=index, normal=np.empty((0, 3)), flat=np.empty(0, dtype=bool))
    means = gaussians.means[index].astype(np.float64)
    height, slope = _local_planes(means)
    normal = np.column_stack((-slope, np.ones(len(index))))
    scales = np.sort(gaussians.scales[index], axis=1)
    flat = scales[:, 0] < p.flatness * scales[:, 1]
    normal[flat] = _shortest_axes(gaussians.quats_wxyz[index[flat]], gaussians.scales[index[flat]])
    normal *= np.where(normal[:, 2] < 0, -1.0, 1.0)[:, None]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    upright = normal[:, 2] >= np.cos(np.deg2rad(p.tilt_limit_deg))
    level = means
    if lift is not None:
        level = means - np.outer(lift[index], (0, 0, 1))
        height, _ = _local_planes(level)
    near = np.abs(level[:, 2] - height) <= p.height_tolerance_m
    kept = upright & near
    return RoadAnchors(index=index[kept], normal=normal[kept], flat=flat[kept])


def _local_planes(means: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Height and slope, at every point, of the least-squares plane through its neighbours."""
    grid = ground_grid(means[:, :2], PLANE_CELL_M)
    centre = means.mean(axis=0)
    x, y, z = (means - centre).T
    ones = np.ones(len(x))
    sums = window_sums(
        grid, means[:, :2], np.column_stack((ones, x, y, z, x * x, x * y, y * y, x * z, y * z))
    )
    cells = np.floor((means[:, :2] - grid.origin) / grid.cell_m).astype(np.int64)
    n, sx, sy, sz, sxx, sxy, syy, sxz, syz = sums[cells[:, 0], cells[:, 1]].T
    mx, my, mz = sx / n, sy / n, sz / n
    # a thousandth of a cell's spread keeps lone points solvable: their plane is level
    ridge = 1e-3 * PLANE_CELL_M**2
    a, b, c = sxx / n - mx * mx + ridge, sxy / n - mx * my, syy / n - my * my + ridge
    u, v = sxz / n - mx * mz, syz / n - my * mz
    slope = np.column_stack((c * u - b * v, a * v - b * u)) / (a * c - b * b)[:, None]
    height = mz + slope[:, 0] * (x - mx) + slope[:, 1] * (y - my) + centre[2]
    return height, slope


def _shortest_axes(quats_wxyz: NDArray[np.floating], scales: NDArray[np.floating]) -> NDArray[np.float64]:
    """World direction of each Gaussian's shortest axis."""
    w, x, y, z = np.asarray(quats_wxyz, dtype=np.float64).T
    columns = np.stack(
        (
            np.column_stack((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))),
            np.column_stack((2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x))),
            np.column_stack((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))),
        ),
        axis=1,
    )
    return columns[np.arange(len(w)), np.argmin(scales, axis=1)]
