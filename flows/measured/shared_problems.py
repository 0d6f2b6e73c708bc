"""One fault that many runs or files share: told once, with the places it holds for and the range of its figures."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from catalogs.sentences import shorten
from tasks.campaign.checks import list_names

SHARED = 3
"""Places from which a fault is told once for all of them [1]."""
NUMBER = re.compile(r"(?<![\w.^-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")
"""A figure of a sentence; no digit of a name (run-01, w_2) or of a unit (m/s^2)."""


@dataclass(frozen=True, kw_only=True)
class PlacedProblem:
    """A fault and where it is.

    Parameters
    ----------
    name : of the run or the file, short
    place : the same in full; empty where the sentence needs none
    sentence : the fault, without the place
    """

    name: str
    place: str
    sentence: str


def place_in_file(path: Path, problem: str) -> PlacedProblem:
    """Return a file's fault, whose sentence begins with the file's path or name, without it.

    Parameters
    ----------
    path : of the file
    problem : as its reader told it
    """
    place = next((start for start in (str(path), path.name) if problem.startswith(start)), "")
    sentence = problem[len(place) :].lstrip(": ") if place else problem
    return PlacedProblem(name=path.name, place=place, sentence=sentence)


def join_shared_problems(
    found: Sequence[PlacedProblem], total: int, kind: str, *, exact: bool = False
) -> list[str]:
    """Return one sentence per fault, where three or more places that share a fault share its sentence.

    Figures that differ stand as a range, such as 212..250. Of two faults of one place that differ in figures alone, the
    first is joined with the first of other places.

    Parameters
    ----------
    found : in the order in which they are told
    total : runs or files that were looked at [1]
    kind : what they are, such as runs
    exact : join only what is told in the same figures, as the names of signals are
    """
    groups: dict[tuple[str, int], list[PlacedProblem]] = {}
    told: dict[tuple[str, str], int] = {}
    for problem in found:
        form = problem.sentence if exact else NUMBER.sub("#", problem.sentence)
        before = told.get((problem.place, form), 0)
        told[problem.place, form] = before + 1
        groups.setdefault((form, before), []).append(problem)
    return [
        sentence
        for group in groups.values()
        for sentence in (
            [_join_group(group, total, kind)]
            if len(group) >= SHARED
            else [f"{problem.place}: {problem.sentence}".removeprefix(": ") for problem in group]
        )
    ]


def _join_group(group: Sequence[PlacedProblem], total: int, kind: str) -> str:
    names = [shorten(problem.name, 60) for problem in group]
    return f"in {len(names)} of {total} {kind} ({list_names(names)}): {_write_ranges(group)}"


def _write_ranges(group: Sequence[PlacedProblem]) -> str:
    """Return the sentence of a group, each figure that differs as a range from the lowest to the highest."""
    if len({problem.sentence for problem in group}) == 1:
        return group[0].sentence
    figures = zip(*(NUMBER.findall(problem.sentence) for problem in group), strict=True)
    ranges = iter([_write_range(values) for values in figures])
    return NUMBER.sub(lambda _: next(ranges), group[0].sentence)


def _write_range(values: Sequence[str]) -> str:
    low, high = min(values, key=float), max(values, key=float)
    return low if float(low) == float(high) else f"{low}..{high}"
