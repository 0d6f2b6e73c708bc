"""The search in its order: effects of the library, wrong numbers of the vehicle, then forms outside the library."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.decision.attribution import Candidate, compute_own_inflation, judge_hypothesis
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
    find_retune,
    relinearise_candidate,
    scale_disturbances,
    search_library,
)
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.discrepancy import estimate_run_noise, set_run_noise
from tasks.identification.inference.fit import Fit, compute_misfit_by_run, fit_hypotheses
from tasks.identification.inference.linearisation import differentiate_at, rescale_disturbances
from tasks.identification.rules import DecisionRules

PORT_OF_NUMBER = {
    "pressure_gain": "brake_torque", "mass": "longitudinal_force", "slope": "longitudinal_force",
    "pitch_gain": "pitch_moment", "damping": "suspension_force", "stiffness": "suspension_force",
}  # fmt: skip
"""Where a wrong number of the session acts: a form there may stand behind it."""


class ForeignCarError(Exception):
    """The runs disagree about every direction even with the best effects: the model's equations do not fit the car."""


def check_agreement(evidence: Evidence, fitted: Fit) -> None:
    """Check that the runs agree about everything that a fit holds.

    Parameters
    ----------
    evidence : the runs
    fitted : fit of all that is named

    Raises
    ------
    ForeignCarError
        If the runs disagree about a part of it so much that the model's equations do not fit the car.
    """
    inflation = max((compute_own_inflation(evidence, fitted, part) for part in fitted.parts), default=1.0)
    if inflation > evidence.rules.disputed_inflation:
        raise ForeignCarError


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
    left = find_best_form(state.evidence, state.base, splines=splines)
    over = left is not None and left.passes and not _pulls_session(left.fitted, state.base, rules)
    disagreeing = any(r.accepted.inflation > rules.disagreement for r in state.rounds)
    # a number is held to be wrong by its pull, so a form need not reach the score of an effect beside it
    retuned = all(r.accepted.hypothesis.effect_class == "retune" for r in state.rounds)
    if state.rounds and (over or disagreeing):
        least = rules.lone_form_share * sum(r.accepted.gain for r in state.rounds)
        alone = find_best_form(null.evidence, null.base, least, accept=0.0 if retuned else None)
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
    if left is not None and over and state is start and len(state.rounds) < rules.most_effects:
        reasons.append(f"a form explains a part of the residual: {left.hypothesis.name}")
        state = replace(
            state,
            base=left.fitted,
            rounds=(*state.rounds, Round(base=state.base, tried=(), accepted=left, evidence=state.evidence)),
        )
    return state, near


def _acts_where(form: Candidate, rounds: tuple[Round, ...]) -> bool:
    """Whether a form acts at the port of every number that was found to be wrong, and nothing else was found."""
    ports = {PORT_OF_NUMBER.get(name) for r in rounds for name in r.accepted.hypothesis.names}
    return ports == {form.hypothesis.port}


def _pulls_session(fitted: Fit, base: Fit, rules: DecisionRules) -> bool:
    """Whether a fit pulls a number of the session beyond belief that was not pulled so before.

    A damping force that is undone by a wrong damping is no discovery.
    """
    return bool(np.any((fitted.pulls > rules.retune_pull) & (base.pulls <= rules.retune_pull)))


def find_best_form(
    evidence: Evidence,
    base: Fit,
    least: float = 0.0,
    splines: tuple[NDArray[np.float64], ...] | None = None,
    accept: float | None = None,
) -> Candidate | None:
    """Return the form that explains most of the residual of a fit, refined and judged; None if no form passes.

    A force that grows with the suspension's speed is its damping: what a number of the session carries is no form.

    Parameters
    ----------
    evidence : the runs
    base : the fit
    least : gain in log likelihood from which a spline leads to forms [1]
    splines : `differentiate_by_splines` at the fit; None if not computed yet
    accept : score that a spline must promise [1]; None takes that of an effect
    """
    promised = evidence.rules.accept_score if accept is None else accept
    level = compute_inflation(evidence, base, None)
    enough = max(promised + float(np.log(evidence.samples)), least / level)
    leftovers = [x for x in fit_residual_splines(evidence, base, splines)[:2] if x.gain > enough]
    if not leftovers:
        return None
    held_out = compute_misfit_by_run(evidence.held_out, base)
    judged = [
        judge_hypothesis(evidence, base, held_out, h)
        for x in leftovers
        for h in make_form_hypotheses(x, evidence.samples)
    ]
    best = max(judged, key=lambda c: c.score)
    return None if is_session_number(best.hypothesis) else relinearise_candidate(evidence, base, best)[1]


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
    if np.max(null.pulls) > evidence.rules.relinearisation_pull:
        evidence = differentiate_at(evidence, null, library=True)
        null = fit_hypotheses(evidence.train, (), evidence.session_sigma, session=null.session, iterations=6)
    evidence = set_run_noise(evidence, estimate_run_noise(evidence, null))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, session=null.session, iterations=6)
    explored = search_library(SearchState(evidence=evidence, base=null), gated=False)
    if compute_inflation(explored.evidence, explored.base, None) > evidence.rules.foreign_inflation:
        raise ForeignCarError
    # what the best effects follow again is no noise
    noise = estimate_run_noise(explored.evidence, explored.base)
    evidence = set_run_noise(evidence, noise)
    explored = replace(
        explored,
        evidence=set_run_noise(explored.evidence, noise),
        rounds=tuple(replace(r, evidence=set_run_noise(r.evidence, noise)) for r in explored.rounds),
    )
    splines = differentiate_by_splines(explored.evidence, explored.base)
    scales = scale_disturbances(explored, splines)
    evidence = rescale_disturbances(evidence, scales)
    explored = replace(
        explored,
        rounds=tuple(replace(r, evidence=rescale_disturbances(r.evidence, scales)) for r in explored.rounds),
    )
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, session=null.session, iterations=6)
    start = SearchState(evidence=evidence, base=null)
    found = search_library(start, gated=True, explored=explored)
    if not found.rounds:
        found = replace(find_retune(start, reasons), tried=found.tried)
    found, near = search_forms(found, start, reasons, None if explored.rounds or found.rounds else splines)
    check_agreement(found.evidence, found.base)
    return start, found, near
