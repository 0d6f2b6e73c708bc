"""The verdict over one clip's telemetry: which laws it breaks, and which column that points at."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.eval.physics.body import body_laws, frame_laws, outcome_laws, pose_laws, surface_laws
from tasks.eval.physics.constants import Constants
from tasks.eval.physics.half_step import half_step
from tasks.eval.physics.laws import Law, command_laws, motion_laws, wheel_laws

COPIED = "frame rows are ticks: "
"""How the laws that tie the two tables are named."""

NEAR = 3
"""Laws by which a suspect may be worse and still be compared by its pattern [1]."""

TRIAL = 0.01
"""Trial fault, of the column's value or range [1]."""

FAINT = 1e-4
"""Excess below which nothing is compared [1]."""


@dataclass(frozen=True, kw_only=True)
class PhysicsVerdict:
    """What the laws say of one clip.

    Parameters
    ----------
    passed : whether every law holds
    laws : all that could be evaluated
    column : the column that the broken laws point at, as table.column; empty if none is broken
    also : columns that explain the broken laws as well
    """

    passed: bool
    laws: tuple[Law, ...]
    column: str
    also: tuple[str, ...]

    @property
    def broken(self) -> tuple[Law, ...]:
        """Laws that do not hold, worst first."""
        return tuple(sorted((x for x in self.laws if x.broken), key=lambda x: -x.excess))


def audit_clip(
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
) -> PhysicsVerdict:
    """Hold one clip's stored columns against every law.

    Parameters
    ----------
    ticks : columns of the 1 kHz table, units as in ``tasks.conventions``
    frames : columns of the frame table
    facts : the clip's row: scenario, surface, outcome and check
    constants : frozen car and pavement
    """
    laws = laws_of(ticks, frames, facts, constants)
    suspects = suspects_of(laws)
    if len(suspects) > 1:
        suspects = _by_pattern(suspects, laws, ticks, frames, facts, constants)
    return PhysicsVerdict(
        passed=not any(x.broken for x in laws),
        laws=laws,
        column=suspects[0] if suspects else "",
        also=tuple(suspects[1:]),
    )


def laws_of(
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
) -> tuple[Law, ...]:
    """Every law that can be evaluated on one clip.

    Parameters
    ----------
    ticks, frames, facts, constants : as in ``audit_clip``
    """
    half = half_step(ticks, facts, constants)
    found = [
        *wheel_laws(ticks, facts, "f", constants, half),
        *wheel_laws(ticks, facts, "r", constants, half),
        *motion_laws(ticks, facts, constants, half),
        *command_laws(ticks, facts, constants),
        *body_laws(ticks, facts, constants),
        *surface_laws(facts, constants),
        *frame_laws(ticks, frames, facts),
        *pose_laws(frames, constants),
        *outcome_laws(ticks, frames, facts, constants),
    ]
    return tuple(x for x in found if x is not None)


def suspects_of(laws: tuple[Law, ...]) -> list[str]:
    """Columns that can explain the broken laws, best first.

    A faulty column breaks laws that it enters and no other; a law that it enters may hold all the same where it
    weighs little, so a broken law unexplained counts ten times as much as a whole one. A frame column that still
    equals its tick column is no suspect apart from it.

    Parameters
    ----------
    laws : evaluated laws
    """
    broken = {x.name for x in laws if x.broken}
    if not broken:
        return []
    enters: dict[str, set[str]] = {}
    for x in laws:
        for column in x.columns:
            enters.setdefault(column, set()).add(x.name)
    for column in list(enters):
        twin = column.replace("frames.", "ticks.")
        if twin != column and twin in enters and not enters[column] & enters[twin] & broken:
            continue
        if twin != column and twin in enters and f"{COPIED}{twin[6:]}" not in broken:
            del enters[column]
    cost = {c: 10 * len(broken - names) + len(names - broken) for c, names in enters.items()}
    best = min(cost.values())
    return sorted((c for c in cost if cost[c] <= best + NEAR), key=lambda c: (cost[c], c))


def _by_pattern(
    suspects: list[str],
    laws: tuple[Law, ...],
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
) -> list[str]:
    """Suspects by how alike the excesses are that a trial fault in each of them would cause."""
    seen = {x.name: np.log10(np.clip(x.excess, FAINT, 1 / FAINT)) for x in laws}
    rows = [x.at for x in laws if x.broken and not any("frames." in c for c in x.columns)]
    part = slice(min(rows), max(rows) + 1) if rows else slice(None)
    kinds = ((TRIAL, 0.0), (-TRIAL, 0.0), (0.0, TRIAL), (0.0, -TRIAL))
    distance = {}
    for column in suspects:
        table, _, name = column.partition(".")
        trials = []
        for (share, shift), where in product(kinds, (slice(None), part)):
            changed = _faulty(table, name, share, shift, where, ticks, frames, facts)
            excess = {
                x.name: np.log10(np.clip(x.excess, FAINT, 1 / FAINT)) for x in laws_of(*changed, constants)
            }
            common = [n for n in seen if n in excess and (seen[n] > 0 or excess[n] > 0)]
            trials.append(np.mean([abs(seen[n] - excess[n]) for n in common]) if common else np.inf)
        distance[column] = float(min(trials))
    return sorted(suspects, key=lambda c: distance[c])


def _faulty(
    table: str,
    name: str,
    share: float,
    shift: float,
    where: slice,
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
) -> tuple[Mapping[str, NDArray[Any]], Mapping[str, NDArray[Any]], Mapping[str, Any]]:
    """The tables with rows of one column scaled by 1 + share and shifted by a share of its range."""
    if table == "clips":
        return ticks, frames, {**facts, name: facts[name] * (1 + share + shift)}
    here = ticks if table == "ticks" else frames
    values = np.asarray(here[name], np.float64)
    changed = values.copy()
    if table == "frames":
        where = slice(None)
    changed[where] = values[where] * (1 + share) + shift * np.ptp(values)
    if table == "frames":
        return ticks, {**frames, name: changed}, facts
    copied = np.array_equal(np.asarray(ticks[name])[frames["tick"]], frames[name])
    rows = changed[frames["tick"]] if copied else frames[name]
    return {**ticks, name: changed}, {**frames, name: rows}, facts
