"""Fusion of depth maps: surfaces that several pictures confirm, and the picture that shows each one largest."""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

AGREEMENT = 1.0
"""Largest difference of predicted and measured disparity of one surface [px]."""
SEE_THROUGH = 1.5
"""Disparity deficit above which another picture sees through the surface [px]."""
CHECK_OFFSETS = (-6, -4, -3, -2, -1, 1, 2, 3, 4, 6)
"""Places in the training sequence whose depth is compared with a picture's own [1]."""
FINER_OFFSETS = (1, 2, 3, 4, 6, 8, 11, 15, 20, -1, -2, -3, -4, -6)
"""Places in the training sequence that may show a surface larger [1]."""
FINER = 0.985
"""A surface at less than this share of the depth is seen finer [1]."""


class _Neighbours(NamedTuple):
    """Pictures that a picture is compared with: their numbers [M], and its camera's pose in each camera [M, 4, 4]."""

    numbers: NDArray[np.int64]
    relative: NDArray[np.float64]


def fuse_depth(
    depth: NDArray[np.float32],
    guessed: NDArray[np.bool_],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    T_world_camera: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Average each picture's depth with that of its neighbours, and return which of it is confirmed.

    A pixel's point is projected into the neighbouring pictures. A neighbour whose own depth there agrees
    supports the point and contributes its depth with weight z^-4 (stereo depth errors grow as z^2); one that sees
    through the point, into sky or onto a farther surface, contradicts it; one that sees a nearer surface does not
    count. A measured point is confirmed if more neighbours support than contradict it, or if no neighbour counts. A
    guessed point does not count for others; it is confirmed if no neighbour contradicts it or has measured it.

    Parameters
    ----------
    depth : float32 [T, H, W] camera z; NaN unknown, inf sky [m]
    guessed : bool [T, H, W] depth that was filled in, not measured
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]
    T_world_camera : float64 [T, 4, 4] camera poses

    Returns
    -------
    fused : float32 [T, H, W] depth; NaN and inf as before [m]
    confirmed : bool [T, H, W]
    """
    fused = depth.copy()
    confirmed = np.zeros(depth.shape, dtype=np.bool_)
    for n in range(len(depth)):
        neighbours = _find_neighbours(n, CHECK_OFFSETS, T_world_camera)
        _compare_with_neighbours(n, depth, guessed, neighbours, intrinsics, disparity_scale, fused, confirmed)
    return fused, confirmed


def find_finest_view(
    n: int,
    fused: NDArray[np.float32],
    confirmed: NDArray[np.bool_],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    T_world_camera: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return the confirmed pixels of picture n whose surface no other picture shows larger, bool [H, W]."""
    neighbours = _find_neighbours(n, FINER_OFFSETS, T_world_camera)
    keep = confirmed[n].copy()
    _drop_coarser(n, fused, confirmed, neighbours, intrinsics, disparity_scale, keep)
    return keep


def _find_neighbours(n: int, offsets: tuple[int, ...], T_world_camera: NDArray[np.float64]) -> _Neighbours:
    numbers = [n + offset for offset in offsets if 0 <= n + offset < len(T_world_camera)]
    relative = np.linalg.inv(T_world_camera[numbers]) @ T_world_camera[n]
    return _Neighbours(np.array(numbers), relative)


@numba.njit(cache=True, nogil=True)
def _compare_with_neighbours(n, depth, guessed, neighbours, K, bf, fused, confirmed):  # type: ignore[no-untyped-def]
    others, relative = neighbours
    height, width = depth.shape[1:]
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    for v in range(height):
        for u in range(width):
            z = depth[n, v, u]
            if not np.isfinite(z):
                continue
            x, y = (u - cx) / fx * z, (v - cy) / fy * z
            support, contradiction, hidden = 0, 0, 0
            weight = 1.0 / z**4
            total = z * weight
            for k in range(len(others)):
                M = relative[k]
                there = M[2, 0] * x + M[2, 1] * y + M[2, 2] * z + M[2, 3]
                if there < 0.5:
                    continue
                column = int(np.rint((M[0, 0] * x + M[0, 1] * y + M[0, 2] * z + M[0, 3]) / there * fx + cx))
                row = int(np.rint((M[1, 0] * x + M[1, 1] * y + M[1, 2] * z + M[1, 3]) / there * fy + cy))
                if column < 1 or column >= width - 1 or row < 1 or row >= height - 1:
                    continue
                measured = depth[others[k], row, column]
                if np.isnan(measured) or guessed[others[k], row, column]:
                    continue
                difference = bf / measured - bf / there
                if abs(difference) < AGREEMENT:
                    support += 1
                    w = 1.0 / measured**4
                    total += w * (z + measured - there)
                    weight += w
                elif difference < -SEE_THROUGH:
                    clear = True
                    for r in range(row - 1, row + 2):
                        for c in range(column - 1, column + 2):
                            if bf / depth[others[k], r, c] - bf / there > -SEE_THROUGH:
                                clear = False
                    if clear:
                        contradiction += 1
                else:
                    hidden += 1
            if guessed[n, v, u]:
                confirmed[n, v, u] = support + contradiction == 0
            else:
                fused[n, v, u] = total / weight
                confirmed[n, v, u] = support > contradiction or support + contradiction + hidden == 0


@numba.njit(cache=True, nogil=True)
def _drop_coarser(n, depth, confirmed, neighbours, K, bf, keep):  # type: ignore[no-untyped-def]
    others, relative = neighbours
    height, width = depth.shape[1:]
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    for v in range(height):
        for u in range(width):
            if not keep[v, u]:
                continue
            z = depth[n, v, u]
            x, y = (u - cx) / fx * z, (v - cy) / fy * z
            for k in range(len(others)):
                M = relative[k]
                there = M[2, 0] * x + M[2, 1] * y + M[2, 2] * z + M[2, 3]
                if there < 0.5 or there > FINER * z:
                    continue
                column = int(np.rint((M[0, 0] * x + M[0, 1] * y + M[0, 2] * z + M[0, 3]) / there * fx + cx))
                row = int(np.rint((M[1, 0] * x + M[1, 1] * y + M[1, 2] * z + M[1, 3]) / there * fy + cy))
                if (
                    column < 0
                    or column >= width
                    or row < 0
                    or row >= height
                    or not confirmed[others[k], row, column]
                ):
                    continue
                if abs(bf / depth[others[k], row, column] - bf / there) < AGREEMENT:
                    keep[v, u] = False
                    break
