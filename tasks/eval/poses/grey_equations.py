"""The compiled part of an alignment of grey levels: which pixels it reads, and their normal equations."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.rigid import Floats

BINS_PER_GREY_LEVEL = 4


@numba.njit(cache=True, nogil=True)
def find_informative_pixels(grey, q, least_gradient, depth_kink):  # type: ignore[no-untyped-def]
    """Return the pixels of a picture that can be aligned to another one.

    Neighbours hold nearly the same, so every second one, as on a chequerboard, is left out.

    Parameters
    ----------
    grey : float32 [H, W] grey levels [1]
    q : float32 [H, W] inverse depth, 0 where there is none [1/m]
    least_gradient : grey levels per pixel below which a pixel is left out [1]
    depth_kink : largest relative bend of inverse depth beside a pixel [1]

    Returns
    -------
    float32 [P, 6] x, y [px], inverse depth [1/m], grey level [1] and its gradient across and down [1/px]
    """
    height, width = grey.shape
    found = np.empty((height * width // 2 + 1, 6), np.float32)
    count, half = 0, np.float32(0.5)
    least, kink = np.float32(least_gradient) ** 2, np.float32(depth_kink)
    for y in range(1, height - 1):
        for x in range(1 + y % 2, width - 1, 2):
            here = q[y, x]
            if not here > 0:
                continue
            gx, gy = (grey[y, x + 1] - grey[y, x - 1]) * half, (grey[y + 1, x] - grey[y - 1, x]) * half
            bend = max(
                abs(q[y, x + 1] + q[y, x - 1] - np.float32(2) * here),
                abs(q[y + 1, x] + q[y - 1, x] - np.float32(2) * here),
            )
            if gx * gx + gy * gy >= least and bend <= kink * here:
                row = found[count]
                row[0], row[1], row[2], row[3], row[4], row[5] = x, y, here, grey[y, x], gx, gy
                count += 1
    return found[:count].copy()


def find_histogram_median(histogram: NDArray[np.int64]) -> float:
    """Return the median of the absolute residuals that a histogram [256 `BINS_PER_GREY_LEVEL`] counts [1]."""
    half = np.searchsorted(np.cumsum(histogram), max(histogram.sum(), 1) / 2)
    return (float(half) + 0.5) / BINS_PER_GREY_LEVEL


def compute_correlation(sums: Floats) -> float:
    """Return the correlation of two samples [1] from the sums n, a, b, aa, bb, ab; 0 where one does not vary."""
    n, a, b, aa, bb, ab = sums
    if n == 0:
        return 0.0
    variance = (aa - a * a / n) * (bb - b * b / n)
    return float((ab - a * b / n) / np.sqrt(variance)) if variance > 0 else 0.0


def form_normal_equations(
    pixels: NDArray[np.float32], source: NDArray[np.float32], K: Floats, T: Floats, scale: float, block: int
) -> tuple[Floats, Floats, Floats, NDArray[np.int64]]:
    """Return the normal equations of a small motion that aligns pixels to another picture, with Tukey's weights.

    Parameters
    ----------
    pixels : float32 [P, 6] as `find_informative_pixels` returns them
    source : float32 [H, W] the other picture's grey levels [1]
    K : float64 [3, 3] intrinsics of both [px]
    T : float64 [4, 4] from the camera of the pixels to that of the other picture
    scale : standard deviation of a residual, in grey levels [1]
    block : side of a block [px]

    Returns
    -------
    float64 [6, 6] and [B, 6] weighted J^T J, and J^T r of each of the blocks B of the pixels; float64 [6] sums for
    `compute_correlation` over the pixels with weight; int64 [256 `BINS_PER_GREY_LEVEL`] count of absolute residuals
    """
    return _accumulate_normal_equations(
        pixels,
        source,
        K @ T[:3, :3] @ np.linalg.inv(K),
        K @ T[:3, 3],
        (K[0, 0], K[1, 1], K[0, 2], K[1, 2]),
        scale,
        block,
    )


@numba.njit(cache=True, nogil=True)
def _accumulate_normal_equations(pixels, source, warp, shift, intrinsics, scale, block):  # type: ignore[no-untyped-def]
    """Weighted JTJ [6, 6], weighted JTr of each block [B, 6], sums for the correlation of the inliers
    (n, a, b, aa, bb, ab) and a histogram of the absolute residuals [1]."""
    fx, fy, cx, cy = intrinsics
    rows_in, columns_in = source.shape
    columns = columns_in // block + 1
    blocks = columns * (rows_in // block + 1)
    H = np.zeros((6, 6))
    gradient = np.zeros((blocks, 6))
    sums = np.zeros(6)
    histogram = np.zeros(256 * BINS_PER_GREY_LEVEL, np.int64)
    J = np.empty(6)
    cut = 1.0 / (4.685 * scale) ** 2
    for p in range(pixels.shape[0]):
        x, y, q = pixels[p, 0], pixels[p, 1], pixels[p, 2]
        Z = warp[2, 0] * x + warp[2, 1] * y + warp[2, 2] + shift[2] * q
        if Z <= 1e-3:
            continue
        u = (warp[0, 0] * x + warp[0, 1] * y + warp[0, 2] + shift[0] * q) / Z
        v = (warp[1, 0] * x + warp[1, 1] * y + warp[1, 2] + shift[1] * q) / Z
        if not (u >= 0.0 and v >= 0.0 and u < columns_in - 1 and v < rows_in - 1):
            continue
        j, i = int(u), int(v)
        a, b = u - j, v - i
        seen = (1 - b) * ((1 - a) * source[i, j] + a * source[i, j + 1]) + b * (
            (1 - a) * source[i + 1, j] + a * source[i + 1, j + 1]
        )
        grey = pixels[p, 3]
        r = seen - grey
        histogram[min(int(abs(r) * BINS_PER_GREY_LEVEL), histogram.size - 1)] += 1
        w = 1.0 - r * r * cut
        if w <= 0.0:
            continue
        w *= w
        X, Y, gx, gy = (x - cx) / fx, (y - cy) / fy, fx * pixels[p, 4], fy * pixels[p, 5]
        along = X * gx + Y * gy
        J[0], J[1], J[2] = q * gx, q * gy, -q * along
        J[3], J[4], J[5] = -gy - Y * along, gx + X * along, X * gy - Y * gx
        here = (int(y) // block) * columns + int(x) // block
        for m in range(6):
            wj = w * J[m]
            gradient[here, m] += wj * r
            for n in range(m, 6):
                H[m, n] += wj * J[n]
        sums[0] += 1.0
        sums[1] += seen
        sums[2] += grey
        sums[3] += seen * seen
        sums[4] += grey * grey
        sums[5] += seen * grey
    for m in range(6):
        for n in range(m):
            H[m, n] = H[n, m]
    return H, gradient, sums, histogram
