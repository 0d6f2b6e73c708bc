"""The course of a street's road in plan and height: stretches of a curvature and a grade, and how a seed draws them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.scene.street.noise import named_generator, smooth_step

Floats = NDArray[np.float64]
Range = tuple[float, float]

_LEVEL_START = 12.0
"""Length from the start of a route that is drawn straight and level [m]."""
_MOST_TURN = 1.2
"""Turn from its first direction beyond which a drawn road bends back [rad]."""


@dataclass(frozen=True, kw_only=True)
class Stretches:
    """Stretches one after the other; before the first and beyond the last, theirs go on.

    Parameters
    ----------
    length : of each, the first counted from station 0 [m]
    curvature : to the left positive [1/m]
    grade : rise of the road per metre of way; negative falls [1]
    transition : length from its begin over which a stretch takes its curvature and grade [m]
    bloss_share : 0 lets curvature and grade change evenly along a transition, as on a clothoid, and 1 begins and ends
        the change smoothly (Bloss 1936) [1]

    Raises
    ------
    InputError
        If the stretches differ in number, or one is too steep.
    """

    length: tuple[float, ...]
    curvature: tuple[float, ...]
    grade: tuple[float, ...]
    transition: tuple[float, ...]
    bloss_share: float

    def __post_init__(self) -> None:
        counts = [len(values) for values in (self.length, self.curvature, self.grade, self.transition)]
        if len(set(counts)) > 1:
            raise InputError(
                "a course needs a length, a curvature, a grade and a transition for each stretch; it has"
                f" {', '.join(map(str, counts))}"
            )
        if max(map(abs, self.grade)) >= 1:
            raise InputError(f"the grades of a course must lie within -1 to 1; they are {self.grade}")

    @property
    def starts(self) -> Floats:
        """Station at which each begins [m]."""
        return np.concatenate([[0.0], np.cumsum(self.length[:-1])])

    @property
    def knots(self) -> Floats:
        """Stations between which curvature and grade change evenly or not at all, on clothoids [m]."""
        starts = self.starts
        return np.unique(np.concatenate([starts, starts + self.transition]))

    def curvature_at(self, station: Floats) -> Floats:
        """Return the curvature at stations [N] [m], in [1/m]."""
        return self._blend(np.asarray(self.curvature), station)

    def grade_at(self, station: Floats) -> Floats:
        """Return the grade at stations [N] [m], in [1]."""
        return self._blend(np.asarray(self.grade), station)

    def _blend(self, value: Floats, station: Floats) -> Floats:
        total = np.full(station.shape, value[0])
        for k in range(1, len(value)):
            way = np.clip((station - self.starts[k]) / max(self.transition[k], 1e-9), 0.0, 1.0)
            way = (1 - self.bloss_share) * way + self.bloss_share * smooth_step(way)
            total += (value[k] - value[k - 1]) * way
        return total


@dataclass(frozen=True, kw_only=True)
class CourseRanges:
    """What a seed draws the course of a street from; each number lies between two.

    Parameters
    ----------
    straight, bend : lengths of straights and of bends [m]
    radius : of the bends [m]
    transition : lengths of clothoids and of vertical curves [m]
    slope : lengths of stretches of one grade [m]
    grade : rise per metre of way [1]
    end_radius : of the bend beyond the route, which closes the view [m]
    """

    straight: Range
    bend: Range
    radius: Range
    transition: Range
    slope: Range
    grade: Range
    end_radius: Range


def draw_stretches(ranges: CourseRanges, route_length: float, beyond: float, seed: int) -> Stretches:
    """Draw a course: straights and bends to either side in turn, and hills that follow them in no step.

    Parameters
    ----------
    ranges : of its numbers
    route_length, beyond : how far the route goes, and the street after it [m]
    seed : the street's seed [1]
    """
    rng = named_generator(seed, "course")
    bends = _draw_bends(rng, ranges, route_length, beyond)
    hills = _draw_hills(rng, ranges, route_length + beyond)
    starts = np.unique([start for start, *_ in (*bends, *hills)])
    rows = []
    for start in starts:
        _, curvature, bend_transition = [row for row in bends if row[0] <= start][-1]
        _, grade, hill_transition = [row for row in hills if row[0] <= start][-1]
        rows.append(
            (curvature, grade, bend_transition if start in [row[0] for row in bends] else hill_transition)
        )
    curvatures, grades, transitions = (tuple(map(float, column)) for column in zip(*rows, strict=True))
    return Stretches(
        length=(*np.diff(starts).tolist(), route_length + beyond - float(starts[-1])),
        curvature=curvatures,
        grade=grades,
        transition=transitions,
        bloss_share=0.0,
    )


def _draw_bends(
    rng: np.random.Generator, ranges: CourseRanges, route_length: float, beyond: float
) -> list[tuple[float, float, float]]:
    """Return station, curvature and transition of each stretch; the last bend is beyond the route."""
    rows, station, turned = [(0.0, 0.0, 0.0)], _LEVEL_START + rng.uniform(0, ranges.straight[1]), 0.0
    while station < route_length - 30.0:
        side = float(rng.choice([-1.0, 1.0]))
        curvature, length = side / rng.uniform(*ranges.radius), rng.uniform(*ranges.bend)
        if abs(turned + curvature * length) > _MOST_TURN:
            curvature = -curvature
        transition = min(rng.uniform(*ranges.transition), length)
        rows.append((station, curvature, transition))
        turned += curvature * length
        station += length
        rows.append((station, 0.0, rng.uniform(*ranges.transition)))
        station += max(rng.uniform(*ranges.straight), rows[-1][2])
    end = float(rng.choice([-1.0, 1.0]) if abs(turned) < 0.5 else -np.sign(turned)) / rng.uniform(
        *ranges.end_radius
    )
    kept = [row for row in rows if row[0] < route_length - 10.0]
    return [*kept, (route_length, end, min(60.0, beyond / 2))]


def _draw_hills(
    rng: np.random.Generator, ranges: CourseRanges, length: float
) -> list[tuple[float, float, float]]:
    """Return station, grade and transition of each stretch, which begins before the last transition has ended never."""
    rows, station = [(0.0, 0.0, 0.0)], _LEVEL_START + rng.uniform(0, 20.0)
    while station < length:
        transition = rng.uniform(*ranges.transition)
        rows.append((station, rng.uniform(*ranges.grade), transition))
        station += max(rng.uniform(*ranges.slope), transition)
    return rows
