"""Explanations beside those tried one by one: wrong numbers of the vehicle, and two effects that act together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.attribution import Candidate, assess_fit, judge_hypothesis
from tasks.identification.decision.rivals import RivalComparison, is_close_on_unseen_runs
from tasks.identification.decision.search import SearchState
from tasks.identification.decision.session_numbers import free_session_number
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.fit import Fit, compute_misfit_by_run, sum_misfit_falls


@dataclass(frozen=True, kw_only=True)
class Alternative:
    """An explanation that cannot be told from a named effect, or that the named effect leaves open.

    Parameters
    ----------
    candidate : the explanation
    reason : why it stands beside the named effect
    """

    candidate: Candidate
    reason: str


def find_pulled_numbers(found: SearchState) -> list[Alternative]:
    """Return the vehicle's own numbers that stay pulled beyond belief beside what is named.

    An effect that needs the mass off by five tolerances may stand for the wrong mass itself.

    Parameters
    ----------
    found : what is named
    """
    evidence, base = found.evidence, found.base
    free = {name for part in base.parts for name in part.names}
    alternatives = []
    for place in np.flatnonzero(base.pulls > evidence.rules.retune_pull):
        if SESSION[place] in free:
            continue
        hypothesis = free_session_number(evidence, base, SESSION[place])
        if hypothesis is None:
            continue
        alternatives.append(
            Alternative(
                candidate=judge_hypothesis(evidence, base, None, hypothesis),
                reason=f"{SESSION[place]} is pulled by {base.pulls[place]:.1f} of its tolerances beside what"
                " is named: the vehicle's own number may be wrong",
            )
        )
    return alternatives


def find_pairs(found: SearchState, compared: Sequence[RivalComparison]) -> list[Alternative]:
    """Return the members of two effects that together explain as much as the one that is named alone.

    Drag of the air and of the pads together look like a resistance that grows with speed. Runs that no fit has seen
    must not tell the two from the one, nor contradict one of the two. What explains as much beside the one as beside
    the other is no part of an alternative, but a second thing that the model lacks.

    Parameters
    ----------
    found : what is named
    compared : each named effect beside what was tried in its place; only one alone is held against pairs
    """
    if len(compared) != 1 or compared[0].own.hypothesis.effect_class != "effect":
        return []
    own, evidence, rest = compared[0].own, found.evidence, found.rounds[0].base
    rules = evidence.rules
    alone = [
        other
        for other, _ in compared[0].others
        if other.hypothesis.effect_class == "effect"
        and len(other.hypothesis.names) == 1
        and other.gain > rules.lone_form_share * own.gain
    ]
    known = {c.hypothesis.name for c, _ in compared[0].near}
    unseen = compute_misfit_by_run(evidence.held_out, rest)
    alternatives = []
    for a, b in combinations(alone[: rules.refined_look_alikes], 2):
        if {a.hypothesis.name, b.hypothesis.name} <= known:
            continue
        both = judge_hypothesis(evidence, a.fitted, None, b.hypothesis)
        level = max(own.inflation, both.inflation)
        gain = 0.5 * (rest.objective - both.fitted.objective)
        each_counts = gain - max(a.gain, b.gain) > level * rules.held_out_gain
        if (
            gain >= own.gain
            and each_counts
            and not both.fitted.at_bound
            and is_close_on_unseen_runs(evidence, unseen, own, both)
            and not any(_is_contradicted(evidence, one.fitted, both) for one in (a, b))
            and not any(_is_second(evidence, own, y, gain - x.gain) for x, y in ((a, b), (b, a)))
        ):
            # the same fit of both, with the other one last
            swapped = replace(
                both.fitted, parts=both.fitted.parts[::-1], values=both.fitted.values[::-1],
                covariance=both.fitted.covariance[::-1, ::-1],
            )  # fmt: skip
            first = assess_fit(evidence, b.fitted, None, a.hypothesis, swapped)
            reason = f"{a.hypothesis.name} and {b.hypothesis.name} together explain as much as {own.hypothesis.name}"
            alternatives += [
                Alternative(candidate=c, reason=reason)
                for c in (first, both)
                if c.hypothesis.name not in known
            ]
            known |= {a.hypothesis.name, b.hypothesis.name}
    return alternatives


def _is_second(evidence: Evidence, own: Candidate, member: Candidate, gain: float) -> bool:
    """Return whether a member of a pair gains as much beside the named effect as beside the pair's other member."""
    beside = judge_hypothesis(evidence, own.fitted, None, member.hypothesis).gain
    return beside >= evidence.rules.rival_gain_share * gain


def _is_contradicted(evidence: Evidence, alone: Fit, both: Candidate) -> bool:
    """Return whether held-out runs are predicted worse with a further effect than without it."""
    fall = sum_misfit_falls(*(compute_misfit_by_run(evidence.held_out, f) for f in (alone, both.fitted)))
    return fall < -evidence.rules.held_out_gain * both.inflation
