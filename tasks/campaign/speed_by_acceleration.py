"""Speed as the integral of what an accelerometer reads: scale, delay and zeros of the two, whatever drives the car.

The accelerometer reads gravity along the dive of the body too, about 3 % of the deceleration, which counts as its
scale; along a slope of the road it reads more by g times the sine, which counts as its zero in that run. Scale, dive
and delay of the two are the same in all runs, and a slope is not. The median over the runs of what the accelerometer
reads too much is its zero, and what a run reads beyond it is the slope of that run, as far as runs scatter more than a
zero drifts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import MASKED_SPEED
from tasks.campaign.measured import MeasuredRun
from tasks.conventions import GRAVITY

FEWEST_SAMPLES = 5
"""Samples of the speed that a run needs beside its own two numbers [1]."""
LEAST_EXPLAINED = 0.9
"""Share of what the speeds do beside straight lines that the acceleration must explain: less is noise of both [1]."""
LONGEST_MEMORY = 0.99
"""Largest correlation from sample to sample that errors are widened for [1]."""


@dataclass(frozen=True, kw_only=True)
class SpeedByAcceleration:
    """Scale, delay and zeros of an accelerometer and a speed that read one motion.

    Parameters
    ----------
    scale : of the accelerometer over the rate of speed [1]
    delay : of the speed behind the accelerometer [s]
    zeros : float64 [R] what the accelerometer reads beyond that in each run; NaN in one of too few samples [m/s2]
    errors : float64 [R] their standard errors [m/s2]
    """

    scale: float
    delay: float
    zeros: NDArray[np.float64]
    errors: NDArray[np.float64]


def pair_samples(
    speed: NDArray[np.float64], felt: NDArray[np.float64], interval: float
) -> NDArray[np.float64]:
    """Return time, speed, integral of the acceleration, and acceleration, float64 [N, 4].

    Parameters
    ----------
    speed, felt : of one run, the acceleration without gaps, float64 [N] [m/s, m/s2]
    interval : between the instants [s]
    """
    time = np.arange(len(felt)) * interval
    gained = np.concatenate(([0.0], np.cumsum(0.5 * (felt[1:] + felt[:-1]) * interval)))
    return np.column_stack((time, speed, gained, felt))


def relate_speed_to_acceleration(runs: Sequence[NDArray[np.float64]]) -> SpeedByAcceleration | None:
    """Return scale, delay and zeros by least squares over all runs; None where too little moves.

    Parameters
    ----------
    runs : of `pair_samples`
    """
    lines = [_fit_line(run) for run in runs]
    known = [line for line in lines if line is not None]
    if not known:
        return None
    left = np.vstack([rest for _, rest, _ in known])
    (share, late), _, rank, _ = np.linalg.lstsq(left[:, 1:], left[:, 0], rcond=None)
    missed = [rest @ np.array([1.0, -share, -late]) for _, rest, _ in known]
    unexplained = sum(float(e @ e) for e in missed)
    if rank < 2 or share <= 0.0 or unexplained > (1.0 - LEAST_EXPLAINED) * float(left[:, 0] @ left[:, 0]):
        return None
    shared = np.linalg.inv(left[:, 1:].T @ left[:, 1:])
    noise = _measure_noise(missed)
    zeros, errors = np.full(len(runs), np.nan), np.full(len(runs), np.nan)
    for i, line in enumerate(lines):
        if line is not None:
            slopes, _, spread = line
            zeros[i] = (share * slopes[1] + late * slopes[2] - slopes[0]) / share
            errors[i] = np.sqrt(noise * (1.0 / spread + slopes[1:] @ shared @ slopes[1:])) / share
    return SpeedByAcceleration(scale=1.0 / share, delay=-late / share, zeros=zeros, errors=errors)


def _fit_line(
    run: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float] | None:
    """Return slopes over time of the other three columns, what is left of them, and the sum of squares of the time."""
    if len(run) < FEWEST_SAMPLES:
        return None
    time, others = run[:, 0] - run[:, 0].mean(), run[:, 1:] - run[:, 1:].mean(axis=0)
    spread = float(time @ time)
    slopes = time @ others / spread
    return slopes, others - np.outer(time, slopes), spread


def _measure_noise(missed: Sequence[NDArray[np.float64]]) -> float:
    """Return the variance of what is missed, widened by its correlation from sample to sample [m2/s2]."""
    power = float(np.mean(np.concatenate(missed) ** 2))
    products = np.concatenate([e[1:] * e[:-1] for e in missed])
    kept = float(np.clip(np.mean(products) / max(power, 1e-12), 0.0, LONGEST_MEMORY))
    return power * (1.0 + kept) / (1.0 - kept)


def estimate_slopes(
    runs: Sequence[MeasuredRun], *, drift: float, fewest_runs: float, steepest: float, shortest: float
) -> dict[str, float]:
    """Return the slope of the road in each run by its name, uphill positive, by what its accelerometer reads [rad].

    The zeros of the runs scatter by slopes, by drift and by their errors; only the share of the slopes in that counts
    (James and Stein 1961). No run has a slope where there are too few, or where they scatter no more than drift and
    errors explain.

    Parameters
    ----------
    runs : whose acceleration is measured, and not computed from the speed
    drift : standard deviation over the runs of a session of an accelerometer's zero [m/s^2]
    fewest_runs : of which a deviation is reported [1]
    steepest : sine beyond which no slope is believed: the accelerometer is off by something else [1]
    shortest : time in motion that a run needs for a mean [s]
    """
    apart = measure_apart(runs, shortest)
    if len(apart) < fewest_runs:
        return {}
    zeros, errors = np.array(list(apart.values())).T
    share = 1.0 - (drift**2 + float(np.mean(errors**2))) / max(float(np.var(zeros)), drift**2)
    if share <= 0.0:
        return {}
    sines = share * (zeros - np.median(zeros)) / GRAVITY
    return dict(zip(apart, np.arcsin(np.clip(sines, -steepest, steepest)).tolist(), strict=True))


def measure_apart(runs: Sequence[MeasuredRun], shortest: float) -> dict[str, tuple[float, float]]:
    """Return by how much the acceleration of each run differs from the rate of speed, and how surely [m/s^2].

    The road's slope is positive uphill. Runs without both channels, without motion, or with a mapped slope are left
    out.

    Parameters
    ----------
    runs, shortest : as of `estimate_slopes`
    """
    pairs = {}
    for run in runs:
        if {"speed", "longitudinal_acceleration"} <= run.columns.keys() and "road_slope" not in run.columns:
            speed, felt = run.columns["speed"], run.columns["longitudinal_acceleration"]
            slow = np.flatnonzero(speed <= MASKED_SPEED)
            pair = pair_samples(speed, felt, run.interval)[: slow[0] if slow.size else None]
            if len(pair) * run.interval >= shortest:
                pairs[run.name] = pair
    found = relate_speed_to_acceleration(list(pairs.values()))
    if found is None:
        return {}
    return {
        run: (float(zero), float(error))
        for run, zero, error in zip(pairs, found.zeros, found.errors, strict=True)
        if np.isfinite(zero)
    }
