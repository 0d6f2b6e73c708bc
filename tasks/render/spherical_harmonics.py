"""Real spherical harmonics up to degree 3, in the band order and signs of the INRIA layout."""

from math import pi, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

C0 = 0.5 * sqrt(1 / pi)
C1 = 0.5 * sqrt(3 / pi)
C2 = (0.5 * sqrt(15 / pi), 0.25 * sqrt(5 / pi), 0.25 * sqrt(15 / pi))
C3 = (
    0.25 * sqrt(35 / (2 * pi)),
    0.5 * sqrt(105 / pi),
    0.25 * sqrt(21 / (2 * pi)),
    0.25 * sqrt(7 / pi),
    0.25 * sqrt(105 / pi),
)

# The kernels work in float32: a Python float in an expression would widen it to float64.
_C0, _C1 = np.float32(C0), np.float32(C1)
_C20, _C21, _C22 = (np.float32(c) for c in C2)
_C30, _C31, _C32, _C33, _C34 = (np.float32(c) for c in C3)
_HALF, _ZERO, _TWO, _THREE, _FOUR = (np.float32(c) for c in (0.5, 0, 2, 3, 4))


def sh_basis(directions: NDArray[np.floating], count: int) -> NDArray[np.float64]:
    """Values of the first ``count`` basis functions (Kerbl et al. 2023, doi:10.1145/3592433, their code's order).

    Parameters
    ----------
    directions : [..., 3] unit vectors from the camera to the Gaussian, world frame [1]
    count : number of functions: 1, 4, 9 or 16 [1]

    Returns
    -------
    float64 [..., count] basis values [1]
    """
    x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    values = [
        np.full_like(x, C0),
        -C1 * y,
        C1 * z,
        -C1 * x,
        C2[0] * x * y,
        -C2[0] * y * z,
        C2[1] * (2 * z * z - x * x - y * y),
        -C2[0] * x * z,
        C2[2] * (x * x - y * y),
        -C3[0] * y * (3 * x * x - y * y),
        C3[1] * x * y * z,
        -C3[2] * y * (4 * z * z - x * x - y * y),
        C3[3] * z * (2 * z * z - 3 * x * x - 3 * y * y),
        -C3[2] * x * (4 * z * z - x * x - y * y),
        C3[4] * z * (x * x - y * y),
        -C3[0] * x * (x * x - 3 * y * y),
    ]
    return np.stack(values[:count], axis=-1)


@numba.njit(cache=True, nogil=True)
def shade_lanes(s, direction, basis, rgb, block, sh, count, lanes):  # type: ignore[no-untyped-def]
    """Colours max(SH + 1/2, 0) of one block, `sh_basis` written for vector lanes.

    Parameters
    ----------
    s : float32 scratch; ``direction``, ``basis`` and ``rgb`` are offsets into it of 3, 16 and 3 planes
    block : float32 [P, lanes] whose planes from ``sh`` on hold 3 ``count`` coefficients [1]
    """
    for l in range(lanes):
        s[basis + l] = _C0
    if count > 1:
        for l in range(lanes):
            x, y, z = s[direction + l], s[direction + lanes + l], s[direction + 2 * lanes + l]
            s[basis + lanes + l] = -_C1 * y
            s[basis + 2 * lanes + l] = _C1 * z
            s[basis + 3 * lanes + l] = -_C1 * x
    if count > 4:
        for l in range(lanes):
            x, y, z = s[direction + l], s[direction + lanes + l], s[direction + 2 * lanes + l]
            s[basis + 4 * lanes + l] = _C20 * x * y
            s[basis + 5 * lanes + l] = -_C20 * y * z
            s[basis + 6 * lanes + l] = _C21 * (_TWO * z * z - x * x - y * y)
            s[basis + 7 * lanes + l] = -_C20 * x * z
            s[basis + 8 * lanes + l] = _C22 * (x * x - y * y)
    if count > 9:
        for l in range(lanes):
            x, y, z = s[direction + l], s[direction + lanes + l], s[direction + 2 * lanes + l]
            xx, yy, zz = x * x, y * y, z * z
            s[basis + 9 * lanes + l] = -_C30 * y * (_THREE * xx - yy)
            s[basis + 10 * lanes + l] = _C31 * x * y * z
            s[basis + 11 * lanes + l] = -_C32 * y * (_FOUR * zz - xx - yy)
            s[basis + 12 * lanes + l] = _C33 * z * (_TWO * zz - _THREE * xx - _THREE * yy)
            s[basis + 13 * lanes + l] = -_C32 * x * (_FOUR * zz - xx - yy)
            s[basis + 14 * lanes + l] = _C34 * z * (xx - yy)
            s[basis + 15 * lanes + l] = -_C30 * x * (xx - _THREE * yy)
    for c in range(3):
        for l in range(lanes):
            s[rgb + c * lanes + l] = _HALF
        for k in range(count):
            for l in range(lanes):
                s[rgb + c * lanes + l] += s[basis + k * lanes + l] * block[sh + 3 * k + c, l]
        for l in range(lanes):
            s[rgb + c * lanes + l] = max(s[rgb + c * lanes + l], _ZERO)
