"""The search: effects are added to the model round by round, and the runs are linearised anew where needed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.attribution import (
    Candidate,
    assess_fit,
    judge_hypothesis,
    refine_candidates,
)
from tasks.identification.decision.cross_validation import cross_validate_candidate
from tasks.identification.decision.forms import RIDGE
from tasks.identification.decision.session_numbers import (
    compute_joint_pull,
    find_alike_numbers,
    free_session_number,
)
from tasks.identification.decision.words import join_phrases
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.fit import Fit, compute_misfit_by_run, fit_hypotheses, sum_misfit_falls
from tasks.identification.inference.hypothesis import is_nested
from tasks.identification.inference.linearisation import (
    compute_whitened_residuals,
    differentiate_at,
    fit_disturbance,
)


@dataclass(frozen=True, kw_only=True)
class Round:
    """One round of the search.

    Parameters
    ----------
    base : fit before the round
    tried : candidates that were tried in addition to ``base``
    accepted : candidate that was accepted
    evidence : the runs, with derivatives at the accepted candidate
    """

    base: Fit
    tried: tuple[Candidate, ...]
    accepted: Candidate
    evidence: Evidence


@dataclass(frozen=True, kw_only=True)
class SearchState:
    """State of the search.

    Parameters
    ----------
    evidence : the runs, with derivatives that hold at ``base``
    base : fit of the accepted hypotheses
    rounds : rounds of the search so far
    tried : candidates of the last round, none of which was accepted
    """

    evidence: Evidence
    base: Fit
    rounds: tuple[Round, ...] = ()
    tried: tuple[Candidate, ...] = ()


def relinearise_candidate(
    evidence: Evidence, base: Fit, candidate: Candidate, *, gated: bool = True, known: Evidence | None = None
) -> tuple[Evidence, Candidate]:
    """Linearise the runs anew at a candidate with a large gain, refit it and judge it there.

    Parameters
    ----------
    evidence : the runs as differentiated for ``base``
    base : fit of the hypotheses accepted so far
    candidate : candidate judged with these derivatives
    gated : judge it on held-out runs too
    known : derivatives at the candidate, if an earlier search took them

    Returns
    -------
    The runs with derivatives that hold at the candidate, and the candidate.
    """
    if candidate.gain < evidence.rules.relinearisation_gain:
        return evidence, candidate
    here, fitted = evidence, candidate.fitted
    for _ in range(2):
        here = known or differentiate_at(here, fitted, library=True)
        known = None
        again = fit_hypotheses(
            here.train, fitted.parts, here.session_sigma, values=fitted.values, session=fitted.session, iterations=8
        )  # fmt: skip
        shift = np.abs(again.values - fitted.values) / np.maximum(np.abs(again.values), 1e-9)
        fitted = again
        if np.all(shift < evidence.rules.relinearisation_change):
            break
    base_held_out = None
    if gated:
        before, after = (compute_misfit_by_run(runs.held_out, base) for runs in (evidence, here))
        # by what the misfit of the same fit moves with the derivatives, no fit can be told from another
        base_held_out = (after[0], after[1] + np.abs(after[0] - before[0]))
    return here, assess_fit(here, base, base_held_out, candidate.hypothesis, fitted)


def search_library(start: SearchState, *, gated: bool, explored: SearchState | None = None) -> SearchState:
    """Add library effects one by one, the best first.

    Parameters
    ----------
    start : state of the search with the hypotheses accepted already
    gated : accept only candidates that pass every gate; else the one with the largest gain, to see the residual with it
    explored : earlier search; where its effects appear again, its derivatives are used
    """
    state, rules = start, start.evidence.rules
    met = frozenset(r.accepted.hypothesis.name for r in explored.rounds) if explored else frozenset()
    for _ in range(rules.most_effects):
        count = rules.refined_candidates if gated else rules.explored_candidates
        tried = refine_candidates(state.evidence, state.base, count, gated=gated, also=met)
        places: dict[str, Evidence] = {}
        for i, candidate in enumerate(tried[: rules.relinearised_candidates] if gated else tried[:1]):
            # a large gain may score low only because the fit has not arrived
            if candidate.score > rules.hopeful_share * max(rules.accept_score, tried[0].score):
                near, known = candidate, None
                if explored and candidate.gain >= rules.relinearisation_gain:
                    near, known = _recall_candidate(explored, candidate)
                places[candidate.hypothesis.name], tried[i] = relinearise_candidate(
                    state.evidence, state.base, near, gated=gated, known=known
                )
        tried.sort(key=lambda c: -c.score)
        if gated:
            tried = _confirm_open(state, tried, places)
        passing = [
            c
            for c in tried
            if (c.passes and not _is_left_by_names(c, state) if gated else c.score > rules.accept_score)
        ]
        if not passing:
            return replace(state, tried=tuple(tried))
        # an explanation that pulls a number of the session beyond belief gives way to one that does not
        credible = [
            c for c in passing if not c.pulls_session and c.gain > rules.lone_form_share * passing[0].gain
        ]
        best = credible[0] if credible else passing[0]
        simpler = [
            c
            for c in passing
            if is_nested(c.hypothesis, best.hypothesis) and c.score > best.score - rules.rival_span
        ]
        best = simpler[0] if simpler else best
        here = places.get(best.hypothesis.name, state.evidence)
        if gated and here is not state.evidence:
            held_out = compute_misfit_by_run(state.evidence.held_out, state.base)
            tried = [
                c if c.score < rules.hopeful_share * best.score or c.hypothesis.name in places
                else judge_hypothesis(here, state.base, held_out, c.hypothesis)
                for c in tried
            ]  # fmt: skip
        state = SearchState(
            evidence=here,
            base=best.fitted,
            rounds=(*state.rounds, Round(base=state.base, tried=tuple(tried), accepted=best, evidence=here)),
        )
    return state


def _is_left_by_names(candidate: Candidate, state: SearchState) -> bool:
    """Return whether a candidate may be what names of its port leave over because they are not the car's exactly.

    Where the runs disagree about a name, its own error explains as much as the rules leave open between two
    explanations: dampers of another law leave on humps what a bump stop would.
    """
    rules, port = state.evidence.rules, candidate.hypothesis.port
    named = [r.accepted for r in state.rounds if r.accepted.hypothesis.port == port]
    gain = sum(c.gain for c in named if c.inflation > rules.disagreement)
    return gain > 0.0 and gain >= rules.rival_gain_share * (gain + candidate.gain)


def _confirm_open(
    state: SearchState, tried: list[Candidate], places: Mapping[str, Evidence]
) -> list[Candidate]:
    """Return candidates, best first, with those cross-validated that are open and may be accepted.

    Behind the first that passes and is credible, only one that is nested in it may.
    """
    confirmed: list[Candidate] = []
    best: Candidate | None = None
    for candidate in tried:
        here = places.get(candidate.hypothesis.name, state.evidence)
        if best is None or is_nested(candidate.hypothesis, best.hypothesis):
            candidate = cross_validate_candidate(here, state.base, candidate)
        if best is None and candidate.passes and not candidate.pulls_session:
            best = candidate
        confirmed.append(candidate)
    return confirmed


def _recall_candidate(explored: SearchState, candidate: Candidate) -> tuple[Candidate, Evidence | None]:
    """Return the candidate at the values to which an earlier search fitted it, and the derivatives taken there."""
    k = len(candidate.hypothesis.names)
    for earlier in explored.rounds:
        known = earlier.accepted
        if known.hypothesis.name == candidate.hypothesis.name:
            values = np.concatenate((candidate.fitted.values[:-k], known.fitted.values[-k:]))
            near = replace(
                candidate, fitted=replace(candidate.fitted, values=values, session=known.fitted.session)
            )
            alone = len(known.fitted.values) == len(values) and known.gain >= known.rules.relinearisation_gain
            return near, earlier.evidence if alone else None
    return candidate, None


def scale_disturbances(explored: SearchState, splines: tuple[NDArray[np.float64], ...]) -> Disturbance:
    """Return the scales of the disturbances, fitted beside the effect that explains the runs best.

    Otherwise a large effect that is not named yet would be taken for a disturbance, which then hides it.

    Parameters
    ----------
    explored : ungated search under a first guess of the scales
    splines : `differentiate_by_splines` at its fit
    """
    residuals = compute_whitened_residuals(explored.evidence, explored.base)
    here = explored.evidence
    return fit_disturbance(
        here.train, residuals, here.tolerances, here.effects, here.disturbance, splines, RIDGE
    )


def find_retune(start: SearchState, reasons: list[str]) -> SearchState:
    """Return the search state with a wrong number of the vehicle named, where the runs pull one too far.

    Parameters
    ----------
    start : state without effects
    reasons : list to which sentences are appended
    """
    evidence, null = start.evidence, start.base
    judged = []
    for name in _find_pulled_numbers(evidence, null, reasons):
        hypothesis = free_session_number(evidence, null, name)
        if hypothesis is None:
            continue
        frozen = null.session.copy()
        frozen[SESSION.index(name)] = 0.0
        held_out = compute_misfit_by_run(evidence.held_out, replace(null, session=frozen))
        found = judge_hypothesis(evidence, null, held_out, hypothesis)
        gained = sum_misfit_falls(held_out, compute_misfit_by_run(evidence.held_out, found.fitted))
        judged.append(replace(found, held_out_gain=gained / found.inflation))
    least = evidence.rules.held_out_gain
    accepted = [c for c in judged if c.held_out_gain > least and c.gain > 0.0 and not c.fitted.at_bound]
    if not accepted:
        return start
    best = max(accepted, key=lambda c: c.gain)
    return replace(
        start,
        base=best.fitted,
        rounds=(Round(base=null, tried=tuple(judged), accepted=best, evidence=evidence),),
    )


def _find_pulled_numbers(evidence: Evidence, null: Fit, reasons: list[str]) -> list[str]:
    """Return the numbers of the session that the runs pull beyond belief, alone or with those that look alike."""
    limit, pulled = evidence.rules.retune_pull, []
    for name, alone in zip(SESSION, null.pulls, strict=True):
        if alone > limit:
            reasons.append(f"the runs pull {name} by {alone:.1f} of its tolerances")
            pulled.append(name)
    if pulled:
        return pulled
    first = SESSION[int(np.argmax(null.pulls))]
    names = [first, *find_alike_numbers(evidence, first)]
    if (joint := compute_joint_pull(null, names)) <= limit:
        return []
    reasons.append(
        f"the runs pull {join_phrases(names)}, which they hardly tell apart, together by {joint:.1f} of their"
        " tolerances"
    )
    return [first]
