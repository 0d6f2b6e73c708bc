"""Lens distortion by Brown and Conrady, in OpenCV's convention."""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError

NEWTON_STEPS = 20
ROUNDING = 1e-14
"""Distance from the distorted point below which further steps only change rounding [1]."""
CLOSED = 1e-9
"""Largest distance from its distorted place at which an undistorted point counts as found [1]."""


@dataclass(frozen=True, kw_only=True)
class Lens:
    """Coefficients of D. C. Brown, Decentering distortion of lenses, Photogrammetric Engineering 32 (1966) 444-462.

    Parameters
    ----------
    k1, k2, k3 : radial, of the second, fourth and sixth power of the distance from the axis [1]
    p1, p2 : tangential [1]
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """k1, k2, p1, p2, k3: the order in which OpenCV takes them [1]."""
        return np.array((self.k1, self.k2, self.p1, self.p2, self.k3))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def distort_rays(x, y, coefficients):  # type: ignore[no-untyped-def]
    """Return the distorted place of the ray (x, y, 1), for scalars and arrays, in kernels and outside.

    Parameters
    ----------
    x, y : right and down per forward [1]
    coefficients : float64 [5] k1, k2, p1, p2, k3 [1]

    Returns
    -------
    Distorted x and y [1]
    """
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )


def undistort_points(
    x: NDArray[np.float64], y: NDArray[np.float64], lens: Lens
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rays that the lens maps to given places, by Newton's method.

    Parameters
    ----------
    x, y : [...] distorted right and down per forward [1]
    lens : the lens

    Returns
    -------
    Undistorted x and y [1]

    Raises
    ------
    InputError
        Some place has no ray: the polynomial is not monotonic inside the picture.
    """
    k = lens.coefficients
    step = 1e-6
    found_x, found_y = x.copy(), y.copy()
    for _ in range(NEWTON_STEPS):
        here_x, here_y = distort_rays(found_x, found_y, k)
        right = distort_rays(found_x + step, found_y, k)
        below = distort_rays(found_x, found_y + step, k)
        a, c = (right[0] - here_x) / step, (right[1] - here_y) / step
        b, d = (below[0] - here_x) / step, (below[1] - here_y) / step
        area = a * d - b * c
        if not (area > 0).all():
            break
        off_x, off_y = x - here_x, y - here_y
        if max(np.abs(off_x).max(), np.abs(off_y).max()) < ROUNDING:
            break
        found_x, found_y = found_x + (d * off_x - b * off_y) / area, found_y + (a * off_y - c * off_x) / area
    here_x, here_y = distort_rays(found_x, found_y, k)
    miss = np.hypot(here_x - x, here_y - y)
    if not (miss <= CLOSED).all():
        raise InputError(
            f"camera: the lens must spread the whole picture; its distortion {k.tolist()} (k1, k2, p1, p2, k3)"
            f" turns back within {np.hypot(x, y).max():.3f} focal lengths of the axis: take weaker coefficients"
        )
    return found_x, found_y


def pixel_directions(
    K: NDArray[np.float64], width: int, height: int, lens: Lens | None
) -> NDArray[np.float64]:
    """Return the directions of a camera's pixels.

    Parameters
    ----------
    K : [3, 3] intrinsics, pixel centres at +0.5 [px]
    width, height : picture size [px]
    lens : None for a pinhole

    Returns
    -------
    float64 [H, W, 2] right and down per forward [1]

    Raises
    ------
    InputError
        The lens model is not monotonic over the whole picture.
    """
    x, y = np.meshgrid(
        (np.arange(width) + 0.5 - K[0, 2]) / K[0, 0], (np.arange(height) + 0.5 - K[1, 2]) / K[1, 1]
    )
    if lens is not None:
        x, y = undistort_points(x, y, lens)
    return np.stack((x, y), axis=-1)
