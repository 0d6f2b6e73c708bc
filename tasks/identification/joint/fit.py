"""One robust least squares over all numbers of a car and all offsets of its runs, from several starts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tasks.campaign.campaign import CHANNELS
from tasks.identification.inference.driver import LIFT
from tasks.identification.joint.derivatives import (
    differentiate_run,
    name_values,
    weigh_misfit,
)
from tasks.identification.joint.last_point import keep_last
from tasks.identification.joint.numbers import JointNumber, measure_peak_deceleration
from tasks.identification.joint.stops import (
    FITTED,
    OFFSET_LIMIT,
    OFFSET_SIGMA,
    OFFSETS,
    Stop,
    predict_stop,
    simulate_stop,
)
from tasks.vehicle.model.simulation import Simulation

Derivatives = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Weighted misfit of a run, float64 [M], and its derivatives, float64 [M, K + 3]."""
SCALES = {"speed": 0.15, "longitudinal_acceleration": 0.6, "wheel_speed_front": 0.6, "wheel_speed_rear": 0.6}
"""Size of a misfit that counts one before the residuals say how large it is [the channel's unit]."""
FACTORS = (1.0, 0.5, 2.0)
"""Brake gains from which a fit starts, over the gain that the deceleration by pressure suggests."""
MOST_EVALUATIONS = 30
ENOUGH = 1e-4
"""Relative change of cost and numbers at which a fit has converged."""


@dataclass(frozen=True, kw_only=True)
class JointFit:
    """A fit of numbers and offsets.

    Parameters
    ----------
    numbers : that were fitted
    values : float64 [K] of the numbers
    offsets : float64 [R, 3] of the runs
    cost : robust misfit with the priors, over 2
    residuals : weighted, one float64 [M] a run, the channels of an instant together
    slopes : derivatives by the numbers, the run's own offsets taken out, one float64 [M, K] a run
    grids : where each channel was compared, one bool [N, C] a run with M of them true
    interval : between the instants of a run [s]
    information : float64 [K, K] of the numbers, offsets taken out, priors included
    scales : size of a misfit that counts one, by place in `CHANNELS` [the channel's unit]
    delay_doubt : standard deviation of how late the brakes answer, for nobody knows when the driver lifts [s]
    """

    numbers: tuple[JointNumber, ...]
    values: NDArray[np.float64]
    offsets: NDArray[np.float64]
    cost: float
    residuals: tuple[NDArray[np.float64], ...]
    slopes: tuple[NDArray[np.float64], ...]
    grids: tuple[NDArray[np.bool_], ...]
    interval: float
    information: NDArray[np.float64]
    scales: NDArray[np.float64]
    delay_doubt: float

    @property
    def removable_numbers(self) -> tuple[JointNumber, ...]:
        """Numbers of the fit that had to earn their place."""
        return tuple(number for number in self.numbers if number.removable)

    @property
    def by_name(self) -> dict[str, float]:
        """Values of the numbers."""
        return name_values(self.numbers, self.values)


def fit_jointly(
    stops: Sequence[Stop],
    numbers: tuple[JointNumber, ...],
    starts: Sequence[Mapping[str, float]],
    *,
    scales: NDArray[np.float64] | None = None,
    offsets: NDArray[np.float64] | None = None,
) -> list[JointFit]:
    """Fit numbers and offsets from each start, the best fit first.

    Parameters
    ----------
    stops : training runs
    numbers : that are free
    starts : values by name; others start at 0, those that end there at 0.3 of their sigma
    scales : float64 [7] size of a misfit that counts one; None takes the first guess
    offsets : float64 [R, 3] where the runs' own numbers start
    """
    sizes = np.array([SCALES.get(name, 1.0) for name in CHANNELS]) if scales is None else scales
    fits = [_fit_from(stops, numbers, start, sizes, offsets) for start in starts]
    return sorted(fits, key=lambda found: found.cost)


