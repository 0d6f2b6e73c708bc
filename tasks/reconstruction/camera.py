"""Rays of the sequence's camera. Its pixel centres lie at whole numbers, the rasteriser's at halves."""

import numpy as np
from numpy.typing import NDArray


def pixel_rays(shape: tuple[int, ...], intrinsics: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the camera rays with z = 1 of all pixels, float64 [H, W, 3]."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    return np.stack([columns, rows, np.ones(shape[:2])], axis=-1) @ np.linalg.inv(intrinsics).T


def rasteriser_intrinsics(intrinsics: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the camera matrix [3, 3] in the rasteriser's convention [px]."""
    shifted = intrinsics.copy()
    shifted[:2, 2] += 0.5
    return shifted
