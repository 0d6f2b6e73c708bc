"""One step of the composition, kept apart: what it lets through and what it adds."""

from collections.abc import Iterable
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, new_picture, run_on_either


@dataclass(frozen=True, kw_only=True)
class Layer:
    """``picture gain + add``, in linear light and float32.

    Parameters
    ----------
    name : light, wet, air or particles
    gain : float32 [H, W, 1] or [H, W, 3] share of the picture below that is left, or one number for all pixels: 0 [1]
    add : float32 [H, W, 3] light that the layer adds [1]
    """

    name: str
    gain: NDArray[np.float32]
    add: NDArray[np.float32]


def recompose_layers(base: NDArray[np.float32], layers: Iterable[Layer]) -> NDArray[np.float32]:
    """Apply layers to a picture in their order; the one way pictures are composed, so any layer can be redone.

    Parameters
    ----------
    base : float32 [H, W, 3] linear picture [1]
    layers : from the scene to the lens

    Returns
    -------
    float32 [H, W, 3] linear picture [1]
    """
    picture = base
    for layer in layers:
        below, picture = picture, layer.add
        if layer.gain.shape[0] > 1:
            picture = new_picture(layer.add, 3)
            _cover(below, layer.gain, layer.add, picture)
    return picture


@numba.njit(**INLINED)
def _cover_pixel(row, column, picture, gain, add, out):  # type: ignore[no-untyped-def]
    last = gain.shape[2] - 1
    for c in range(3):
        below = picture[row, column, c] * gain[row, column, min(c, last)]
        out[row, column, c] = below + add[row, column, c]


@run_on_either(_cover_pixel)
@numba.njit(**LAW)
def _cover(picture, gain, add, out):  # type: ignore[no-untyped-def]
    for row in range(add.shape[0]):
        for column in range(add.shape[1]):
            _cover_pixel(row, column, picture, gain, add, out)
