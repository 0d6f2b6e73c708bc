"""What an explanation tells: members large enough to matter, and which explanations the runs leave open."""

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
Told = frozenset[str]
"""Names of the members that an explanation tells."""


@dataclass(frozen=True, kw_only=True)
class OpenExplanation:
    """An explanation that the runs leave open.

    Parameters
    ----------
    explanation : the best of those that tell the same
    told : its members that are told, those that gain most first
    log_odds : logarithm of its odds against the first that is open; 0 for that one [1]
    """

    explanation: Explanation
    told: tuple[Candidate, ...]
    log_odds: float

    @property
    def names(self) -> Told:
        """Return the names of what it tells."""
        return frozenset(member.name for member in self.told)

    @property
    def numbers(self) -> Told:
        """Return the numbers of what it tells: a drag with and without a wind is one number."""
        return frozenset(m.name if m.effect is None else m.effect.parameters[0].name for m in self.told)


def tell_members(grams: RunGrams, explanation: Explanation, rules: DecisionRules) -> tuple[Candidate, ...]:
    """Return the members that the runs tell at the odds of a name: to be there, and to be larger than what matters.

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
    places = explanation.find_places(member)
    values, errors = explanation.values[places], explanation.errors[places]
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
    """Return the explanations that the runs leave open, the first being the one that they tell.

    Explanations that tell the same count once, by the best of them. The simplest of those within the odds of a name is
    the first: a member whose odds do not speak for it is not told. One that tells all that the first does and more is
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
    by_told: dict[Told, OpenExplanation] = {}
    most = -inf
    for explanation in {e.names: e for e in needed}.values():
        told = find_shared_members(grams, explanation, rules)
        # what the runs disagree about may leave another explanation as good as the best, and no better
        against = min(-compare_explanations(grams, ranked[0], explanation, rules.signature_error), 0.0)
        most = max(most, against)
        if not told and any(is_surely_large(explanation, m, rules) for m in explanation.members):
            continue  # it holds something, and nothing that may be named
        known = by_told.get(frozenset(m.name for m in told))
        if known is None or against > known.log_odds:
            found = OpenExplanation(explanation=explanation, told=told, log_odds=against)
            by_told[found.names] = found
    within = [found for found in by_told.values() if found.log_odds >= most - log(rules.named_odds)]
    if not within:
        return [OpenExplanation(explanation=ranked[0], told=(), log_odds=0.0)]
    best = max(within, key=lambda found: (found.log_odds, found.explanation.log_odds))
    # what an effect of the library explains as well is no form
    laws = [
        f
        for f in by_told.values()
        if f.told
        and _has_form(best) > _has_form(f)
        and _explains_as_much(grams, f.explanation, best.explanation, rules)
    ]  # fmt: skip
    whole = min(laws, key=_rank_simplest) if laws else best
    # a member whose odds do not speak for it is not told
    parts = [f for f in within if f.names <= whole.names]
    simplest = min([f for f in within if not f.told] or parts or [whole], key=_rank_simplest)
    apart = [f for f in within if not f.numbers >= simplest.numbers and not _holds_again(f, simplest)]
    # of explanations that add to one another the simplest stands for all
    others = [f for f in apart if not any(g.names < f.names for g in apart)]
    others.sort(key=lambda found: -found.log_odds)
    return [
        OpenExplanation(explanation=f.explanation, told=f.told, log_odds=f.log_odds - simplest.log_odds)
        for f in (simplest, *others)
    ]


def _rank_simplest(opened: OpenExplanation) -> tuple[int, float, float]:
    """Return by what the simplest of explanations comes first, and of those the best."""
    return len(opened.names), -opened.log_odds, -opened.explanation.log_odds


def _has_form(opened: OpenExplanation) -> bool:
    return any(member.effect is None for member in opened.told)


def _holds_again(other: OpenExplanation, first: OpenExplanation) -> bool:
    """Whether a form of another explanation is what the first names, without its law."""
    forms = [member for member in other.told if member.effect is None]
    known = [member for member in first.told if member.effect is not None]
    return any(can_stand_for(form, member) for form in forms for member in known)


def _explains_as_much(grams: RunGrams, plain: Explanation, best: Explanation, rules: DecisionRules) -> bool:
    """Whether all runs together leave an explanation open beside the best one, however its size scatters over them."""
    prior = sum(m.log_prior for m in best.members) - sum(m.log_prior for m in plain.members)
    shared = find_shared_gain(grams, plain, best)
    odds = temper_odds(best.gain - plain.gain + prior, best.gain, shared, rules.signature_error)
    return odds <= log(rules.named_odds)
