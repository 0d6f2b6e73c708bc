"""Local means over the ground: square cells in the plane, read smoothly between their centres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, uniform_filter


@dataclass(frozen=True, kw_only=True)
class GroundGrid:
    """Cells that cover a set of points.

    Parameters
    ----------
    origin : float64 [2] corner of the first cell [m]
    cell_m : edge of a cell [m]
    shape : number of cells along x and y [1]
    """

    origin: NDArray[np.float64]
    cell_m: float
    shape: tuple[int, int]


def ground_grid(points: NDArray[np.floating], cell_m: float) -> GroundGrid:
    """Cells over all points, with one cell of margin.

    Parameters
    ----------
    points : [N, 2] world x, y; N at least 1 [m]
    cell_m : edge of a cell [m]

    Returns
    -------
    GroundGrid
    """
    origin = (np.floor(points.min(axis=0) / cell_m) - 1) * cell_m
    counts = np.ceil((points.max(axis=0) - origin) / cell_m).astype(int) + 2
    shape = (int(counts[0]), int(counts[1]))
    return GroundGrid(origin=np.asarray(origin, dtype=np.float64), cell_m=cell_m, shape=shape)


def window_sums(
    grid: GroundGrid, points: NDArray[np.floating], values: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Sums over windows of 3 x 3 cells, by the points that lie in them.

    Parameters
    ----------
    grid : the cells
    points : [N, 2] world x, y [m]
    values : [N, C] what to sum [any]

    Returns
    -------
    float64 [shape, C] sums [any]
    """
    cells = np.floor((points - grid.origin) / grid.cell_m).astype(np.int64)
    flat = cells[:, 0] * grid.shape[1] + cells[:, 1]
    sums = [np.bincount(flat, weights=column, minlength=grid.shape[0] * grid.shape[1]) for column in values.T]
    boxes = np.stack(sums, axis=-1).reshape(*grid.shape, -1)
    return uniform_filter(boxes, size=(3, 3, 1), mode="constant") * 9


def read_between(
    grid: GroundGrid, cells: NDArray[np.floating], points: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Cell values at points, linear between the cells' centres.

    Parameters
    ----------
    grid : the cells
    cells : [shape] one value per cell [any]
    points : [N, 2] world x, y [m]

    Returns
    -------
    float64 [N] values [any]
    """
    place = (np.asarray(points, dtype=np.float64) - grid.origin) / grid.cell_m - 0.5
    return map_coordinates(cells, place.T, order=1, mode="nearest")
