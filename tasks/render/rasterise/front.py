"""The splat that a pixel shows first, in a tile's list that is ordered by depth, as gsplat returns it."""

from math import exp

import numba

from tasks.render.pixels import LAW
from tasks.render.rasterise.strips import MAX_ALPHA

LEAST_ALPHA = 1 / 255
"""Opacity below which gsplat leaves a splat out at a pixel [1]."""


@numba.njit(**LAW)
def find_front(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    row, column, front, means, conics, opacities, starts, listed, tile
):
    """Write the splat that brings a pixel's transmittance below one half; a law of `tasks.render.pixels`.

    Parameters
    ----------
    row, column : the pixel
    front : int64 [H, W] splats, written where there is one [1]
    means : float32 [N, 2] middles [px]
    conics : float32 [N, 3] inverse covariances: xx, xy, yy [px-2]
    opacities : float32 [N] [1]
    starts : int32 [rows, columns] of tiles, where the list of each begins; the lists follow one another [1]
    listed : int32 [M] splats of the lists, nearest first [1]
    tile : edge of a tile [px]
    """
    own = row // tile * starts.shape[1] + column // tile
    last = starts.shape[0] * starts.shape[1] - 1
    end = len(listed) if own == last else starts[(own + 1) // starts.shape[1], (own + 1) % starts.shape[1]]
    through = 1.0
    for k in range(starts[row // tile, column // tile], end):
        splat = listed[k]
        dx, dy = column + 0.5 - means[splat, 0], row + 0.5 - means[splat, 1]
        power = 0.5 * (conics[splat, 0] * dx * dx + conics[splat, 2] * dy * dy) + conics[splat, 1] * dx * dy
        alpha = min(opacities[splat] * exp(-power), MAX_ALPHA)
        if power >= 0 and alpha >= LEAST_ALPHA:
            through *= 1 - alpha
            if through < 0.5:
                front[row, column] = splat
                return
