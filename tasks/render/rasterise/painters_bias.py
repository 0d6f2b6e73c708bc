"""The painter's bias: on one surface the nearer discs cover the farther ones, which shifts the picture.

Gaussians are blended in the order of their centres' depth. On a road, of the discs that overlap at a pixel, those
whose centres lie below it, nearer, come first: the road's picture sits some tenths of a pixel too high, by another
share of a pixel at every distance, and moves relative to a car that drives. This module gives that shift, so that
`projection` can draw every disc nearer, down a road, by the same amount.

Discs of overlap kappa, their opacity times area by the area of the surface, lie as a random scatter: the mean share
of light that passes all of them is exp(-kappa). Along the direction t in which the picture of the surface comes
nearer, all in standard deviations of the disc, one at 0 is seen at t with

    w(t) = phi(t) exp(-kappa Phi(r t)),

phi and Phi the normal density and distribution, r the disc's size by its neighbours': at t the neighbours that are
nearer than the disc have optical depth kappa Phi(r t). Its picture lies where the mean of w is, at -shift.

This holds if the surface has the same scale all over a disc. It has not: towards the horizon, a distance of y standard
deviations away, it shrinks by 1 + t / y. A disc of the surface is no Gaussian in the picture but reaches further down,
its middle by Var(t) / y; EWA draws the Gaussian. And neighbours further down are larger: the optical depth before the
disc grows by 2 kappa phi(r t) / (r y). With both, to the first order in 1 / y,

    shift = -E(t) + (Var(t) + 2 kappa Cov(t, phi(r t)) / r) / y        under w.
"""

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

OVERLAP_SCALE = 3.0
"""Overlap in the middle of the table: it is even in overlap / (overlap + scale) [1]."""
INTERVALS = 32
"""Intervals of the table along each axis [1]."""
MOST_OVERLAP, MOST_RATIO = 30.0, 30.0
"""Largest overlap and size by the neighbours' that the table holds [1]."""
STEEPEST = 0.1
"""Largest 1 / y for which the first order is taken: a disc nearer the horizon counts as this [1]."""
LARGEST_SHIFT = 2.5
"""Largest shift [1]."""

_SCALE, _INTERVALS, _STEEPEST, _LARGEST_SHIFT = (
    np.float32(c) for c in (OVERLAP_SCALE, INTERVALS, STEEPEST, LARGEST_SHIFT)
)
_LAST = np.float32(INTERVALS - 1)
_ZERO, _ONE = np.float32(0), np.float32(1)


def shift_terms(overlap: float, ratio: float) -> tuple[float, float]:
    """Return the shift on a surface without perspective, and the term that perspective adds, times 1 / y.

    Parameters
    ----------
    overlap : kappa [1]
    ratio : r, size of the disc by its neighbours', above 0 [1]

    Returns
    -------
    The two terms of the shift, in standard deviations of the disc [1]
    """
    t = np.linspace(-8, 8, 1601)
    density = np.exp(-((ratio * t) ** 2) / 2) / np.sqrt(2 * np.pi)
    weight = np.exp(-(t**2) / 2 - overlap * ndtr(ratio * t))
    weight /= weight.sum()
    mean = float((weight * t).sum())
    variance = float((weight * (t - mean) ** 2).sum())
    shading = float((weight * (t - mean) * density).sum())
    return -mean, variance + 2 * overlap * shading / ratio


def _tabulate_shifts() -> NDArray[np.float32]:
    """Return both terms on an even grid of overlap / (overlap + scale) and ratio / (1 + ratio), float32 [33, 33, 2].

    They are rounded, so that the last bit of a processor's exponential does not reach a picture.
    """
    share = np.arange(INTERVALS + 1) / INTERVALS
    with np.errstate(divide="ignore"):
        overlaps = np.minimum(OVERLAP_SCALE * share / (1 - share), MOST_OVERLAP)
        ratios = np.clip(share / (1 - share), 1e-3, MOST_RATIO)
    terms = [[shift_terms(overlap, ratio) for ratio in ratios] for overlap in overlaps]
    return np.array(terms).round(6).astype(np.float32)


SHIFTS = _tabulate_shifts()
"""Both terms of `shift_terms`, float32 [33, 33, 2]."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def interpolate_shift(overlap, ratio, closeness):  # type: ignore[no-untyped-def]
    """Return by how many standard deviations a disc must be drawn nearer to appear in its place, float32.

    Parameters
    ----------
    overlap : kappa [1]
    ratio : r, size of the disc by its neighbours' along the gradient, in the picture [1]
    closeness : 1 / y, a standard deviation by the way to the horizon [1]
    """
    i = overlap / (overlap + _SCALE) * _INTERVALS
    j = ratio / (ratio + _ONE) * _INTERVALS
    # In this order a NaN, of a splat that is not drawn, gives the last cell and no place outside the table.
    row, column = int(min(_LAST, i)), int(min(_LAST, j))
    down, across = i - np.float32(row), j - np.float32(column)
    near = min(closeness, _STEEPEST)
    total = _ZERO
    for di in range(2):
        for dj in range(2):
            share = (down if di else _ONE - down) * (across if dj else _ONE - across)
            total += share * (SHIFTS[row + di, column + dj, 0] + near * SHIFTS[row + di, column + dj, 1])
    return min(total, _LARGEST_SHIFT)
