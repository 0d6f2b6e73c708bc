"""How a run misses its measured channels, and how that moves with the numbers of the car and the run's own offsets."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.stops import (
    OFFSET_LIMIT,
    OFFSETS,
    Stop,
    is_only_read,
    predict_stop,
    simulate_stop,
)
from tasks.vehicle.model.simulation import Simulation

STEPS = 1.0 / 30.0
"""Finite-difference step over the prior sigma."""
OFFSET_STEP = 0.02


def name_values(numbers: Sequence[JointNumber], values: NDArray[np.float64]) -> dict[str, float]:
    """Return the values of numbers by their names.

    Parameters
    ----------
    numbers : of a fit
    values : float64 [K] of these
    """
    return {n.name: float(v) for n, v in zip(numbers, values, strict=True)}


def differentiate_run(
    stop: Stop,
    numbers: tuple[JointNumber, ...],
    values: NDArray[np.float64],
    offsets: NDArray[np.float64],
    scales: NDArray[np.float64],
    motion: Simulation | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a run's weighted misfit, float64 [M], and its derivatives by numbers and own offsets, float64 [M, K + 3].

    Parameters
    ----------
    stop : the run
    numbers : that are free
    values : float64 [K] of these
    offsets : float64 [3] of the run
    scales : float64 [7] size of a misfit that counts one
    motion : of the run with these numbers, where it is known
    """
    k = len(numbers)
    if motion is None:
        motion = simulate_stop(stop, name_values(numbers, values), offsets)

    def residual(x: NDArray[np.float64], motion: Simulation | None) -> NDArray[np.float64]:
        return weigh_misfit(stop, name_values(numbers, x[:k]), x[k:], scales, motion=motion)

    x = np.concatenate((values, offsets))
    steps = np.concatenate(([STEPS * n.sigma for n in numbers], np.full(len(OFFSETS), OFFSET_STEP)))
    upper = np.concatenate(([n.upper for n in numbers], OFFSET_LIMIT))
    steps = np.where(x + steps <= upper, steps, -steps)
    here = residual(x, motion)
    columns = np.zeros((len(here), len(x)))
    for j, name in enumerate((*(n.name for n in numbers), *OFFSETS)):
        moved = x.copy()
        moved[j] += steps[j]
        columns[:, j] = (residual(moved, motion if is_only_read(stop, name) else None) - here) / steps[j]
    return here, columns


def weigh_misfit(
    stop: Stop,
    numbers: Mapping[str, float],
    offsets: NDArray[np.float64],
    scales: NDArray[np.float64],
    end: int | None = None,
    motion: Simulation | None = None,
) -> NDArray[np.float64]:
    """Return measured less model over the scales, float64 [M]; each sample weighs as at 20 Hz.

    Parameters
    ----------
    stop : the run
    numbers : of the car
    offsets : float64 [3] of the run
    scales : float64 [7] size of a misfit that counts one
    end : sample before which it is compared; None for the last
    motion : of the run with these numbers, where it is known
    """
    left = stop.measured - predict_stop(stop, numbers, offsets, motion)[:, stop.channels]
    apart = stop.model.samples / stop.model.count_samples()[stop.channels]
    weight = np.sqrt(np.minimum(apart * stop.model.run.interval / 0.05, 1.0))
    weighted = np.asarray(weight * left / scales[stop.channels], dtype=np.float64)
    return weighted[:end][stop.grid[:end]]
