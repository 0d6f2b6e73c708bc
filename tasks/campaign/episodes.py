"""Braking episodes: stretches of brake pressure above a threshold."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One application of the brake.

    Parameters
    ----------
    onset : index of the first active sample
    onset_time, end_time : times of the first and the last active sample [s]
    """

    onset: int
    onset_time: float
    end_time: float

    @property
    def duration(self) -> float:
        """Time from the first to the last active sample [s]."""
        return self.end_time - self.onset_time


def find_pressure_episodes(
    time: NDArray[np.float64], pressure: NDArray[np.float64], *, threshold: float, merge_gap: float
) -> tuple[Episode, ...]:
    """Return the episodes of samples at or above a threshold, merged over short gaps (paper, Appendix C.5).

    Parameters
    ----------
    time : float64 [N] ascending [s]
    pressure : float64 [N] [MPa]
    threshold : smallest active pressure [MPa]
    merge_gap : active samples at most this far apart belong together [s]
    """
    active = np.flatnonzero(pressure >= threshold)
    if not active.size:
        return ()
    # the paper's gap is a time difference of samples, with the rounding of binary fractions
    breaks = np.flatnonzero(np.diff(time[active]) > merge_gap + 1e-9)
    firsts = active[np.concatenate(([0], breaks + 1))]
    lasts = active[np.concatenate((breaks, [active.size - 1]))]
    return tuple(
        Episode(onset=int(first), onset_time=float(time[first]), end_time=float(time[last]))
        for first, last in zip(firsts, lasts, strict=True)
    )
