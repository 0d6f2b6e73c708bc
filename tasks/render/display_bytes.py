"""sRGB bytes of linear light from a table: those of `tasks.render.composition.encode_8bit` in a fourth of its time."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.composition import encode_8bit
from tasks.render.pixels import INLINED, LAW, find_namespace, run_on_either

_CELL_BITS = 15
"""Last bits of a number that its cell leaves out: 8 bits of the mantissa stay, so that no cell holds two thresholds."""
_LARGEST = np.float32(1)
_ZERO = np.float32(0)


def _find_thresholds() -> NDArray[np.float32]:
    """Return the least light of each byte, float32 [257], by halving; the last is NaN, which no light reaches."""
    low = np.zeros(256, dtype=np.uint32)
    high = np.full(256, _LARGEST.view(np.uint32))
    levels = np.arange(256)
    while (low < high).any():
        middle = (low + high) // 2
        reached = encode_8bit(middle.view(np.float32)) >= levels
        high = np.where(reached, middle, high)
        low = np.where(reached, low, np.minimum(middle + 1, high))
    return np.append(high.view(np.float32), np.float32(np.nan))


_THRESHOLDS = _find_thresholds()
_FIRST_CELL = int(_THRESHOLDS[1].view(np.uint32) >> _CELL_BITS)
_CELLS = (np.arange(_FIRST_CELL, (int(_LARGEST.view(np.uint32)) >> _CELL_BITS) + 1) << _CELL_BITS).astype(
    np.uint32
)
_BYTES = np.searchsorted(_THRESHOLDS[:256], _CELLS.view(np.float32), side="right").astype(
    np.uint8
) - np.uint8(1)
"""The byte of the first number of each cell, from that of the first byte above 0 on."""


def encode_picture(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the sRGB bytes of a linear picture, rounded half to even, without dither.

    Parameters
    ----------
    linear : float32 [H, W, 3] linear light; NaN gives 0 [1]
    """
    xp = find_namespace(linear)
    values = linear if xp is not np else np.ascontiguousarray(linear)
    encoded = xp.empty_like(values, dtype=xp.uint8)
    _encode(*(one.reshape(len(values), -1) for one in (values, values.view(xp.int32), encoded)))
    return encoded


@numba.njit(**INLINED)
def _encode_value(row, column, values, bits, out):  # type: ignore[no-untyped-def]
    value = values[row, column]
    cell = min(max(int(bits[row, column] >> _CELL_BITS) - _FIRST_CELL, 0), len(_BYTES) - 1)
    byte = int(_BYTES[cell])
    byte += value >= _THRESHOLDS[byte + 1]
    out[row, column] = np.uint8(byte if value > _ZERO else 0)


@run_on_either(_encode_value)
@numba.njit(**LAW)
def _encode(values, bits, out):  # type: ignore[no-untyped-def]
    for row in range(values.shape[0]):
        for column in range(values.shape[1]):
            _encode_value(row, column, values, bits, out)
