"""Columns and event times that paper and coupled mode return to the rollout, and how their kernels write a sample."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class History:
    """Motion at the ticks and the times of two events; infinity for an event that never comes.

    Parameters
    ----------
    columns : by the names of ``TICK_CHANNELS``, each of shape (ticks,)
    onset : brake onset [s]
    onset_station : route position of the front axle at the onset [m]
    stop_time : when the vehicle comes to rest [s]
    """

    columns: dict[str, NDArray[np.float64]]
    onset: float
    onset_station: float
    stop_time: float


@register_jitable(cache=True, forceinline=True)
def write_row(rows: NDArray[np.float64], row: int, values: Sequence[float]) -> None:
    """Write a row in a kernel; assigned whole, it makes Numba compile the text of an error for seconds.

    Parameters
    ----------
    rows : float64 [N, C]
    row : which
    values : as many as the rows have columns
    """
    for column in range(len(values)):
        rows[row, column] = values[column]
