"""The search in its order: effects of the library, wrong numbers of the vehicle, then forms outside the library."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.decision.attribution import Candidate
from tasks.identification.decision.disputes import ForeignCarError, settle_disputes
from tasks.identification.decision.form_search import find_best_form, search_forms
from tasks.identification.decision.forms import differentiate_by_splines, rewhiten_splines
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
from tasks.identification.inference.fit import Fit, fit_hypotheses
from tasks.identification.inference.linearisation import rescale_disturbances


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
