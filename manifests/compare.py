"""Where two versions of the same clip first differ: which stage, which channel, which tick."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def first_row_difference(
    recorded: Mapping[str, NDArray[Any]], remade: Mapping[str, NDArray[Any]], channels: Sequence[str]
) -> dict[str, Any] | None:
    """The earliest row in which a channel differs, bit for bit; None when the tables are equal.

    Returns
    -------
    ``channel``, ``tick`` (row number), ``recorded`` and ``remade`` values; of several channels that differ in
    the same row, the first in the given order.
    """
    first: dict[str, Any] | None = None
    for channel in channels:
        a, b = recorded.get(channel), remade.get(channel)
        if a is None or b is None or a.shape != b.shape:
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
                    "recorded": a[tick].tolist(),
                    "remade": b[tick].tolist(),
                }
    return first


def first_pixel_difference(array: str, recorded: NDArray[Any], remade: NDArray[Any]) -> dict[str, Any] | None:
    """The earliest frame in which two pictures differ and the first such pixel; None when they are equal."""
    if recorded.shape != remade.shape:
        return {
            "channel": array,
            "tick": 0,
            "recorded": _describe_shape(recorded),
            "remade": _describe_shape(remade),
        }
    for frame, (a, b) in enumerate(zip(recorded, remade, strict=True)):
        if (a.view(np.uint8) != b.view(np.uint8)).any():
            unequal = _mark_differences(
                a.reshape(a.shape[0] * a.shape[1], -1), b.reshape(a.shape[0] * a.shape[1], -1)
            )
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
    unequal = a != b
    if np.issubdtype(a.dtype, np.floating):
        unequal &= ~(np.isnan(a) & np.isnan(b))
    return unequal.reshape(len(a), -1).any(axis=1)


def _describe_shape(values: NDArray[Any] | None) -> str:
    return "absent" if values is None else f"shape {values.shape}"
