"""The search in its order: effects of the library, wrong numbers of the vehicle, then forms outside the library."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.attribution import Candidate, judge_hypothesis
from tasks.identification.decision.disputes import PORT_OF_NUMBER, ForeignCarError, settle_disputes
from tasks.identification.decision.forms import (
    differentiate_by_splines,
    fit_residual_splines,
    is_constant,
    is_session_number,
    make_form_hypotheses,
    rewhiten_splines,
)
from tasks.identification.decision.screening import compute_inflation, find_disagreeing_runs
from tasks.identification.decision.search import (
    Round,
    SearchState,
    find_retune,
    relinearise_candidate,
    scale_disturbances,
    search_library,
)
from tasks.identification.decision.words import join_phrases
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.discrepancy import estimate_run_noise, set_run_noise
from tasks.identification.inference.fit import Fit, compute_misfit_by_run, fit_hypotheses
from tasks.identification.inference.linearisation import hold_session, rescale_disturbances


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
    state, near, rules = start, None, start.evidence.rules
    here, left = _find_credible_form(state.evidence, state.base, splines)
    over = left is not None and left.passes
    disagreeing = any(r.accepted.inflation > rules.disagreement for r in state.rounds)
    # a number is held to be wrong by its pull, so a form need not reach the score of an effect beside it
    retuned = all(r.accepted.hypothesis.effect_class == "retune" for r in state.rounds)
    if state.rounds and (over or disagreeing):
        least = rules.lone_form_share * sum(r.accepted.gain for r in state.rounds)
        alone = find_best_form(null.evidence, null.base, least)
        ahead = -np.inf
        if alone is not None and (alone.passes or retuned):
            # a form has no library direction, hence no inflation of its own: both sides take the larger one
            common = max(alone.inflation, *(r.accepted.inflation for r in state.rounds))
            log_n = float(np.log(state.evidence.samples))
            extra = len(alone.hypothesis.names) - sum(len(r.accepted.hypothesis.names) for r in state.rounds)
            ahead = (alone.gain - sum(r.accepted.gain for r in state.rounds)) / common - extra * log_n
        first = state.rounds[0].accepted.hypothesis
        # a form of the same variable at the same port describes the named effect again, not an unknown one
        same_effect = (
            alone is not None
            and alone.hypothesis.port == first.port
            and (
                alone.hypothesis.variable == first.variable
                or (first.variable == "constant" and is_constant(alone.hypothesis))
            )
        )
        if (
            alone is not None
            and alone.passes
            and not same_effect
            and (disagreeing and _acts_where(alone, state.rounds) if retuned else ahead > rules.rival_span)
        ):
            reasons.append(f"a single form explains more than the library: {alone.hypothesis.name}")
            state = SearchState(
                evidence=null.evidence,
                base=alone.fitted,
                rounds=(Round(base=null.base, tried=(), accepted=alone, evidence=null.evidence),),
            )
        elif (
            alone is not None
            and ahead > -rules.rival_span
            and (not retuned or _acts_where(alone, state.rounds))
        ):
            elsewhere = alone.hypothesis.port != first.port
            near = alone if (ahead > rules.rival_span if same_effect else elsewhere or disagreeing) else None
    named = sum(r.accepted.gain for r in state.rounds)
    if left is not None and over and state is start and named >= rules.rival_gain_share * (named + left.gain):
        reasons.append(
            f"{left.hypothesis.name} would fit beside what is named, which makes good"
            f" {named / (named + left.gain):.0%} of the gain without it: not named"
        )
    elif left is not None and over and state is start and len(state.rounds) < rules.most_effects:
        reasons.append(f"a form explains a part of the residual: {left.hypothesis.name}")
        moved = here.session_sigma < state.evidence.session_sigma
        if moved.any():
            held = ", ".join(np.array(SESSION)[moved])
            reasons.append(
                f"it is fitted with the vehicle's own {held}, which a form alone would pull beyond belief"
            )
        state = replace(
            state,
            evidence=here,
            base=left.fitted,
            rounds=(
                *state.rounds,
                Round(base=state.base, tried=_find_like(left, state), accepted=left, evidence=here),
            ),
        )
    return state, near


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


def search_library_and_forms(
    evidence: Evidence, null: Fit, reasons: list[str]
) -> tuple[SearchState, SearchState, Candidate | None]:
    """Scale the disturbances, then search library and forms under every gate.

    Parameters
    ----------
    evidence : the runs under a first guess of the scales
    null : fit without effects
    reasons : list to which sentences are appended

    Returns
    -------
    The state without effects, the state with those found, and a single form that cannot be told from the first effect.

    Raises
    ------
    ForeignCarError
        If the model's own misfit exceeds any effect that could be found, or the runs disagree about one that was found.
    """
    evidence = set_run_noise(evidence, estimate_run_noise(evidence, null))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, session=null.session, iterations=6)
    library = search_library(SearchState(evidence=evidence, base=null), gated=False)
    foreign = _tell_foreign(library)
    splines = differentiate_by_splines(library.evidence, library.base)
    explored = _add_best_form(library, splines)
    if still := _tell_foreign(explored):
        raise ForeignCarError(still)
    # what the best explanation follows again is no noise
    noise = estimate_run_noise(explored.evidence, explored.base)
    evidence, explored = _change_runs(evidence, explored, lambda runs: set_run_noise(runs, noise))
    splines = (
        rewhiten_splines(splines, library.evidence, explored.evidence)
        if explored.base is library.base
        else differentiate_by_splines(explored.evidence, explored.base)
    )
    scales = scale_disturbances(explored, splines)
    evidence, explored = _change_runs(evidence, explored, lambda runs: rescale_disturbances(runs, scales))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, session=null.session, iterations=6)
    start = SearchState(evidence=evidence, base=null)
    found = search_library(start, gated=True, explored=explored)
    reasons += [
        f"{c.hypothesis.name} would fit beside a name of its port, about which the runs disagree, but explains no more"
        " than an error of that may leave over: not named"
        for c in found.tried
        if c.passes
    ]
    if not found.rounds:
        found = replace(find_retune(start, reasons), tried=found.tried)
    # about the same parts again, in other words, the residual has the same splines
    same = [p.name for p in found.base.parts] == [p.name for p in explored.base.parts]
    found, near = search_forms(found, start, reasons, splines if same else None)
    if foreign and all(r.accepted.hypothesis.effect_class != "form" for r in found.rounds):
        raise ForeignCarError(foreign)
    settled = settle_disputes(found, reasons)
    return start, settled, near if settled is found else None


def _tell_foreign(found: SearchState) -> str:
    """Return by how much the runs disagree, where that is another car's equations; else an empty text."""
    most = found.evidence.rules.foreign_inflation
    inflation = compute_inflation(found.evidence, found.base, None)
    if inflation <= most:
        return ""
    runs = find_disagreeing_runs(found.evidence, found.base)[:2]
    return (
        f"the runs disagree with the model by a factor of {inflation:.1f} whatever the library adds (noise alone gives"
        f" 1, single effects can be told up to {most:g}){f', most in {join_phrases(runs)}' if runs else ''}"
    )


