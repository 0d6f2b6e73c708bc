"""Sensor noise from the samples before the brake, without a model: AR(1) noise under a slow disturbance."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.campaign.campaign import BRAKING_PRESSURE, CHANNELS, Campaign, Run
from tasks.errors import InputError
from tasks.identification.inference.recursion import filter_recursively

LAGS = (1, 2, 3, 4, 6, 8)
INTEGRALS = tuple(
    (CHANNELS.index(level), CHANNELS.index(rate))
    for level, rate in (("speed", "longitudinal_acceleration"), ("pitch", "pitch_rate"))
)
FEWEST_LAGS = 3
"""Lags at which the quiet parts must tell a channel's variogram: it has three unknowns [1]."""
FEWEST_SAMPLES = 3 * LAGS[FEWEST_LAGS - 1]
"""Samples of a channel that some run must exceed for that [1]."""
LEAST_NOISE = np.array([0.01, 0.02, 0.03, 0.03, 0.005, 0.03, 0.03])
"""Noise of a channel at the least: no model follows a car better, however quiet its sensors [unit of the channel]."""
BEFORE_BRAKE, ON_HAZARD = 0.05, 0.4
"""Time between the quiet part and the brake, and its longest time where the road is not flat [s]."""


def estimate_channel_noise(campaign: Campaign) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return AR(1) coefficient and standard deviation of every channel's noise.

    The semivariogram of AR(1) noise under a smooth motion is sigma^2 (1 - rho^k) + a k^2 at lag k. rho is searched on
    a grid; sigma^2 and a follow by least squares. The data are the samples before the brake, or whole runs if these are
    too short. A lag counts the channel's own samples, which in a slow channel lie further apart than the run's. A
    channel has at least the variance of its rounding, step^2 / 12. A channel that was not measured has an infinite
    standard deviation and thus no weight.

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
    floor = np.where(campaign.is_measured, _compute_rounding_variance(campaign), np.inf)
    floor[_find_copies(campaign)] = np.inf
    stretches = [stretch for run in campaign.train for stretch in _list_stretches(run)]
    problems = _find_problems(campaign, floor, _find_longest(stretches))
    if problems:
        raise InputError(problems)
    variogram = np.maximum(_compute_variogram(stretches), floor)
    rho, sigma = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    k = np.array(LAGS, dtype=np.float64)
    for j in np.flatnonzero(np.isfinite(floor)):
        best, seen = np.inf, np.isfinite(variogram[:, j])
        for trial in np.arange(0.0, 0.95, 0.02):
            basis = (np.column_stack((1.0 - trial**k, k**2)) / variogram[:, j : j + 1])[seen]
            (power, slow), *_ = np.linalg.lstsq(basis, np.ones(len(basis)), rcond=None)
            misfit = float(np.sum((basis @ (power, slow) - 1.0) ** 2))
            if misfit < best and power > 0 and slow > -0.05 * power:
                best, rho[j], sigma[j] = misfit, trial, np.sqrt(power)
    return rho, np.maximum(np.maximum(sigma, np.sqrt(floor)), LEAST_NOISE)


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Samples of the channels of one run that share their instants, without the motion that their rates explain.

    Parameters
    ----------
    channels : int64 [C] places in `CHANNELS`
    values : float64 [N, C] [unit of the channel]
    quiet : number of samples before the brake
    """

    channels: NDArray[np.int64]
    values: NDArray[np.float64]
    quiet: int


def _list_stretches(run: Run) -> list[Stretch]:
    """Return the samples of a run, the channels of one clock together."""
    left = run.response.copy()
    for level, rate in INTEGRALS:
        # a change that the rate explains is motion, not noise
        left[:, level] -= np.cumsum(left[:, rate]) * run.interval
    end = _count_quiet_samples(run)
    return [
        Stretch(
            channels=channels,
            values=left.take(rows, axis=0).take(channels, axis=1),
            quiet=int(np.searchsorted(rows, end)),
        )
        for channels, rows in run.group_channels()
    ]


def _find_longest(stretches: list[Stretch]) -> NDArray[np.int64]:
    """Return the number of samples of every channel in its longest run, int64 [7]."""
    longest = np.zeros(len(CHANNELS), dtype=np.int64)
    for stretch in stretches:
        longest[stretch.channels] = np.maximum(longest[stretch.channels], len(stretch.values))
    return longest


def _compute_variogram(stretches: list[Stretch]) -> NDArray[np.float64]:
    """Return the semivariogram of every channel at `LAGS`, float64 [L, 7] [unit of the channel, squared].

    NaN at lags for which there are too few samples.
    """
    measured = np.zeros((len(LAGS), len(CHANNELS)), dtype=bool)
    for stretch in stretches:
        measured[:, stretch.channels] |= (stretch.quiet > 3 * np.array(LAGS))[:, np.newaxis]
    sums, counts = np.zeros((len(LAGS), len(CHANNELS))), np.zeros((len(LAGS), len(CHANNELS)))
    for stretch in stretches:
        # a receiver of 10 Hz has a dozen samples before the brake: fewer lags of what is quiet, and no braking
        enough = np.count_nonzero(measured[:, stretch.channels], axis=0) >= FEWEST_LAGS
        for taken, end in ((enough, stretch.quiet), (~enough, len(stretch.values))):
            channels, values = stretch.channels[taken], stretch.values[:end].compress(taken, axis=1)
            for i, lag in enumerate(LAGS):
                if len(values) > 3 * lag:
                    difference = values[lag:] - values[:-lag]
                    sums[i, channels] += 0.5 * np.sum((difference - difference.mean(0)) ** 2, axis=0)
                    counts[i, channels] += len(difference) - 1
    return np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0)


def _count_quiet_samples(run: Run) -> int:
    """Return the number of samples of a run before the brake."""
    pressed = np.flatnonzero(run.pressure > BRAKING_PRESSURE)
    end = int(pressed[0]) - round(BEFORE_BRAKE / run.interval) if pressed.size else len(run.pressure)
    if run.hazard_length > 0:
        end = min(end, round(ON_HAZARD / run.interval))
    return max(end, 0)


def _compute_rounding_variance(campaign: Campaign) -> NDArray[np.float64]:
    """Return the variance of rounding to every channel's smallest step, float64 [7] [unit^2]; NaN for a constant."""
    steps = np.full(len(CHANNELS), np.inf)
    for j in np.flatnonzero(campaign.is_measured):
        values = np.sort(
            np.concatenate([run.response[run.find_samples(int(j)), j] for run in campaign.train])
        )
        gaps = np.diff(values)
        # equal readings may differ by the last bits of a change of unit
        steps[j] = np.min(gaps[gaps > 1e-12 * np.abs(values).max()], initial=np.inf)
    return np.where(np.isfinite(steps), steps, np.nan) ** 2 / 12


