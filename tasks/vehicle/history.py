"""Columns and event times that paper and coupled mode return to the rollout."""

from dataclasses import dataclass

import numpy as np
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
