"""A checked pinhole camera in the form that projection takes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError

RAY_MARGIN = 0.3
"""The Jacobian is taken at most this share of the half field of view outside the picture [1]."""


@dataclass(frozen=True, kw_only=True)
class View:
    """A pinhole camera as the kernels take it.

    Parameters
    ----------
    viewmat : float64 [4, 4] world to camera, x right, y down, z forward
    K : float64 [3, 3] intrinsics, pixel centres at +0.5 [px]
    width, height : picture size [px]
    """

    viewmat: NDArray[np.float64]
    K: NDArray[np.float64]
    width: int
    height: int

    @property
    def eye(self) -> NDArray[np.float64]:
        """Camera centre, world frame [m]."""
        return -(self.viewmat[:3, :3] * self.viewmat[:3, 3:]).sum(axis=0)

    def to_camera(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World points [N, 3] in camera axes [m]; no BLAS, whose rounding depends on the processor."""
        R, t = self.viewmat[:3, :3], self.viewmat[:3, 3]
        return points[:, :1] * R[:, 0] + points[:, 1:2] * R[:, 1] + points[:, 2:] * R[:, 2] + t

    @property
    def rays(self) -> NDArray[np.float64]:
        """World direction of picture point (u, v) as ``rays[0] u + rays[1] v + rays[2]``, with camera z 1 [1]."""
        R, K = self.viewmat[:3, :3], self.K
        right, down = R[0] / K[0, 0], R[1] / K[1, 1]
        return np.stack((right, down, R[2] - K[0, 2] * right - K[1, 2] * down))

    @property
    def ray_limits(self) -> NDArray[np.float64]:
        """Lowest and highest x/z, then y/z, at which the Jacobian is taken [1]."""
        f, c = np.array((self.K[0, 0], self.K[1, 1])), self.K[:2, 2]
        size = np.array((self.width, self.height))
        margin = RAY_MARGIN * 0.5 * size / f
        return np.column_stack((-c / f - margin, (size - c) / f + margin)).ravel()


def view_of(viewmat: NDArray[np.floating], K: NDArray[np.floating], width: int, height: int) -> View:
    """Check a camera and return it as a `View`.

    Raises
    ------
    InputError
        A matrix has the wrong shape or a NaN, a focal length or the picture size is not positive.
    """
    viewmat, K = np.asarray(viewmat), np.asarray(K)
    problems = []
    for name, matrix, shape in (("viewmat", viewmat, (4, 4)), ("K", K, (3, 3))):
        if matrix.shape != shape or not np.isfinite(matrix).all():
            problems.append(f"camera: {name} must be a finite {shape} matrix; it is {matrix.tolist()}")
    if not problems and not (K[0, 0] > 0 and K[1, 1] > 0):
        problems.append(f"camera: focal lengths must be positive; they are {K[0, 0]} and {K[1, 1]}")
    if width < 1 or height < 1:
        problems.append(f"camera: the picture must have at least one pixel; its size is {width} x {height}")
    if problems:
        raise InputError(problems)
    return View(
        viewmat=viewmat.astype(np.float64), K=K.astype(np.float64), width=int(width), height=int(height)
    )
