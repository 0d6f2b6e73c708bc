"""The search for forms outside the library: alone against all that was named, and in what the names leave over."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.attribution import Candidate, judge_hypothesis
from tasks.identification.decision.disputes import PORT_OF_NUMBER
from tasks.identification.decision.forms import (
    differentiate_by_splines,
    fit_residual_splines,
    is_constant,
    is_session_number,
    make_form_hypotheses,
)
from tasks.identification.decision.screening import compute_inflation
from tasks.identification.decision.search import (
    Round,
    SearchState,
    relinearise_candidate,
)
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.fit import Fit, compute_misfit_by_run
from tasks.identification.inference.hypothesis import Hypothesis
from tasks.identification.inference.linearisation import hold_session


def search_forms(
    start: SearchState,
    null: SearchState,
    reasons: list[str],
    splines: tuple[NDArray[np.float64], ...] | None = None,
) -> tuple[SearchState, Candidate | None]:
    """Search forms outside the library: alone against all that was named, and in the residual of the named effects.

    Parameters
    ----------
    start : state of the search with the effects of the library
    null : state without any effect, with the same scales
    reasons : list to which sentences are appended
    splines : `differentiate_by_splines` of ``start``; None if not computed yet

    Returns
    -------
    The state, and a single form that cannot be told from the first effect.
    """
    state, near = start, None
    here, left = _find_credible_form(start.evidence, start.base, splines)
    over = left is not None and left.passes
    if start.rounds and (over or _runs_disagree(start)):
        least = start.evidence.rules.lone_form_share * _sum_gains(start)
        alone = find_best_form(null.evidence, null.base, least)
        if alone is not None:
            state, near = _compare_lone_form(alone, start, null, reasons)
    if left is not None and over and state is start:
        state = _add_left_form(left, here, start, reasons)
    return state, near


def _runs_disagree(found: SearchState) -> bool:
    """Whether the runs disagree about something that was named."""
    return any(r.accepted.inflation > found.evidence.rules.disagreement for r in found.rounds)


def _sum_gains(found: SearchState) -> float:
    """Return what all that was named gains together in log likelihood [1]."""
    return sum(r.accepted.gain for r in found.rounds)


def _compare_lone_form(
    alone: Candidate, start: SearchState, null: SearchState, reasons: list[str]
) -> tuple[SearchState, Candidate | None]:
    """Compare a single form with all that was named: it replaces that, is its rival, or is neither.

    Parameters
    ----------
    alone : the best form without any effect
    start : state of the search with what was named
    null : state without any effect, with the same scales
    reasons : list to which a sentence is appended

    Returns
    -------
    The state, and the form where it is a rival.
    """
    span = start.evidence.rules.rival_span
    disagreeing = _runs_disagree(start)
    # a number is held to be wrong by its pull, so a form need not reach the score of an effect beside it
    retuned = all(r.accepted.hypothesis.effect_class == "retune" for r in start.rounds)
    at_numbers = _acts_where(alone, start.rounds)
    ahead = _compute_lead(alone, start) if alone.passes or retuned else -np.inf
    first = start.rounds[0].accepted.hypothesis
    again = _describes_again(alone, first)
    better = disagreeing and at_numbers if retuned else ahead > span
    if alone.passes and better and not again:
        reasons.append(f"a single form explains more than the library: {alone.hypothesis.name}")
        only = Round(base=null.base, tried=(), accepted=alone, evidence=null.evidence)
        return SearchState(evidence=null.evidence, base=alone.fitted, rounds=(only,)), None
    if ahead <= -span or (retuned and not at_numbers):
        return start, None
    elsewhere = alone.hypothesis.port != first.port
    rival = ahead > span if again else elsewhere or disagreeing
    return start, alone if rival else None


def _compute_lead(alone: Candidate, found: SearchState) -> float:
    """Return by how much a single form scores above all that was named [1].

    A form has no direction in the library, hence no inflation of its own: both sides take the larger one.
    """
    common = max(alone.inflation, *(r.accepted.inflation for r in found.rounds))
    extra = len(alone.hypothesis.names) - sum(len(r.accepted.hypothesis.names) for r in found.rounds)
    return (alone.gain - _sum_gains(found)) / common - extra * float(np.log(found.evidence.samples))


def _describes_again(form: Candidate, first: Hypothesis) -> bool:
    """Whether a form of the same variable at the same port describes a named effect again, no unknown one."""
    known = form.hypothesis
    both_constant = first.variable == "constant" and is_constant(known)
    return known.port == first.port and (known.variable == first.variable or both_constant)


def _add_left_form(left: Candidate, here: Evidence, start: SearchState, reasons: list[str]) -> SearchState:
    """Add a form that passes in the residual of the named effects, unless these explain nearly as much alone.

    Parameters
    ----------
    left : the form
    here : the runs that it was fitted to
    start : state of the search with what was named
    reasons : list to which sentences are appended
    """
    rules, named = start.evidence.rules, _sum_gains(start)
    if named >= rules.rival_gain_share * (named + left.gain):
        reasons.append(
            f"{left.hypothesis.name} would fit beside what is named, which makes good"
            f" {named / (named + left.gain):.0%} of the gain without it: not named"
        )
        return start
    if len(start.rounds) >= rules.most_effects:
        return start
    reasons.append(f"a form explains a part of the residual: {left.hypothesis.name}")
    moved = here.session_sigma < start.evidence.session_sigma
    if moved.any():
        held = ", ".join(np.array(SESSION)[moved])
        reasons.append(
            f"it is fitted with the vehicle's own {held}, which a form alone would pull beyond belief"
        )
    last = Round(base=start.base, tried=_find_like(left, start), accepted=left, evidence=here)
    return replace(start, evidence=here, base=left.fitted, rounds=(*start.rounds, last))


def _find_like(form: Candidate, state: SearchState) -> tuple[Candidate, ...]:
    """Return the effects of the library that were tried in vain and act at a form's port by the same variable."""
    known = form.hypothesis
    return tuple(
        c for c in state.tried if (c.hypothesis.port, c.hypothesis.variable) == (known.port, known.variable)
    )