def suggest_starts(stops: Sequence[Stop]) -> list[dict[str, float]]:
    """Return starts about the brake gain that the deceleration by pressure suggests.

    Parameters
    ----------
    stops : training runs
    """
    slopes = []
    for stop in stops:
        if stop.onset + 5 >= stop.model.samples:
            continue
        speed = stop.model.measured[stop.onset :, CHANNELS.index("speed")]
        pressure = stop.model.pressure[stop.onset :]
        impulse = float(pressure.sum()) * stop.model.run.interval
        slopes.append(float(speed[0] - speed[-1]) / max(impulse, 1e-9))
    if not slopes:
        return [{}]
    vehicle = stops[0].model.vehicle
    expected = vehicle.brake_gain / (vehicle.wheel_radius * vehicle.mass)
    ratio = float(np.median(slopes)) / expected
    return [{"pressure_gain": factor * ratio - 1.0} for factor in FACTORS]


def lead_offsets(
    stop: Stop, numbers: Mapping[str, float], scales: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a run's own offsets from what precedes the brake alone, so that the stop itself is predicted.

    Parameters
    ----------
    stop : a run that no fit has seen
    numbers : of the car
    scales : float64 [7] size of a misfit that counts one
    """
    end = max(stop.onset - 1, 3) if stop.onset < stop.model.samples else max(stop.model.samples // 5, 3)

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate((weigh_misfit(stop, numbers, x, scales, end), x / OFFSET_SIGMA))

    limit = OFFSET_LIMIT
    found = least_squares(residual, np.zeros(len(OFFSETS)), bounds=(-limit, limit), max_nfev=15)
    return np.asarray(found.x)


def _fit_from(
    stops: Sequence[Stop],
    numbers: tuple[JointNumber, ...],
    start: Mapping[str, float],
    scales: NDArray[np.float64],
    offsets: NDArray[np.float64] | None,
) -> JointFit:
    k, own = len(numbers), len(OFFSETS)
    lower = np.concatenate(([n.lower for n in numbers], np.tile(-OFFSET_LIMIT, len(stops))))
    upper = np.concatenate(([n.upper for n in numbers], np.tile(OFFSET_LIMIT, len(stops))))
    began = np.zeros((len(stops), own)) if offsets is None else offsets
    x = np.concatenate(
        ([start.get(n.name, 0.3 * n.sigma if n.lower == 0.0 else 0.0) for n in numbers], began.ravel())
    )
    x = np.clip(x, lower + 1e-6 * (upper - lower), upper - 1e-6 * (upper - lower))
    prior = np.concatenate(([1.0 / n.sigma for n in numbers], np.tile(1.0 / OFFSET_SIGMA, len(stops))))

    def take_run(i: int, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return x[:k], x[k + own * i : k + own * (i + 1)]

    @keep_last
    def move_runs(x: NDArray[np.float64]) -> list[Simulation]:
        parts = (take_run(i, x) for i in range(len(stops)))
        return [
            simulate_stop(stop, name_values(numbers, values), offset)
            for stop, (values, offset) in zip(stops, parts, strict=True)
        ]

    @keep_last
    def differentiate_runs(x: NDArray[np.float64]) -> list[Derivatives]:
        return [
            differentiate_run(stop, numbers, *take_run(i, x), scales, motion)
            for i, (stop, motion) in enumerate(zip(stops, move_runs(x), strict=True))
        ]

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        runs = []
        for i, (stop, motion) in enumerate(zip(stops, move_runs(x), strict=True)):
            values, offset = take_run(i, x)
            runs.append(weigh_misfit(stop, name_values(numbers, values), offset, scales, motion=motion))
        return np.concatenate((*runs, prior * x))

    def jacobian(x: NDArray[np.float64]) -> NDArray[np.float64]:
        runs = []
        for i, (_, columns) in enumerate(differentiate_runs(x)):
            placed = np.zeros((len(columns), len(x)))
            placed[:, :k], placed[:, k + own * i : k + own * (i + 1)] = columns[:, :k], columns[:, k:]
            runs.append(placed)
        return np.vstack((*runs, np.diag(prior)))

    found = least_squares(
        residual, x, jac=jacobian, bounds=(lower, upper), loss="soft_l1", x_scale="jac", ftol=ENOUGH, xtol=ENOUGH,
        max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    return describe_fit(
        stops,
        differentiate_runs(found.x),
        numbers,
        found.x[:k],
        found.x[k:].reshape(-1, own),
        scales,
        float(found.cost),
    )


def describe_fit(
    stops: Sequence[Stop],
    runs: Sequence[Derivatives],
    numbers: tuple[JointNumber, ...],
    values: NDArray[np.float64],
    offsets: NDArray[np.float64],
    scales: NDArray[np.float64],
    cost: float,
) -> JointFit:
    """Return a point of the fit from the misfits and derivatives of its runs.

    Parameters
    ----------
    stops : training runs
    runs : of each training run at the point, as `differentiate_run` returns them
    numbers : of the fit
    values : float64 [K] of the numbers
    offsets : float64 [R, 3] of the runs
    scales : float64 [7] size of a misfit that counts one
    cost : robust misfit with the priors, over 2
    """
    k = len(numbers)
    slopes = tuple(_take_out_offsets(columns[:, :k], columns[:, k:]) for _, columns in runs)
    information = np.diag([1.0 / n.sigma**2 for n in numbers]) + sum(a.T @ a for a in slopes)
    return JointFit(
        numbers=numbers, values=values, offsets=offsets, cost=cost, residuals=tuple(left for left, _ in runs),
        slopes=slopes, grids=tuple(stop.grid for stop in stops),
        interval=stops[0].model.run.interval, information=np.asarray(information), scales=scales,
        delay_doubt=_doubt_delays(stops, offsets),
    )  # fmt: skip


def _doubt_delays(stops: Sequence[Stop], offsets: NDArray[np.float64]) -> float:
    """Return by how much late brakes may be told wrong because no channel says when the driver lifts [s].

    A drive force that goes a moment later takes as much off the speed as brakes that answer later by its share of
    theirs. A driver has one habit: it does not average out over the runs.
    """
    drives = np.abs(offsets[:, OFFSETS.index("drive")])
    guessed = [
        (float(drive), measure_peak_deceleration(stop.model))
        for stop, drive in zip(stops, drives, strict=True)
        if stop.guesses_lift
    ]
    shares = [drive / peak for drive, peak in guessed if peak > 0.0]
    return 0.5 * LIFT * float(np.median(shares)) if shares else 0.0


def _take_out_offsets(numbers: NDArray[np.float64], offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return derivatives by the numbers with what the run's own offsets can take from them taken out."""
    inner = offsets.T @ offsets + np.diag(1.0 / OFFSET_SIGMA**2)
    return np.asarray(numbers - offsets @ np.linalg.solve(inner, offsets.T @ numbers), dtype=np.float64)


def choose_misfit_scales(fitted: JointFit, stops: Sequence[Stop]) -> NDArray[np.float64]:
    """Return the size of a misfit that counts one, by each channel's residuals; float64 [7] [the channel's unit].

    Noise and what the model does not know count together: no channel weighs more than the model can follow it.

    Parameters
    ----------
    fitted : a first fit
    stops : its runs
    """
    least = np.array([0.2 * SCALES.get(name, 0.0) for name in CHANNELS])
    misfit = measure_misfit(fitted, stops)
    return np.where(np.isfinite(misfit), np.maximum(misfit, least), fitted.scales)


def measure_misfit(fitted: JointFit, stops: Sequence[Stop]) -> NDArray[np.float64]:
    """Return the robust standard deviation of each channel's residuals, float64 [7] [the channel's unit].

    NaN where a channel is not compared.

    Parameters
    ----------
    fitted : a fit
    stops : its runs
    """
    misfit = np.full(len(CHANNELS), np.nan)
    for name in FITTED:
        place = CHANNELS.index(name)
        left = [
            (stop.model.measured - predict_stop(stop, fitted.by_name, offsets))[
                stop.model.find_samples(place), place
            ]
            for stop, offsets in zip(stops, fitted.offsets, strict=True)
            if place in stop.channels
        ]
        if left:
            misfit[place] = 1.4826 * float(np.median(np.abs(np.concatenate(left))))
    return misfit
