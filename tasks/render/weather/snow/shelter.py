"""Shelter: a thing above a place keeps falling snow from it, such as a crown, a roof, a scaffold's upper planks."""

import numpy as np
from numpy.typing import NDArray

from tasks.scene.gaussians import Gaussians

CELL_M = 0.15
"""Edge of the cells; what lies in a Gaussian's own cell or the one above belongs to the surface it is part of."""
SOLID_SHARE = 2 * np.pi
"""Area that a flat Gaussian shades by the product of its two standard deviations [1]."""


def open_share(gaussians: Gaussians) -> NDArray[np.float64]:
    """Share of what falls straight down that reaches each Gaussian, through all that lies higher.

    Each Gaussian above lets through exp(-area / area of the cell), Beer's law as Monsi and Saeki (1953,
    doi:10.1093/aob/mci052) have it for leaves strewn at random.

    Parameters
    ----------
    gaussians : the scene

    Returns
    -------
    float64 [N] share [1]
    """
    cell = np.floor(gaussians.means / CELL_M).astype(np.int64)
    cell -= cell.min(axis=0)
    x, y, z = cell.T
    levels = int(z.max()) + 3
    column = (x * (int(y.max()) + 1) + y) * levels
    scales = np.sort(gaussians.scales, axis=1).astype(np.float64)
    level = np.abs(gaussians.normals[:, 2].astype(np.float64)) * gaussians.opacities
    shade = SOLID_SHARE * scales[:, 1] * scales[:, 2] * level / CELL_M**2
    filled, own = np.unique(column + z, return_inverse=True)
    below = np.concatenate(([0.0], np.cumsum(np.bincount(own, shade))))
    top = below[np.searchsorted(filled, column + levels)]
    above = top - below[np.searchsorted(filled, column + z + 2)]
    return np.exp(-np.maximum(above, 0))
