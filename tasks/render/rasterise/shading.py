"""Colours of prepared Gaussians by their spherical harmonics, 64 at a time in vector lanes."""

import numba
import numpy as np

from tasks.render.rasterise.preparation import BLOCK, SH
from tasks.scene.spherical_harmonics import C0, C1, C2, C3

# The kernels work in float32: a Python float in an expression would widen it to float64.
_C0, _C1 = np.float32(C0), np.float32(C1)
_C20, _C21, _C22 = (np.float32(c) for c in C2)
_C30, _C31, _C32, _C33, _C34 = (np.float32(c) for c in C3)
_HALF, _ZERO, _TWO, _THREE, _FOUR = (np.float32(c) for c in (0.5, 0, 2, 3, 4))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _load_vector(planes, l):  # type: ignore[no-untyped-def]
    return planes[l], planes[BLOCK + l], planes[2 * BLOCK + l]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _store_vector(planes, l, values):  # type: ignore[no-untyped-def]
    planes[l], planes[BLOCK + l], planes[2 * BLOCK + l] = values


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add_basis_share(rgb, block, k, l, value):  # type: ignore[no-untyped-def]
    """Add the contribution of basis function k in lane l."""
    plane = SH + 3 * k
    red = rgb[0] + value * block[plane, l]
    green = rgb[1] + value * block[plane + 1, l]
    blue = rgb[2] + value * block[plane + 2, l]
    return red, green, blue


@numba.njit(cache=True, nogil=True, error_model="numpy")
def shade_lanes(directions, block, colours):  # type: ignore[no-untyped-def]
    """Compute the colours max(SH + 1/2, 0) of one block of Gaussians as `sh_basis` does, one vector lane each.

    Parameters
    ----------
    directions : float32 [3 * 64] unit vectors from the camera, plane after plane [1]
    block : float32 [P, 64] a block of `PreparedGaussians`
    colours : float32 [3 * 64 or more] overwritten with the colours, plane after plane [1]
    """
    count = (block.shape[0] - SH) // 3
    for l in range(BLOCK):
        _store_vector(colours, l, _add_basis_share((_HALF, _HALF, _HALF), block, 0, l, _C0))
    if count > 1:
        for l in range(BLOCK):
            x, y, z = _load_vector(directions, l)
            rgb = _load_vector(colours, l)
            rgb = _add_basis_share(rgb, block, 1, l, -_C1 * y)
            rgb = _add_basis_share(rgb, block, 2, l, _C1 * z)
            rgb = _add_basis_share(rgb, block, 3, l, -_C1 * x)
            _store_vector(colours, l, rgb)
    if count > 4:
        for l in range(BLOCK):
            x, y, z = _load_vector(directions, l)
            rgb = _load_vector(colours, l)
            rgb = _add_basis_share(rgb, block, 4, l, _C20 * x * y)
            rgb = _add_basis_share(rgb, block, 5, l, -_C20 * y * z)
            rgb = _add_basis_share(rgb, block, 6, l, _C21 * (_TWO * z * z - x * x - y * y))
            rgb = _add_basis_share(rgb, block, 7, l, -_C20 * x * z)
            rgb = _add_basis_share(rgb, block, 8, l, _C22 * (x * x - y * y))
            _store_vector(colours, l, rgb)
    if count > 9:
        for l in range(BLOCK):
            x, y, z = _load_vector(directions, l)
            xx, yy, zz = x * x, y * y, z * z
            rgb = _load_vector(colours, l)
            rgb = _add_basis_share(rgb, block, 9, l, -_C30 * y * (_THREE * xx - yy))
            rgb = _add_basis_share(rgb, block, 10, l, _C31 * x * y * z)
            rgb = _add_basis_share(rgb, block, 11, l, -_C32 * y * (_FOUR * zz - xx - yy))
            rgb = _add_basis_share(rgb, block, 12, l, _C33 * z * (_TWO * zz - _THREE * xx - _THREE * yy))
            rgb = _add_basis_share(rgb, block, 13, l, -_C32 * x * (_FOUR * zz - xx - yy))
            rgb = _add_basis_share(rgb, block, 14, l, _C34 * z * (xx - yy))
            rgb = _add_basis_share(rgb, block, 15, l, -_C30 * x * (xx - _THREE * yy))
            _store_vector(colours, l, rgb)
    for l in range(3 * BLOCK):
        colours[l] = max(colours[l], _ZERO)
