"""Manoeuvre figures of a run: stopping distance and peak pitch."""

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS

BRAKED = 0.1
"""Brake pressure from which a run brakes [MPa]."""
FELL = 2.0
"""Least decrease of speed of a braked run [m/s]."""
SMOOTHED = 0.1
"""Time over which pitch is averaged before its peak is taken, since the peak would otherwise be that of noise [s]."""
MANOEUVRE_UNITS = {"stopping_distance": "m", "peak_pitch": "deg"}


def measure_manoeuvre_errors(
    measured: NDArray[np.float64],
    predictions: NDArray[np.float64],
    pressure: NDArray[np.float64],
    interval: float,
) -> NDArray[np.float64] | None:
    """Return model minus measured stopping distance and peak pitch, for several models of one run.

    The distance counts from the first brake pressure to the lowest speed that the measurement and every model reach
    by the last one, so that all distances end at one speed although the record ends at walking pace. Once the brake is
    released a car hardly slows: a few cm/s then decide where, metres later, it reaches a speed.

    Parameters
    ----------
    measured : float64 [N, 7] channels
    predictions : float64 [P, N, 7] the same of each model
    pressure : float64 [N] brake pressure [MPa]
    interval : time between samples [s]

    Returns
    -------
    float64 [P, 2] errors of stopping distance [m] and peak pitch [deg]; None where the run does not brake.
    """
    pressed = np.flatnonzero(pressure > BRAKED)
    if not pressed.size:
        return None
    both = np.concatenate((measured[None], predictions))[:, pressed[0] :]
    braked = both[:, : pressed[-1] - pressed[0] + 1, CHANNELS.index("speed")]
    lowest = np.minimum.accumulate(braked, axis=1)
    reached = float(np.max(lowest[:, -1]))
    if float(np.min(lowest[:, 0])) - reached < FELL:
        return None
    distance = np.array([_distance_until(speed, reached, interval) for speed in lowest])
    width = min(max(round(SMOOTHED / interval), 1), both.shape[1])
    window = np.full(width, 1.0 / width)
    peak = np.array([np.convolve(p, window, mode="valid").max() for p in both[:, :, CHANNELS.index("pitch")]])
    figures = np.column_stack((distance, peak))
    return np.asarray(figures[1:] - figures[0], dtype=np.float64)


def _distance_until(speed: NDArray[np.float64], reached: float, interval: float) -> float:
    """Return the distance until a falling speed (float64 [N]) first reaches a value, by trapezia [m]."""
    end = int(np.argmax(speed <= reached))
    whole = float(np.sum(0.5 * (speed[1:end] + speed[: end - 1]))) * interval if end > 1 else 0.0
    if end == 0:
        return 0.0
    step = speed[end - 1] - speed[end]
    share = (speed[end - 1] - reached) / step if step > 0.0 else 1.0
    return whole + 0.5 * (speed[end - 1] + reached) * share * interval
