"""Keyed random numbers: each stream follows from the names of what is drawn, whatever was drawn before."""

import hashlib

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter


def keyed_generator(*key: str | int) -> np.random.Generator:
    """Counter-based generator of a key.

    Parameters
    ----------
    key : names and numbers, such as seed, campaign, run and quantity
    """
    digest = hashlib.sha256("\x1f".join(str(part) for part in key).encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "little")))


def draw_coloured(rng: np.random.Generator, count: int, ar1: float) -> NDArray[np.float64]:
    """Stationary AR(1) noise of unit variance, float64 [count].

    Parameters
    ----------
    rng : of the stream
    count : of samples
    ar1 : coefficient [1]
    """
    white = rng.standard_normal(count)
    white[1:] *= np.sqrt(1.0 - ar1**2)
    coloured: NDArray[np.float64] = lfilter([1.0], [1.0, -ar1], white)
    return coloured


def draw_smooth(
    rng: np.random.Generator, times: NDArray[np.float64], sigma: float, time: float
) -> NDArray[np.float64]:
    """Smooth random function of time: a cubic spline through AR(1) knots, float64 of the times.

    Parameters
    ----------
    rng : of the stream
    times : at which it is wanted, from 0 on [s]
    sigma : standard deviation at the knots
    time : correlation time [s]
    """
    spacing = 0.3 * time
    knots = np.arange(-2, int(times[-1] / spacing) + 4) * spacing
    values = sigma * draw_coloured(rng, len(knots), float(np.exp(-spacing / time)))
    smooth: NDArray[np.float64] = CubicSpline(knots, values)(times)
    return smooth
