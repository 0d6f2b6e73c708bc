"""Intersection of a ray with the surfaces of a picture with depth; the ray starts near the picture's own camera.

The ray belongs to a pixel at another pose of the same readout: ``ray + w shift``, in axes of the picture's camera, is
the point of inverse depth w on it, times w. The search runs along its image from the nearest to the farthest depth of
that neighbourhood, so that near surfaces hide far ones.
"""

import numba
import numpy as np
from numpy.typing import NDArray

TILE = 16
"""Side of the tiles over which the nearest and farthest surfaces are noted; no point may move farther [px]."""
KINK = 0.1
"""Relative range of inverse depth over a pixel's neighbours above which they belong to two surfaces [1]."""

SLOPE = 0.01
"""Largest growth of inverse depth over a step at which a ray that lies behind a surface has met it [1]."""


def depth_bounds(near: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the least and the largest inverse depth of each tile and the eight around it [m-1]."""
    rows, columns = (-(-n // TILE) for n in near.shape)
    padded = np.pad(
        near, ((0, rows * TILE - near.shape[0]), (0, columns * TILE - near.shape[1])), mode="edge"
    )
    tiles = padded.reshape(rows, TILE, columns, TILE)
    bounds = []
    for extreme in (np.min, np.max):
        around = np.pad(extreme(tiles, axis=(1, 3)), 1, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(around, (3, 3))
        bounds.append(extreme(windows, axis=(2, 3)))
    return bounds[0], bounds[1]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _inverse_depth(near, u, v):  # type: ignore[no-untyped-def]
    """Return inverse depth at a place: bilinear, exact on planes; at an edge that of the nearest pixel [m-1]."""
    height, width = near.shape
    x = min(max(u - 0.5, 0.0), width - 1.001)
    y = min(max(v - 0.5, 0.0), height - 1.001)
    c, r = int(x), int(y)
    a, b, d, e = near[r, c], near[r, c + 1], near[r + 1, c], near[r + 1, c + 1]
    most = max(max(a, b), max(d, e))
    tx, ty = x - c, y - r
    if most - min(min(a, b), min(d, e)) > KINK * most:
        return np.float64(near[r + int(ty + 0.5), c + int(tx + 0.5)])
    return (1 - ty) * ((1 - tx) * a + tx * b) + ty * ((1 - tx) * d + tx * e)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def project_onto_picture(K, ray, shift, w):  # type: ignore[no-untyped-def]
    """Return the place in the wide picture of the point of inverse depth w on a row's ray [px]."""
    z = ray[2] + w * shift[2]
    return K[0] * (ray[0] + w * shift[0]) / z + K[2], K[1] * (ray[1] + w * shift[1]) / z + K[3]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _row_inverse_depth(q, ray, shift):  # type: ignore[no-untyped-def]
    """Return inverse depth in the row's camera of the ray's point of inverse depth q in the wide camera [m-1]."""
    return ray[2] * q / max(1 - shift[2] * q, 0.1)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _inverse_depth_range(near, nearest, farthest, K, ray, shift):  # type: ignore[no-untyped-def]
    """Return inverse depths in the row's camera of the ray's points at the nearest and farthest depth nearby [m-1]."""
    u, v = project_onto_picture(K, ray, shift, 0.0)
    row = min(max(int(v), 0), near.shape[0] - 1) // TILE
    column = min(max(int(u), 0), near.shape[1] - 1) // TILE
    return (
        _row_inverse_depth(np.float64(nearest[row, column]), ray, shift),
        _row_inverse_depth(np.float64(farthest[row, column]), ray, shift),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def parallax_range(near, nearest, farthest, K, ray, shift):  # type: ignore[no-untyped-def]
    """Return the distance of those two points in the wide picture [px]."""
    w, last = _inverse_depth_range(near, nearest, farthest, K, ray, shift)
    u, v = project_onto_picture(K, ray, shift, w)
    far_u, far_v = project_onto_picture(K, ray, shift, last)
    return max(abs(far_u - u), abs(far_v - v))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def nearest_surface(near, nearest, farthest, K, ray, shift):  # type: ignore[no-untyped-def]
    """Return the nearest surface on a ray: place in the wide picture [px], inverse depth in the row's camera [m-1]."""
    w, last = _inverse_depth_range(near, nearest, farthest, K, ray, shift)
    u, v = project_onto_picture(K, ray, shift, w)
    far_u, far_v = project_onto_picture(K, ray, shift, last)
    way = max(abs(far_u - u), abs(far_v - v))
    found = w
    if way > 0.05:
        # from the nearest depth nearby to the farthest, in steps of a third of a pixel
        steps = int(3 * way) + 1
        step = (w - last) / steps
        beside_u, beside_v, beside = u, v, last
        hit = False
        for k in range(steps + 1):
            here = w - k * step
            u, v = project_onto_picture(K, ray, shift, here)
            found = _row_inverse_depth(_inverse_depth(near, u, v), ray, shift)
            if found >= here - 1e-9:
                # a surface far in front of the ray's point is another object, and the ray passes behind it
                if found <= here + step + SLOPE * found:
                    hit = True
                    break
            else:
                beside_u, beside_v, beside = u, v, found
        if not hit:
            return int(beside_u) + 0.5, int(beside_v) + 0.5, beside
    else:
        found = _row_inverse_depth(_inverse_depth(near, u, v), ray, shift)
    for _ in range(2):
        next_u, next_v = project_onto_picture(K, ray, shift, found)
        again = _row_inverse_depth(_inverse_depth(near, next_u, next_v), ray, shift)
        if abs(again - found) > KINK * found:
            break
        u, v, found = next_u, next_v, again
    return u, v, found
