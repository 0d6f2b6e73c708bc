"""Where two versions of the same clip first differ, byte for byte as their hashes do: channel, tick, pixel."""

from collections.abc import Mapping, Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray


def find_row_difference(
    recorded: Mapping[str, NDArray[Any]], remade: Mapping[str, NDArray[Any]], channels: Sequence[str]
) -> dict[str, Any] | None:
    """Return the earliest row in which a channel differs; None when the tables are equal.

    Parameters
    ----------
    recorded, remade : columns by their name, [N, ...] each
    channels : names to compare

    Returns
    -------
    ``channel``, ``tick`` (row number), ``recorded`` and ``remade`` values; of several channels that differ in
    the same row, the first in the given order.
    """
    first: dict[str, Any] | None = None
    for channel in channels:
        a, b = recorded.get(channel), remade.get(channel)
        if a is None or b is None or (a.shape, a.dtype) != (b.shape, b.dtype):
            return {
                "channel": channel,
                "tick": 0,
                "recorded": _describe_shape(a),
                "remade": _describe_shape(b),
            }
        unequal = _mark_differences(a, b)
        if unequal.any():
            tick = int(np.argmax(unequal))
            if first is None or tick < first["tick"]:
                first = {
                    "channel": channel,
                    "tick": tick,
                    "recorded": a[tick : tick + 1].tolist()[0],
                    "remade": b[tick : tick + 1].tolist()[0],
                }
    return first


def find_pixel_difference(array: str, recorded: NDArray[Any], remade: NDArray[Any]) -> dict[str, Any] | None:
    """Return the earliest frame in which two clips' pictures differ and its first such pixel; None when they are equal.

    Parameters
    ----------
    array : name of both
    recorded, remade : [F, H, W, ...] of one type

    Returns
    -------
    ``channel``, ``tick`` (frame number), ``pixel`` (column and row), ``recorded`` and ``remade`` values there.
    """
    if recorded.shape != remade.shape:
        return {
            "channel": array,
            "tick": 0,
            "recorded": _describe_shape(recorded),
            "remade": _describe_shape(remade),
        }
    for frame, (a, b) in enumerate(zip(recorded, remade, strict=True)):
        pixels = a.shape[0] * a.shape[1]
        unequal = _mark_differences(*(picture.reshape(pixels, -1) for picture in (a, b)))
        if unequal.any():
            row, column = divmod(int(np.argmax(unequal)), a.shape[1])
            return {
                "channel": array,
                "tick": frame,
                "pixel": [column, row],
                "recorded": a[row, column].tolist(),
                "remade": b[row, column].tolist(),
            }
    return None


def _mark_differences(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which rows of two arrays [N, ...] hold other bytes, bool [N]: 0 is not -0, and a NaN is itself."""
    ours, theirs = (np.ascontiguousarray(x).reshape(len(x), prod(x.shape[1:])) for x in (a, b))
    if a.dtype != object:  # text has no bytes of its own in an array
        ours, theirs = ours.view(np.uint8), theirs.view(np.uint8)
    unequal: NDArray[np.bool_] = (ours != theirs).any(axis=1)
    return unequal


def _describe_shape(values: NDArray[Any] | None) -> str:
    return "absent" if values is None else f"shape {values.shape} of {values.dtype}"
