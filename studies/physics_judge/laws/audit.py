"""The physics verdict on one clip's telemetry: the laws that it breaks, and the column that explains them best."""

from collections.abc import Mapping, Set
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.physics_judge.laws.body import body_laws
from studies.physics_judge.laws.clip_row import command_laws, outcome_laws, road_height_laws, surface_laws
from studies.physics_judge.laws.constants import ClipColumns, Constants
from studies.physics_judge.laws.coupled_laws import coupled_laws
from studies.physics_judge.laws.effects import find_unjudged
from studies.physics_judge.laws.frames import frame_laws, pose_check_laws, pose_laws
from studies.physics_judge.laws.half_step import follow_half_step
from studies.physics_judge.laws.law import Law, motion_laws, wheel_laws
from studies.physics_judge.laws.route import RouteLine, grade_laws, route_laws

COPIED = "frame rows are ticks: "
"""Prefix of the names of the laws that relate the two tables."""

NEAR = 3
"""Cost by which a suspect may exceed the best one and still be compared by its pattern [1]."""

TRIAL = 0.01
"""Trial fault as a share of the column's value or range [1]."""

FAINT = 1e-4
"""Least excess in the comparison [1]."""


@dataclass(frozen=True, kw_only=True)
class PhysicsVerdict:
    """Result of all laws on one clip.

    Parameters
    ----------
    passed : whether every law holds
    laws : all that could be evaluated
    column : the column that explains the broken laws best, as table.column; empty if none is broken
    also : columns that explain the broken laws as well
    not_judged : laws that this car or road takes away, each with the reason
    """

    passed: bool
    laws: tuple[Law, ...]
    column: str
    also: tuple[str, ...]
    not_judged: Mapping[str, str]

    @property
    def broken(self) -> tuple[Law, ...]:
        """Laws that do not hold, worst first."""
        return tuple(sorted((x for x in self.laws if x.broken), key=lambda x: -x.excess))


def audit_clip(
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
    route: RouteLine | None = None,
    absent: Set[str] = frozenset(),
) -> PhysicsVerdict:
    """Check one clip's stored columns by every law.

    Parameters
    ----------
    ticks : columns of the 1 kHz table, units as in ``tasks.conventions``
    frames : columns of the frame table
    facts : the clip's row: scenario, surface, outcome and check
    constants : frozen car and pavement
    route : the scene's route; None where it is not at hand, and no pose is held against it
    absent : columns, as table.column, that an older dataset does not have: no law that relates one is evaluated
    """
    found = evaluate_laws(ticks, frames, facts, constants, route)
    laws = tuple(law for law in found if not law.columns & absent)
    suspects = rank_suspects(laws)
    if len(suspects) > 1:
        suspects = _rank_by_pattern(suspects, laws, ticks, frames, facts, constants)
    return PhysicsVerdict(
        passed=not any(x.broken for x in laws),
        laws=laws,
        column=suspects[0] if suspects else "",
        also=tuple(suspects[1:]),
        not_judged=find_unjudged(facts, constants),
    )


def evaluate_laws(
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
    route: RouteLine | None = None,
) -> tuple[Law, ...]:
    """Evaluate every law that can be evaluated on one clip.

    Parameters
    ----------
    ticks, frames, facts, constants, route : as in ``audit_clip``
    """
    clip = ClipColumns(ticks, facts, constants)
    if constants.mode == "paper":
        half = follow_half_step(clip)
        moving = [
            *wheel_laws(clip, "f", half),
            *wheel_laws(clip, "r", half),
            *motion_laws(clip, half),
            *road_height_laws(clip),
            *body_laws(clip, half),
        ]
    else:
        moving = coupled_laws(clip)
    found = [
        *moving,
        *command_laws(ticks, facts),
        *surface_laws(facts, constants),
        *frame_laws(ticks, frames, facts, constants),
        *pose_laws(frames, constants),
        *route_laws(frames, route, constants),
        *grade_laws(ticks, frames, constants),
        *outcome_laws(clip),
        *pose_check_laws(frames, facts),
    ]
    unjudged = find_unjudged(facts, constants)
    return tuple(x for x in found if x is not None and x.name.split(", ")[0] not in unjudged)


def rank_suspects(laws: tuple[Law, ...]) -> list[str]:
    """Return the columns that can explain the broken laws, best first.

    A faulty column breaks laws that it enters and no other. A law that it enters may still hold where its weight is
    small, so a broken law that stays unexplained costs ten times as much as a law that holds. A frame column that
    still equals its tick column is no separate suspect.

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


def _rank_by_pattern(
    suspects: list[str],
    laws: tuple[Law, ...],
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
) -> list[str]:
    """Sort the suspects by how similar the excesses after a trial fault in each are to the excesses found."""
    seen = {x.name: np.log10(np.clip(x.excess, FAINT, 1 / FAINT)) for x in laws}
    rows = [x.at for x in laws if x.broken and not any("frames." in c for c in x.columns)]
    part = slice(min(rows), max(rows) + 1) if rows else slice(None)
    kinds = ((TRIAL, 0.0), (-TRIAL, 0.0), (0.0, TRIAL), (0.0, -TRIAL))
    distance = {}
    for column in suspects:
        table, _, name = column.partition(".")
        trials = []
        for (share, shift), where in product(kinds, (slice(None), part)):
            changed = _inject_fault(table, name, share, shift, where, ticks, frames, facts)
            excess = {
                x.name: np.log10(np.clip(x.excess, FAINT, 1 / FAINT))
                for x in evaluate_laws(*changed, constants)
            }
            common = [n for n in seen if n in excess and (seen[n] > 0 or excess[n] > 0)]
            trials.append(np.mean([abs(seen[n] - excess[n]) for n in common]) if common else np.inf)
        distance[column] = float(min(trials))
    return sorted(suspects, key=lambda c: distance[c])


def _inject_fault(
    table: str,
    name: str,
    share: float,
    shift: float,
    where: slice,
    ticks: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
) -> tuple[Mapping[str, NDArray[Any]], Mapping[str, NDArray[Any]], Mapping[str, Any]]:
    """Return the tables with rows of one column scaled by 1 + share and shifted by a share of its range."""
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
