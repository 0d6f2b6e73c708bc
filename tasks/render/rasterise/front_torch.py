"""The splat that a pixel shows first, for a rasteriser that lists its pairs of splat and pixel, on tensors."""

from math import log

import torch

ROUNDING = 1e-7
"""Optical depth by which sums over a whole picture may be off: a splat that leaves one half is not below it [1]."""


def find_first_below_half(alpha: torch.Tensor, pixel: torch.Tensor) -> torch.Tensor:
    """Return the splats that bring their pixel's transmittance from one half or more to less.

    Parameters
    ----------
    alpha : [M] opacity of each splat at its pixel, below 1 [1]
    pixel : [M] pixel of each, all of one pixel together and nearest first [1]

    Returns
    -------
    bool [M]
    """
    opaqueness = -torch.log1p(-alpha.double())
    behind = torch.cumsum(opaqueness, dim=0)
    front = behind - opaqueness
    starts = torch.ones_like(pixel, dtype=torch.bool)
    starts[1:] = pixel[1:] != pixel[:-1]
    # The sum before the pixel's own first splat.
    before = front[starts][torch.cumsum(starts, dim=0) - 1]
    half = log(2.0) + ROUNDING
    return (front - before <= half) & (behind - before > half)