def _acts_where(form: Candidate, rounds: tuple[Round, ...]) -> bool:
    """Whether a form acts at the port of every number that was found to be wrong, and nothing else was found."""
    ports = {PORT_OF_NUMBER.get(name) for r in rounds for name in r.accepted.hypothesis.names}
    return ports == {form.hypothesis.port}


def _find_credible_form(
    evidence: Evidence, base: Fit, splines: tuple[NDArray[np.float64], ...] | None
) -> tuple[Evidence, Candidate | None]:
    """Return the best form that pulls no number of the session beyond belief, and the runs that it was fitted to.

    A damping force that is undone by a wrong damping is no discovery. What explains the runs with the number held at
    the vehicle's value is one: that number only bent the form's shape.
    """
    if splines is None:
        splines = differentiate_by_splines(evidence, base)
    here, form = evidence, find_best_form(evidence, base, splines=splines)
    while form is not None and form.passes and (pulled := _find_pulled(form, base)):
        here = hold_session(here, pulled)
        form = find_best_form(here, base, splines=splines)
    return here, form


def _find_pulled(form: Candidate, base: Fit) -> list[str]:
    """Return the numbers of the session that a form pulls beyond belief and that were not pulled so before."""
    limit = form.rules.retune_pull
    pulled = (np.abs(form.fitted.session) > limit * base.session_sigma) & (base.pulls <= limit)
    return [SESSION[place] for place in np.flatnonzero(pulled)]


def find_best_form(
    evidence: Evidence,
    base: Fit,
    least: float = 0.0,
    splines: tuple[NDArray[np.float64], ...] | None = None,
    gated: bool = True,
) -> Candidate | None:
    """Return the form that explains most of the residual of a fit, refined and judged; None if no form passes.

    A force that grows with the suspension's speed is its damping: what a number of the session carries is no form.

    Parameters
    ----------
    evidence : the runs
    base : the fit
    least : gain in log likelihood from which a spline leads to forms [1]
    splines : `differentiate_by_splines` at the fit; None if not computed yet
    gated : judge it on held-out runs too, and beside forms of the second spline; else see what the best one explains
    """
    # the linear gain of a spline is a hint: friction that no wheel reaches yet has no derivative
    needed = evidence.rules.accept_score + float(np.log(evidence.samples))
    enough = max(evidence.rules.hopeful_share * needed, least / compute_inflation(evidence, base, None))
    most = 2 if gated else 1
    leftovers = [x for x in fit_residual_splines(evidence, base, splines)[:most] if x.gain > enough]
    if not leftovers:
        return None
    held_out = compute_misfit_by_run(evidence.held_out, base) if gated else None
    judged = [
        judge_hypothesis(evidence, base, held_out, h)
        for x in leftovers
        for h in make_form_hypotheses(x, evidence.samples)
    ]
    best = max(judged, key=lambda c: c.score)
    if is_session_number(best.hypothesis):
        return None
    return relinearise_candidate(evidence, base, best)[1] if gated else best