def _find_copies(campaign: Campaign) -> list[int]:
    """Return the channels that hold what another one does: one signal for both axles counts once."""
    front, rear = (CHANNELS.index(f"wheel_speed_{axle}") for axle in ("front", "rear"))
    both = campaign.is_measured[front] and campaign.is_measured[rear]
    alike = both and all(np.array_equal(r.response[:, front], r.response[:, rear]) for r in campaign.train)
    return [rear] if alike else []


def _find_problems(campaign: Campaign, floor: NDArray[np.float64], longest: NDArray[np.int64]) -> list[str]:
    """Return a sentence for every reason why the noise cannot be estimated."""
    problems = [
        f"{campaign.name}: channel {CHANNELS[j]} must change; it holds one value in all training runs: record it anew"
        for j in np.flatnonzero(np.isnan(floor))
    ]
    short = np.flatnonzero(campaign.is_measured & (longest <= FEWEST_SAMPLES))
    if short.size:
        names = ", ".join(CHANNELS[j] for j in short)
        problems.append(
            f"{campaign.name}: sensor noise is read from training runs, so one must hold more than {FEWEST_SAMPLES}"
            f" samples of each channel; the longest has {longest[short].min()} ({names}): lengthen the runs, or leave"
            " the channel out"
        )
    return problems


def whiten_channels(
    x: NDArray[np.float64],
    rho: NDArray[np.float64],
    sigma: NDArray[np.float64],
    sampled: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Return channels with AR(1) noise whitened to unit variance along the first axis, and stacked.

    Parameters
    ----------
    x : float64 [N, 7] or [N, 7, P] residuals or derivatives [unit of the channel]
    rho, sigma : float64 [7] AR(1) coefficients [1] and standard deviations [unit of the channel]
    sampled : bool [N, 7] whether a channel has a sample at an instant; None where all have

    Returns
    -------
    float64 [7 N] or [7 N, P]; 0 where a channel has no sample
    """
    known = np.ones(x.shape[:2], dtype=bool) if sampled is None else sampled
    white = _whiten_samples(x.reshape(*x.shape[:2], -1), known, rho, sigma)
    return white.reshape((-1, *x.shape[2:]))


@njit(cache=True, nogil=True, error_model="numpy")
def _whiten_samples(x, sampled, rho, sigma):  # type: ignore[no-untyped-def]
    white = np.zeros(x.shape)
    for c in range(x.shape[1]):
        rows, driven = np.flatnonzero(sampled[:, c]), sigma[c] * np.sqrt(1.0 - rho[c] ** 2)
        for i in range(len(rows)):
            now, before = x[rows[i], c], x[rows[i - 1], c]
            for k in range(x.shape[2]):
                white[rows[i], c, k] = (now[k] - rho[c] * before[k]) / driven if i else now[k] / sigma[c]
    return white


def unwhiten_channels(
    white: NDArray[np.float64],
    rho: NDArray[np.float64],
    sigma: NDArray[np.float64],
    sampled: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Return what was whitened by `whiten_channels`.

    Parameters
    ----------
    white : float64 [7 N] or [7 N, P]
    rho, sigma, sampled : that it was whitened with

    Returns
    -------
    float64 [N, 7] or [N, 7, P] [unit of the channel]; 0 in a channel that was not measured, and where one has no sample
    """
    rows = white.reshape((-1, len(rho), *white.shape[1:]))
    x = np.zeros_like(rows)
    for c in np.flatnonzero(np.isfinite(sigma)):
        own = slice(None) if sampled is None else sampled[:, c]
        driven = rows[own, c] * sigma[c]
        driven[1:] *= np.sqrt(1.0 - rho[c] ** 2)
        x[own, c] = filter_recursively(driven, rho[c])
    return x


def rewhiten_channels(
    white: NDArray[np.float64],
    before: tuple[NDArray[np.float64], NDArray[np.float64]],
    after: tuple[NDArray[np.float64], NDArray[np.float64]],
    sampled: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Return what was whitened with one noise as it is with another, float64 [7 N] or [7 N, P].

    Parameters
    ----------
    white : float64 [7 N] or [7 N, P]
    before, after : rho and sigma of either noise, float64 [7] each
    sampled : that it was whitened with
    """
    return whiten_channels(unwhiten_channels(white, *before, sampled), *after, sampled)


def correlate_with_next(x: NDArray[np.float64], most: float) -> float:
    """Return the correlation of each sample with the next, from 0 to ``most`` [1].

    Parameters
    ----------
    x : float64 [N] of mean 0
    most : beyond which more is not distinguished
    """
    power = float(x @ x)
    return min(max(float(x[1:] @ x[:-1]) / power, 0.0), most) if power > 0.0 else 0.0
