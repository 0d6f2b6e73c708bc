"""Mean and maximum of agreement figures over groups of cases: the rows of the paper's tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tasks.eval.state_agreement import FIGURES, CaseAgreement


def summarise_groups(
    cases: Sequence[CaseAgreement], controls: Mapping[str, str]
) -> dict[str, dict[str, Any]]:
    """Return what `summarise_cases` says of each group of the paper's tables that has a case.

    Parameters
    ----------
    cases : of one split
    controls : weather, brake or road, whichever a case varies, by its name
    """
    kinds = [(kind, [c for c in cases if c.kind == kind]) for kind in ("flat", "hump", "depression")]
    varied = [(name, [c for c in cases if controls[c.case] == name]) for name in ("weather", "brake", "road")]
    groups = [*kinds, ("all", cases), *varied]
    return {name: summarise_cases(members) for name, members in groups if members}


def summarise_cases(cases: Sequence[CaseAgreement]) -> dict[str, Any]:
    """Return ``cases``, their number; ``mean`` and ``maximum`` by figure; ``event_unit``, m or km/h.

    Where cases mix both units, the unit is empty and the event error is None.

    Parameters
    ----------
    cases : at least one
    """
    units = {case.event_unit for case in cases}
    values = {figure: [getattr(case, figure) for case in cases] for figure in FIGURES}
    mean = {figure: float(np.mean(of_cases)) for figure, of_cases in values.items()}
    mixed = {"event_error": None} if len(units) > 1 else {}
    return {
        "cases": len(cases),
        "mean": mean | mixed,
        "maximum": {figure: max(of_cases) for figure, of_cases in values.items()} | mixed,
        "event_unit": "" if mixed else units.pop(),
    }
