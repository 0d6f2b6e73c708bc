"""Mean and maximum of agreement figures over groups of cases: the rows of the paper's tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tasks.eval.state_agreement import FIGURES, CaseAgreement


@dataclass(frozen=True, kw_only=True)
class GroupAgreement:
    """Mean and maximum over the cases of a group.

    Parameters
    ----------
    group : name
    count : number of cases [1]
    mean, maximum : figure by name (`FIGURES`), in the units of `CaseAgreement`; the event error is NaN
        where the group mixes its units
    event_unit : "m", "km/h", or empty where the group mixes both
    """

    group: str
    count: int
    mean: dict[str, float]
    maximum: dict[str, float]
    event_unit: str


def summarise_groups(cases: Sequence[CaseAgreement]) -> dict[str, GroupAgreement]:
    """Return mean and maximum over flat, hump, depression and all cases, as in the paper's tables.

    Parameters
    ----------
    cases : one per case, all of one split

    Returns
    -------
    group by name; a group without a case is left out
    """
    groups = {kind: [c for c in cases if c.kind == kind] for kind in ("flat", "hump", "depression")}
    groups["all"] = list(cases)
    return {name: summarise_group(name, members) for name, members in groups.items() if members}


def summarise_group(name: str, members: Sequence[CaseAgreement]) -> GroupAgreement:
    """Return mean and maximum of every figure over cases.

    Parameters
    ----------
    name : of the group
    members : at least one case
    """
    units = {c.event_unit for c in members}
    figures = {f: np.array([getattr(c, f) for c in members]) for f in FIGURES}
    if len(units) > 1:
        figures["event_error"] = np.full(len(members), np.nan)
    return GroupAgreement(
        group=name,
        count=len(members),
        mean={f: float(v.mean()) for f, v in figures.items()},
        maximum={f: float(v.max()) for f, v in figures.items()},
        event_unit=units.pop() if len(units) == 1 else "",
    )


def summarise_by_control(
    cases: Sequence[CaseAgreement], controls: Mapping[str, str]
) -> dict[str, GroupAgreement]:
    """Return mean and maximum by the control that the cases vary, as in the paper's table of held-out cases.

    Parameters
    ----------
    cases : of one split
    controls : weather, brake or road by the name of a case
    """
    groups: dict[str, list[CaseAgreement]] = {}
    for case in cases:
        groups.setdefault(controls[case.case], []).append(case)
    return {
        name: summarise_group(name, groups[name]) for name in ("weather", "brake", "road") if name in groups
    }
