"""Minimum, maximum, mean and standard deviation of columns of numbers that pass by in blocks."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass
class _Moments:
    """Of one column: number of values, and their extremes, mean and sum of squared deviations by component."""

    number: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    mean: NDArray[np.float64]
    squares: NDArray[np.float64]
    frames: int


@dataclass
class RunningStatistics:
    """Statistics of named columns, added block by block (Chan, Golub and LeVeque 1979)."""

    _columns: dict[str, _Moments] = field(default_factory=dict)

    def add(self, name: str, values: NDArray[Any], frames: int | None = None) -> None:
        """Take in a block of a column.

        Parameters
        ----------
        name : of the column
        values : [N] or [N, components], finite; N at least 1
        frames : that the block stands for; None is N [1]
        """
        self._join(
            name, _measure(np.asarray(values, np.float64).reshape(len(values), -1), frames or len(values))
        )

    def merge(self, other: "RunningStatistics") -> None:
        """Take in what another one has measured."""
        for name, block in other._columns.items():
            self._join(name, block)

    def _join(self, name: str, block: _Moments) -> None:
        known = self._columns.get(name)
        self._columns[name] = block if known is None else _merge(known, block)

    def summarise(self) -> dict[str, dict[str, list[Any]]]:
        """Return min, max, mean, std and count (frames) by column."""
        return {
            name: {
                "min": m.low.tolist(),
                "max": m.high.tolist(),
                "mean": m.mean.tolist(),
                "std": np.sqrt(m.squares / m.number).tolist(),
                "count": [m.frames],
            }
            for name, m in self._columns.items()
        }


def _measure(values: NDArray[np.float64], frames: int) -> _Moments:
    mean = values.mean(axis=0)
    return _Moments(
        number=len(values),
        low=values.min(axis=0),
        high=values.max(axis=0),
        mean=mean,
        squares=((values - mean) ** 2).sum(axis=0),
        frames=frames,
    )


def _merge(a: _Moments, b: _Moments) -> _Moments:
    number = a.number + b.number
    share = b.number / number
    step = b.mean - a.mean
    return _Moments(
        number=number,
        low=np.minimum(a.low, b.low),
        high=np.maximum(a.high, b.high),
        mean=a.mean + step * share,
        squares=a.squares + b.squares + step**2 * a.number * share,
        frames=a.frames + b.frames,
    )
