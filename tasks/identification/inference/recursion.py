"""First-order recursion: the lag of an instrument, and noise that remembers its last sample."""

import numba
import numpy as np
from numpy.typing import NDArray


def filter_recursively(driven: NDArray[np.float64], keep: float) -> NDArray[np.float64]:
    """Return y of y[n] = driven[n] + keep y[n-1], from rest.

    It is `scipy.signal.lfilter` with b = 1 and a = (1, -keep), to the last bit, without its import, which
    brings all of scipy.stats and takes a third of a second.

    Parameters
    ----------
    driven : float64 [N, ...], a column for each recursion
    keep : share of a sample that the next one keeps [1]
    """
    y = np.array(driven, order="C")
    _accumulate_rows(y.reshape(len(y), -1), keep)
    return y


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _accumulate_rows(y, keep):  # type: ignore[no-untyped-def]
    for n in range(1, y.shape[0]):
        for column in range(y.shape[1]):
            y[n, column] += keep * y[n - 1, column]
