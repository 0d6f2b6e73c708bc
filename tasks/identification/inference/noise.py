"""Sensor noise from the samples before the brake, without a model: AR(1) noise under a slow disturbance."""

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, Campaign, Run
from tasks.errors import InputError
from tasks.identification.inference.recursion import filter_recursively

LAGS = (1, 2, 3, 4, 6, 8)
INTEGRALS = tuple(
    (CHANNELS.index(level), CHANNELS.index(rate))
    for level, rate in (("speed", "longitudinal_acceleration"), ("pitch", "pitch_rate"))
)
QUIET_PRESSURE = 0.1
"""Pressure at which the quiet part of a run ends [MPa]."""
BEFORE_BRAKE, ON_HAZARD = 5, 40
"""Samples between the quiet part and the brake, and its largest number of samples where the road is not flat."""


def estimate_channel_noise(campaign: Campaign) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return AR(1) coefficient and standard deviation of every channel's noise.

    The semivariogram of AR(1) noise under a smooth motion is sigma^2 (1 - rho^k) + a k^2 at lag k. rho is searched on
    a grid; sigma^2 and a follow by least squares. The data are the samples before the brake, or whole runs if these are
    too short. A channel has at least the variance of its rounding, step^2 / 12. A channel that was not measured has an
    infinite standard deviation and thus no weight.

    Parameters
    ----------
    campaign : campaign, of which only the training runs are used

    Returns
    -------
    rho float64 [7] [1] and sigma float64 [7] [unit of the channel].

    Raises
    ------
    InputError
        If a measured channel never changes, or the training runs are too short.
    """
    sums, counts = np.zeros((len(LAGS), len(CHANNELS))), np.zeros(len(LAGS))
    stretches = [run.response[: _count_quiet_samples(run)].copy() for run in campaign.train]
    if max(len(stretch) for stretch in stretches) <= 3 * LAGS[-1]:
        stretches = [run.response.copy() for run in campaign.train]
    for run, quiet in zip(campaign.train, stretches, strict=True):
        for level, rate in INTEGRALS:
            # a change that the rate explains is motion, not noise
            quiet[:, level] -= np.cumsum(quiet[:, rate]) * run.interval
        for i, lag in enumerate(LAGS):
            if len(quiet) > 3 * lag:
                difference = quiet[lag:] - quiet[:-lag]
                sums[i] += 0.5 * np.sum((difference - difference.mean(0)) ** 2, axis=0)
                counts[i] += len(difference) - 1
    floor = np.where(campaign.is_measured, _compute_rounding_variance(campaign), np.inf)
    problems = _find_problems(campaign, floor, max(len(stretch) for stretch in stretches))
    if problems:
        raise InputError(problems)
    variogram = np.maximum(sums / counts[:, None], floor)
    rho, sigma = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    k = np.array(LAGS, dtype=np.float64)
    for j in np.flatnonzero(campaign.is_measured):
        best = np.inf
        for trial in np.arange(0.0, 0.95, 0.02):
            basis = np.column_stack((1.0 - trial**k, k**2)) / variogram[:, j : j + 1]
            (power, slow), *_ = np.linalg.lstsq(basis, np.ones(len(k)), rcond=None)
            misfit = float(np.sum((basis @ (power, slow) - 1.0) ** 2))
            if misfit < best and power > 0 and slow > -0.05 * power:
                best, rho[j], sigma[j] = misfit, trial, np.sqrt(power)
    return rho, np.maximum(sigma, np.sqrt(floor))


def _count_quiet_samples(run: Run) -> int:
    """Return the number of samples of a run before the brake."""
    pressed = np.flatnonzero(run.pressure > QUIET_PRESSURE)
    end = int(pressed[0]) - BEFORE_BRAKE if pressed.size else len(run.pressure)
    if run.hazard_length > 0:
        end = min(end, ON_HAZARD)
    return max(end, 0)


def _compute_rounding_variance(campaign: Campaign) -> NDArray[np.float64]:
    """Return the variance of rounding to every channel's smallest step, float64 [7] [unit^2]; NaN for a constant."""
    values = np.concatenate([run.response for run in campaign.train])
    gaps = np.diff(np.sort(values, axis=0), axis=0)
    # equal readings may differ by the last bits of a change of unit
    gaps[gaps <= 1e-12 * np.abs(values).max(axis=0)] = np.inf
    steps = gaps.min(axis=0)
    return np.where(np.isfinite(steps), steps, np.nan) ** 2 / 12


def _find_problems(campaign: Campaign, floor: NDArray[np.float64], longest: int) -> list[str]:
    """Return a sentence for every reason why the noise cannot be estimated."""
    problems = [
        f"{campaign.name}: channel {CHANNELS[j]} must change; it holds one value in all training runs: record it anew"
        for j in np.flatnonzero(np.isnan(floor))
    ]
    if longest <= 3 * LAGS[-1]:
        problems.append(
            f"{campaign.name}: sensor noise is read from training runs, so one must hold more than {3 * LAGS[-1]}"
            f" samples; the longest has {longest}: lengthen the runs"
        )
    return problems


def whiten_channels(
    x: NDArray[np.float64], rho: NDArray[np.float64], sigma: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return channels with AR(1) noise whitened to unit variance along the first axis, and stacked.

    Parameters
    ----------
    x : float64 [N, 7] or [N, 7, P] residuals or derivatives [unit of the channel]
    rho, sigma : float64 [7] AR(1) coefficients [1] and standard deviations [unit of the channel]

    Returns
    -------
    float64 [7 N] or [7 N, P]
    """
    shape = (1, -1) + (1,) * (x.ndim - 2)
    r, s = rho.reshape(shape), sigma.reshape(shape)
    white = np.concatenate((x[:1] / s, (x[1:] - r * x[:-1]) / (s * np.sqrt(1.0 - r**2))))
    return white.reshape((-1, *x.shape[2:]))


def unwhiten_channels(
    white: NDArray[np.float64], rho: NDArray[np.float64], sigma: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what was whitened by `whiten_channels`.

    Parameters
    ----------
    white : float64 [7 N] or [7 N, P]
    rho, sigma : float64 [7] that it was whitened with

    Returns
    -------
    float64 [N, 7] or [N, 7, P] [unit of the channel]; 0 in a channel that was not measured
    """
    rows = white.reshape((-1, len(rho), *white.shape[1:]))
    x = np.zeros_like(rows)
    for c in np.flatnonzero(np.isfinite(sigma)):
        driven = rows[:, c] * sigma[c]
        driven[1:] *= np.sqrt(1.0 - rho[c] ** 2)
        x[:, c] = filter_recursively(driven, rho[c])
    return x


def correlate_with_next(x: NDArray[np.float64], most: float) -> float:
    """Return the correlation of each sample with the next, from 0 to ``most`` [1].

    Parameters
    ----------
    x : float64 [N] of mean 0
    most : beyond which more is not told apart
    """
    power = float(x @ x)
    return min(max(float(x[1:] @ x[:-1]) / power, 0.0), most) if power > 0.0 else 0.0
