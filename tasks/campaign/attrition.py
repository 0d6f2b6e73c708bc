"""The attrition table of a selection: the events that each rule removes, alone and in turn."""

from dataclasses import dataclass

from tasks.campaign.events import Protocol
from tasks.campaign.selection import QUANTITIES, Selection


@dataclass(frozen=True, kw_only=True)
class AttritionRow:
    """Events that one rule removes from a selection.

    Parameters
    ----------
    rule, criterion : its name, and its words
    threshold : for people, with unit
    fails : candidates that break it; None where its channel was not measured
    fails_only_here : candidates that break it and no other
    left : candidates that keep this rule and all before it
    paper_fails : failures the paper counts among its own candidates
    """

    rule: str
    criterion: str
    threshold: str
    fails: int | None
    fails_only_here: int | None
    left: int
    paper_fails: int | None


def tabulate_attrition(selection: Selection, protocol: Protocol) -> tuple[AttritionRow, ...]:
    """Return one row per rule, in the protocol's order; failure counts overlap, as in the paper's table.

    Parameters
    ----------
    selection : judged candidates
    protocol : the rules
    """
    rows = []
    left = list(selection.judged)
    for rule in protocol.rules:
        left = [judged for judged in left if rule.name not in judged.failed]
        assessed = rule.name not in selection.unassessed
        sign = ">=" if rule.is_minimum else "<="
        rows.append(
            AttritionRow(
                rule=rule.name,
                criterion=rule.criterion,
                threshold=f"{sign} {rule.limit:.4g} {QUANTITIES[rule.name].unit}",
                fails=sum(rule.name in one.failed for one in selection.judged) if assessed else None,
                fails_only_here=sum(one.failed == (rule.name,) for one in selection.judged)
                if assessed
                else None,
                left=len(left),
                paper_fails=rule.paper_fails,
            )
        )
    return tuple(rows)
