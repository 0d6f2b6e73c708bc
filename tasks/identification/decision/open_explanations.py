"""Members of an explanation that are large enough to be named, and the explanations that the runs leave open."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, log

import numpy as np
from scipy.special import ndtri

from tasks.identification.decision.agreement import is_one_size
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.comparison import compare_explanations, find_shared_gain, temper_odds
from tasks.identification.decision.odds import Explanation, RunGrams, can_stand_for, weigh_explanation
from tasks.identification.rules import DecisionRules

SIGNATURES = 2.0
"""Errors of a signature by which the size of an effect may differ from run to run [1]."""
Names = frozenset[str]
"""Names of the members of an explanation that are named."""


@dataclass(frozen=True, kw_only=True)
class OpenExplanation:
    """An explanation that the runs leave open.

    Parameters
    ----------
    explanation : the best of those that name the same
    named : its members that are named, those that gain most first
    log_odds : logarithm of its odds against the first that is open; 0 for that one [1]
    """

    explanation: Explanation
    named: tuple[Candidate, ...]
    log_odds: float

    @property
    def names(self) -> Names:
        """Return the names of what it names."""
        return frozenset(member.name for member in self.named)

    @property
    def numbers(self) -> Names:
        """Return the numbers of what it names: a drag with and without a wind is one number."""
        return frozenset(m.name if m.effect is None else m.effect.parameters[0].name for m in self.named)


def select_members(grams: RunGrams, explanation: Explanation, rules: DecisionRules) -> tuple[Candidate, ...]:
    """Return the members whose odds reach those of a name: to be there, and to be larger than what matters.

    None of an explanation whose odds against nothing are less.

    Parameters
    ----------
    grams : of the runs
    explanation : its members with values and errors
    rules : the odds
    """
    needed = take_away_members(grams, explanation, rules)
    return tuple(m for m in needed.members if is_surely_large(needed, m, rules))


def take_away_members(grams: RunGrams, explanation: Explanation, rules: DecisionRules) -> Explanation:
    """Return an explanation without the members that it does not need, one after the other, the least needed first.

    Of two that stand in for each other neither is needed, but one of them is.

    Parameters
    ----------
    grams : of the runs
    explanation : its members with values and errors
    rules : the odds at which a member is needed
    """
    while explanation.members:
        rest = [
            weigh_explanation(grams, [m for m in explanation.members if m is not member])
            for member in explanation.members
        ]
        best = max((e for e in rest if e is not None), key=lambda e: e.log_odds, default=None)
        if best is None:
            break
        odds = temper_odds(
            explanation.log_odds - best.log_odds, explanation.gain, best.gain, rules.signature_error
        )
        if odds > log(rules.named_odds):
            break
        explanation = best
    return explanation


def is_surely_large(
    explanation: Explanation, member: Candidate, rules: DecisionRules, *, in_any_run: bool = False
) -> bool:
    """Return whether a member is larger than what matters at the odds of a name, in the mean or in any run.

    Parameters
    ----------
    explanation : its members with values and errors
    member : one of them
    rules : the odds
    in_any_run : count what differs from run to run
    """
    own = explanation.find_numbers(member)
    values, errors = explanation.values[own], explanation.errors[own]
    if in_any_run:
        errors = np.hypot(errors, explanation.spreads[explanation.members.index(member)] * values)
    reach = float(ndtri(rules.named_odds / (1.0 + rules.named_odds)))
    return float((np.abs(values) - reach * errors).max()) > member.matters


def find_shared_members(
    grams: RunGrams, explanation: Explanation, rules: DecisionRules
) -> tuple[Candidate, ...]:
    """Return the members that may be named: larger than what matters in any run, and of one size in all runs.

    What differs from run to run by more than errors of signatures explain is no effect that the runs share, but what
    the model lacks moves it.

    Parameters
    ----------
    grams : of the runs
    explanation : its members with values and errors
    rules : the odds, and the error of a signature
    """
    return tuple(
        member
        for member in explanation.members
        if is_surely_large(explanation, member, rules, in_any_run=True)
        and is_one_size(grams, explanation, member, SIGNATURES * rules.signature_error)
    )


def list_open_explanations(
    grams: RunGrams, explanations: Iterable[Explanation], rules: DecisionRules
) -> list[OpenExplanation]:
    """Return the explanations that the runs leave open, the first being the one that they name.

    Explanations that name the same count once, by the best of them. The simplest of those within the odds of a name is
    the first: a member whose odds do not speak for it is not named. One that names all that the first does and more is
    no other explanation.

    Parameters
    ----------
    grams : of the runs
    explanations : the best first
    rules : the odds
    """
    listed = list(explanations)
    ranked = listed[: rules.most_compared]
    # what an effect of the library explains is held against every form
    plain = [e for e in listed if all(m.effect is not None for m in e.members)]
    ranked += [e for e in plain[: rules.most_compared // 2] if not any(e is known for known in ranked)]
    needed = [take_away_members(grams, explanation, rules) for explanation in reversed(ranked)]
    # of the same members the best comes last, and stays
    by_names: dict[Names, OpenExplanation] = {}
    most = -inf
    for explanation in {e.names: e for e in needed}.values():
        named = find_shared_members(grams, explanation, rules)
        # what the runs disagree about may leave another explanation as good as the best, and no better
        against = min(-compare_explanations(grams, ranked[0], explanation, rules.signature_error), 0.0)
        most = max(most, against)
        if not named and any(is_surely_large(explanation, m, rules) for m in explanation.members):
            continue  # it holds something, and nothing that may be named
        known = by_names.get(frozenset(m.name for m in named))
        if known is None or against > known.log_odds:
            found = OpenExplanation(explanation=explanation, named=named, log_odds=against)
            by_names[found.names] = found
    within = [found for found in by_names.values() if found.log_odds >= most - log(rules.named_odds)]
    if not within:
        return [OpenExplanation(explanation=ranked[0], named=(), log_odds=0.0)]
    best = max(within, key=lambda found: (found.log_odds, found.explanation.log_odds))
    # what an effect of the library explains as well is no form
    laws = [
        f
        for f in by_names.values()
        if f.named
        and _has_form(best) > _has_form(f)
        and _explains_as_much(grams, f.explanation, best.explanation, rules)
    ]  # fmt: skip
    whole = min(laws, key=_rank_simplest) if laws else best
    # a member whose odds do not speak for it is not named
    parts = [f for f in within if f.names <= whole.names]
    simplest = min([f for f in within if not f.named] or parts or [whole], key=_rank_simplest)
    apart = [f for f in within if not f.numbers >= simplest.numbers and not _holds_again(f, simplest)]
    # of explanations that add to one another the simplest stands for all
    others = [f for f in apart if not any(g.names < f.names for g in apart)]
    others.sort(key=lambda found: -found.log_odds)
    return [
        OpenExplanation(explanation=f.explanation, named=f.named, log_odds=f.log_odds - simplest.log_odds)
        for f in (simplest, *others)
    ]


def _rank_simplest(opened: OpenExplanation) -> tuple[int, float, float]:
    """Return by what the simplest of explanations comes first, and of those the best."""
    return len(opened.names), -opened.log_odds, -opened.explanation.log_odds


def _has_form(opened: OpenExplanation) -> bool:
    return any(member.effect is None for member in opened.named)


def _holds_again(other: OpenExplanation, first: OpenExplanation) -> bool:
    """Whether a form of another explanation is what the first names, without its law."""
    forms = [member for member in other.named if member.effect is None]
    known = [member for member in first.named if member.effect is not None]
    return any(can_stand_for(form, member) for form in forms for member in known)


def _explains_as_much(grams: RunGrams, plain: Explanation, best: Explanation, rules: DecisionRules) -> bool:
    """Whether all runs together leave an explanation open beside the best one, however its size scatters over them."""
    prior = sum(m.log_prior for m in best.members) - sum(m.log_prior for m in plain.members)
    shared = find_shared_gain(grams, plain, best)
    odds = temper_odds(best.gain - plain.gain + prior, best.gain, shared, rules.signature_error)
    return odds <= log(rules.named_odds)
