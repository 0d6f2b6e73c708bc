"""Clocks of recordings that begin again."""

import numpy as np
from numpy.typing import NDArray

RESTART = 1.0
"""Step back from which a clock has begun again, and does not merely stumble [s]."""


def describe_restarts(time: NDArray[np.float64], table_row: int | None = None) -> str:
    """Return the problem of a clock that begins again, so that its times stand for several stretches; empty without.

    Parameters
    ----------
    time : float64 [N]; NaN where a row holds no time [s]
    table_row : number of the first row below the names; None where samples are counted
    """
    told = np.flatnonzero(np.isfinite(time))
    back = np.flatnonzero(np.diff(time[told]) < -RESTART)
    if not back.size:
        return ""
    kind, first = ("sample", 1) if table_row is None else ("row", table_row)
    numbers = [str(told[k + 1] + first) for k in back]
    shown = ", ".join(numbers[:5]) + (f" and {len(numbers) - 5} more" if len(numbers) > 5 else "")
    return (
        f"begins again at {kind}{'s' if len(numbers) > 1 else ''} {shown}{' below the names' if table_row else ''}, first"
        f" from {time[told[back[0]]]:.3f} to {time[told[back[0] + 1]]:.3f} s: the same times stand for several stretches,"
        f" so cut the file before {'that' if len(numbers) == 1 else 'each such'} {kind} into files of their own"
    )