def _change_runs(
    evidence: Evidence, explored: SearchState, change: Callable[[Evidence], Evidence]
) -> tuple[Evidence, SearchState]:
    """Return the runs and a search of them, changed alike; what both share is changed once."""
    states = (evidence, explored.evidence, *(r.evidence for r in explored.rounds))
    changed = {key: change(runs) for key, runs in {id(runs): runs for runs in states}.items()}
    rounds = tuple(replace(r, evidence=changed[id(r.evidence)]) for r in explored.rounds)
    return changed[id(evidence)], replace(explored, evidence=changed[id(explored.evidence)], rounds=rounds)


def _add_best_form(explored: SearchState, splines: tuple[NDArray[np.float64], ...]) -> SearchState:
    """Return the search without gates with the form that explains most beside its effects, if the runs show one.

    Otherwise a form outside the library would be taken for a disturbance, as an effect would be, which then hides it.
    """
    evidence, base = explored.evidence, explored.base
    form = find_best_form(evidence, base, splines=splines, gated=False)
    if form is None or form.score <= evidence.rules.accept_score:
        return explored
    here, form = relinearise_candidate(evidence, base, form, gated=False)
    last = Round(base=base, tried=(), accepted=form, evidence=here)
    return replace(explored, evidence=here, base=form.fitted, rounds=(*explored.rounds, last))
