"""Sensor noise from quiet stretches, without a model: AR(1) noise under a slow disturbance."""

import numpy as np
from numpy.typing import NDArray

from tasks.closure.campaign import CHANNELS, Campaign

LAGS = (1, 2, 3, 4, 6, 8)
INTEGRALS = tuple(
    (CHANNELS.index(level), CHANNELS.index(rate))
    for level, rate in (("speed", "longitudinal_acceleration"), ("pitch", "pitch_rate"))
)
QUIET_PRESSURE = 0.1
"""A run is quiet until its pressure first exceeds this [MPa]."""


def channel_noise(campaign: Campaign) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """AR(1) coefficient and standard deviation of every channel.

    The half variogram of AR(1) noise under a smooth motion is sigma^2 (1 - rho^k) + a k^2 at lag k; rho is
    taken on a grid, sigma^2 and a by least squares, over what precedes the brake on flat roads.

    Parameters
    ----------
    campaign : only its training runs are looked at

    Returns
    -------
    rho float64 [7] and sigma float64 [7] [unit of the channel]
    """
    sums, counts = np.zeros((len(LAGS), len(CHANNELS))), np.zeros(len(LAGS))
    for run in campaign.train:
        pressed = np.flatnonzero(run.pressure > QUIET_PRESSURE)
        end = int(pressed[0]) - 5 if pressed.size else len(run.pressure)
        if run.hazard_length > 0:
            end = min(end, 40)
        quiet = run.response[: max(end, 0)].copy()
        for level, rate in INTEGRALS:
            # what the rate explains is motion, not noise of the level
            quiet[:, level] -= np.cumsum(quiet[:, rate]) * run.interval
        for i, lag in enumerate(LAGS):
            if len(quiet) > 3 * lag:
                difference = quiet[lag:] - quiet[:-lag]
                sums[i] += 0.5 * np.sum((difference - difference.mean(0)) ** 2, axis=0)
                counts[i] += len(difference) - 1
    variogram = sums / counts[:, None]
    rho, sigma = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    k = np.array(LAGS, dtype=np.float64)
    for j in range(len(CHANNELS)):
        best = np.inf
        for trial in np.arange(0.0, 0.95, 0.02):
            basis = np.column_stack((1.0 - trial**k, k**2)) / variogram[:, j : j + 1]
            (power, slow), *_ = np.linalg.lstsq(basis, np.ones(len(k)), rcond=None)
            misfit = float(np.sum((basis @ (power, slow) - 1.0) ** 2))
            if misfit < best and power > 0 and slow > -0.05 * power:
                best, rho[j], sigma[j] = misfit, trial, np.sqrt(power)
    return rho, sigma


def whiten(
    x: NDArray[np.float64], rho: NDArray[np.float64], sigma: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Make AR(1) noise of unit variance white along the first axis and stack the channels.

    Parameters
    ----------
    x : float64 [N, 7] or [N, 7, P] residuals or derivatives [unit of the channel]
    rho, sigma : float64 [7] from `channel_noise`

    Returns
    -------
    float64 [7 N] or [7 N, P]
    """
    shape = (1, -1) + (1,) * (x.ndim - 2)
    r, s = rho.reshape(shape), sigma.reshape(shape)
    white = np.concatenate((x[:1] / s, (x[1:] - r * x[:-1]) / (s * np.sqrt(1.0 - r**2))))
    return white.reshape((-1, *x.shape[2:]))
