"""The sky and far field behind the Gaussians, from an equirectangular panorama."""

from math import floor, pi, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, run_on_either

_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)
_QUARTER_TURN, _HALF_TURN = np.float32(pi / 2), np.float32(pi)
_PER_TURN, _PER_HALF_TURN = np.float32(1 / (2 * pi)), np.float32(1 / pi)
_SMALLEST = np.float32(1e-30)
# Least squares in Chebyshev points for arctan(x) / x over x^2 in [0, 1]; with single precision's rounding, to 6e-7 rad.
_A0, _A1, _A2, _A3, _A4, _A5, _A6 = (
    np.float32(c)
    for c in (0.99999933, -0.33326375, 0.19879872, -0.13480406, 0.083741557, -0.036898629, 0.0078254829)
)


@numba.njit(**LAW)
def direction_angle(y, x):  # type: ignore[no-untyped-def]
    """Return the angle of the vector (x, y) from +x to +y, in single precision and without a branch.

    A tenth of the time of the library's function, and the same bits with every library.

    Parameters
    ----------
    y, x : float32, not both 0 [1]

    Returns
    -------
    float32 in [-pi, pi] [rad]
    """
    across, along = abs(y), abs(x)
    steep = across > along
    slope = min(across, along) / max(max(across, along), _SMALLEST)
    q = slope * slope
    angle = slope * (_A0 + q * (_A1 + q * (_A2 + q * (_A3 + q * (_A4 + q * (_A5 + q * _A6))))))
    angle = _QUARTER_TURN - angle if steep else angle
    angle = _HALF_TURN - angle if x < _ZERO else angle
    return -angle if y < _ZERO else angle


@numba.njit(**LAW)
def find_on_panorama(x, y, z, rows, columns):  # type: ignore[no-untyped-def]
    """Return row and column of an equirectangular picture in the direction (x, y, z), float32 of any length [px]."""
    row = (_HALF - direction_angle(z, np.float32(sqrt(x * x + y * y))) * _PER_HALF_TURN) * np.float32(
        rows
    ) - _HALF
    column = (_HALF - direction_angle(y, x) * _PER_TURN) * np.float32(columns) - _HALF
    return row, column


@numba.njit(**LAW)
def blend_panorama(panorama, row, column, out):  # type: ignore[no-untyped-def]
    """Write the picture [H, W, 3] at a place of `find_on_panorama` into ``out`` [3]: bilinear, wrapped in azimuth."""
    height, width = panorama.shape[:2]
    r0, c0 = np.int64(floor(row)), np.int64(floor(column))
    tr, tc = row - np.float32(r0), column - np.float32(c0)
    top, bottom = min(max(r0, 0), height - 1), min(max(r0 + 1, 0), height - 1)
    left = width - 1 if c0 < 0 else min(c0, width - 1)
    right = left + 1 if left + 1 < width else 0
    for c in range(3):
        above = (_ONE - tc) * panorama[top, left, c] + tc * panorama[top, right, c]
        below = (_ONE - tc) * panorama[bottom, left, c] + tc * panorama[bottom, right, c]
        out[c] = (_ONE - tr) * above + tr * below


@numba.njit(**LAW)
def sample_panorama(panorama, x, y, z, out):  # type: ignore[no-untyped-def]
    """Bilinear look-up of an equirectangular picture in the direction (x, y, z), any length, into ``out`` [3]."""
    row, column = find_on_panorama(
        np.float32(x), np.float32(y), np.float32(z), panorama.shape[0], panorama.shape[1]
    )
    blend_panorama(panorama, row, column, out)


def environment_view(
    environment: NDArray[np.float32],
    viewmat: NDArray[np.float64],
    K: NDArray[np.float64],
    width: int,
    height: int,
) -> NDArray[np.float32]:
    """Return the part of the panorama that a view sees, bilinear, wrapped in azimuth.

    Parameters
    ----------
    environment : float32 [He, We, 3] row 0 zenith, column centre world +x, leftward columns toward +y; the view is
        computed where it lies [1]
    viewmat : [4, 4] world to camera
    K : [3, 3] intrinsics [px]
    width, height : picture size [px]

    Returns
    -------
    float32 [height, width, 3] [1]
    """
    across = (np.arange(width) + 0.5 - K[0, 2]) / K[0, 0]
    down = (np.arange(height) + 0.5 - K[1, 2]) / K[1, 1]
    rotation = np.ascontiguousarray(viewmat[:3, :3], dtype=np.float64)
    if isinstance(environment, np.ndarray):
        environment = np.ascontiguousarray(environment)
        seen = np.empty((height, width, 3), dtype=np.float32)
    else:
        seen = environment.new_empty((height, width, 3))
    _view_panorama(seen, environment, rotation, across, down)
    return seen


@numba.njit(**INLINED)
def _place_pixel(i, j, rotation, across, down, rows, columns):  # type: ignore[no-untyped-def]
    right, below, ahead = rotation[0], rotation[1], rotation[2]
    x = np.float32(across[j] * right[0] + down[i] * below[0] + ahead[0])
    y = np.float32(across[j] * right[1] + down[i] * below[1] + ahead[1])
    z = np.float32(across[j] * right[2] + down[i] * below[2] + ahead[2])
    return find_on_panorama(x, y, z, rows, columns)


@numba.njit(**INLINED)
def _view_pixel(i, j, seen, panorama, rotation, across, down):  # type: ignore[no-untyped-def]
    row, column = _place_pixel(i, j, rotation, across, down, panorama.shape[0], panorama.shape[1])
    blend_panorama(panorama, row, column, seen[i, j])


@run_on_either(_view_pixel)
@numba.njit(cache=True, nogil=True, error_model="numpy")
def _view_panorama(seen, panorama, rotation, across, down):  # type: ignore[no-untyped-def]
    rows, columns = panorama.shape[:2]
    row, column = np.empty(len(across), dtype=np.float32), np.empty(len(across), dtype=np.float32)
    for i in range(len(down)):
        # a loop of its own, without gathers, that the compiler turns into vector code
        for j in range(len(across)):
            row[j], column[j] = _place_pixel(i, j, rotation, across, down, rows, columns)
        for j in range(len(across)):
            blend_panorama(panorama, row[j], column[j], seen[i, j])


def plain_sky() -> NDArray[np.float32]:
    """Return a cloudless gradient from blue zenith to pale horizon over grey ground, for scenes without a sky.

    Returns
    -------
    float32 [64, 128, 3] linear [1]
    """
    rows = 64
    elevation = np.linspace(np.pi / 2, -np.pi / 2, rows)[:, None]
    horizon, zenith, ground = np.array([[0.70, 0.76, 0.82], [0.16, 0.30, 0.60], [0.18, 0.18, 0.17]])
    above = horizon + (zenith - horizon) * np.sin(np.clip(elevation, 0, None)) ** 0.5
    column = np.where(elevation >= 0, above, ground).astype(np.float32)
    return np.repeat(column[:, None, :], 2 * rows, axis=1)
