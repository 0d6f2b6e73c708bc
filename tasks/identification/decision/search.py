"""The search: linearise the runs, weigh every explanation, fit the best one through the simulation, and begin again."""

from dataclasses import dataclass, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import FILE_NUMBERS, SESSION, Campaign
from tasks.identification.decision.candidates import (
    Candidate,
    Columns,
    can_show,
    determines_curve,
    determines_limit,
    list_columns,
)
from tasks.identification.decision.comparison import compare_explanations
from tasks.identification.decision.forms import (
    KNOTS,
    RIDGE,
    differentiate_by_splines,
    find_scanned_ranges,
    make_spline_hypothesis,
    rewhiten_splines,
)
from tasks.identification.decision.odds import (
    Explanation,
    RunGrams,
    keep_members,
    search_explanations,
)
from tasks.identification.decision.open_explanations import select_members
from tasks.identification.decision.random_effects import FEWEST
from tasks.identification.inference.discrepancy import estimate_run_noise, set_run_noise
from tasks.identification.inference.evidence import Evidence
from tasks.identification.inference.fit import Fit, fit_hypotheses
from tasks.identification.inference.forward import prepare_run
from tasks.identification.inference.hypothesis import Hypothesis, make_library_hypothesis
from tasks.identification.inference.linearisation import (
    compute_whitened_residuals,
    differentiate_at,
    fit_disturbance,
    prepare_evidence,
    rescale_disturbances,
)
from tasks.identification.inference.start import GAIN, GRIP, estimate_session, is_grip_free
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

Splines = tuple[NDArray[np.float64], ...]
"""Derivatives of every training run by the knots of all splines, float64 [M, K] each."""
STEPS = 6
"""Gauss-Newton steps of a fit [1]."""
REFUTED = 0.75
"""Share of the fitted explanation's gain that another must lose through the simulation to be refuted [1]."""
REFINED = 3
"""Single candidates that are tried through the simulation before the first turn [1]."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What the search found.

    Parameters
    ----------
    evidence : the runs, linearised about ``fitted``
    null : fit without any candidate
    fitted : fit of the best explanation through the simulation
    grams : what the runs say there
    explanations : the best first; the first is that of ``fitted``
    """

    evidence: Evidence
    null: Fit
    fitted: Fit
    grams: RunGrams
    explanations: tuple[Explanation, ...]

    @property
    def best(self) -> Explanation:
        """Return the explanation with the largest odds."""
        return self.explanations[0]


@dataclass(frozen=True, kw_only=True)
class _SearchState:
    """State of the search: the runs about a fit.

    Parameters
    ----------
    evidence : the runs about a fit
    fitted : the fit
    splines : derivatives by the splines, about ``splined``
    splined : parts of the fit about which they were taken
    """

    evidence: Evidence
    fitted: Fit
    splines: Splines
    splined: tuple[Hypothesis, ...] = ()
    refuted: bool = False


def find_explanations(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    library: tuple[Effect, ...],
    rules: DecisionRules,
) -> Finding:
    """Return the explanations of what a model misses in the training runs, with their odds.

    First comes the single candidate that gains most, so that what it hides comes to light. Every further turn weighs
    sets of candidates about the fit of the turn before, until the best set is the one that was fitted: of the library,
    then with forms.

    Parameters
    ----------
    campaign : measured runs; held-out runs are not read
    vehicle, surface : the model that is judged
    library : effects that may be named
    rules : of the decision
    """
    models = [prepare_run(run, vehicle, surface) for run in campaign.train]
    gain = float(estimate_session(campaign, models, rules)[GAIN])
    shown = [
        effect
        for effect in library
        if can_show(effect, vehicle, campaign.channels)
        and not (effect.parameters[0].name == GRIP and is_grip_free(campaign))
        and determines_limit(effect, models, gain, rules)
        and determines_curve(effect, models)
    ]
    retuned = [effect for effect in shown if effect.parameters[0].name in SESSION]
    numbers = tuple(effect for effect in shown if effect.parameters[0].name not in SESSION)
    evidence, null = prepare_evidence(campaign, vehicle, surface, numbers, rules)
    state = _settle_scales(
        _SearchState(evidence=evidence, fitted=null, splines=differentiate_by_splines(evidence, null))
    )
    columns = list_columns(numbers, retuned, evidence.session_sigma, rules)
    null = state.fitted
    grams = gather_grams(state.evidence, state.fitted, state.splines, columns)
    singles = search_explanations(grams, most=1, width=1, spread=False, forms=False)
    first = _refine_first(singles, state, null, rules)
    if first is not None:
        state = _settle_scales(_move_to(first, state))
    # the shape of a form does not follow from a run or two
    for forms in (False, True) if len(models) >= FEWEST else (False,):
        state, grams, found = _settle_explanation(state, null, columns, rules, forms=forms)
    return Finding(
        evidence=state.evidence, null=null, fitted=state.fitted, grams=grams, explanations=tuple(found)
    )


def _refine_first(
    found: list[Explanation], state: _SearchState, null: Fit, rules: DecisionRules
) -> Fit | None:
    """Return the fit of the single candidate that explains most, of those that seem to; None without one.

    A linear estimate of a delay, or of what decides when an anti-lock brake acts, is a hint.
    """
    hopeful = [e for e in found if e.members and e.log_odds > 0.0][:REFINED]
    fits = [_fit_explanation(e, state, null) for e in hopeful]
    gains = [
        0.5 * (null.objective - f.objective) + sum(m.log_prior for m in e.members)
        for f, e in zip(fits, hopeful, strict=True)
    ]
    # the odds of what is fitted are less than its gain
    return fits[int(np.argmax(gains))] if max(gains, default=0.0) > log(rules.named_odds) else None


def _settle_explanation(
    state: _SearchState, null: Fit, columns: Columns, rules: DecisionRules, *, forms: bool
) -> tuple[_SearchState, RunGrams, list[Explanation]]:
    """Return where what the best explanation tells is fitted, what the runs say there, and all explanations.

    Forms come after the library: what an effect of the library explains is no form.
    """
    for turn in range(rules.most_turns):
        if forms and state.splined is not state.fitted.parts:
            splines = differentiate_by_splines(state.evidence, state.fitted)
            state = replace(state, splines=splines, splined=state.fitted.parts)
        grams = gather_grams(state.evidence, state.fitted, state.splines, columns)
        found = search_explanations(grams, most=rules.most_effects, width=rules.beam_width, forms=forms)
        here = next((e for e in found if _is_fitted(e, state.fitted)), None)
        if state.refuted and here is not None:
            # far from a fit without its effect, derivatives about that fit promise what no simulation keeps
            found = [e for e in found if e.log_odds <= here.log_odds or not _leaves_out(e, here)]
        named = keep_members(found[0], select_members(grams, found[0], rules))
        if turn == rules.most_turns - 1 or _is_fitted(named, state.fitted):
            break
        if forms and here is not None and not _is_worth_it(found[0], here, grams, rules):
            break
        moved = _move_to(_fit_explanation(named, state, null), state)
        lost = _compute_cost(moved.fitted, named) - _compute_cost(
            state.fitted, named if here is None else here
        )
        refuted = here is not None and lost > REFUTED * here.gain + log(rules.named_odds)
        state = replace(state, refuted=True) if refuted else moved
    return state, grams, found


def _compute_cost(fitted: Fit, explanation: Explanation) -> float:
    """Return half the misfit of a fit, less the logarithm of the prior odds of what it holds [1]."""
    return 0.5 * fitted.objective - sum(member.log_prior for member in explanation.members)


def _leaves_out(explanation: Explanation, here: Explanation) -> bool:
    """Whether an explanation with effects of the library leaves out a member of the fitted one."""
    known = any(member.effect is not None for member in explanation.members)
    return known and not set(here.names) <= set(explanation.names)


def _is_worth_it(best: Explanation, here: Explanation, grams: RunGrams, rules: DecisionRules) -> bool:
    """Whether an explanation with a form is so much more likely than the fitted one that it takes its place."""
    return best is not here and compare_explanations(grams, best, here, rules.signature_error) > log(
        rules.named_odds
    )


def gather_grams(evidence: Evidence, fitted: Fit, splines: Splines, columns: Columns) -> RunGrams:
    """Return what every training run says about all columns, its offsets and disturbances integrated out.

    Parameters
    ----------
    evidence : the runs, linearised about the fit
    fitted : the fit
    splines : derivatives there
    columns : meaning of the columns
    """
    information, score = [], []
    for run, residual, knots in zip(evidence.train, fitted.residuals, splines, strict=True):
        every = np.column_stack((run.library, run.others, knots, run.session))
        seen, left = run.project_on_nuisances(every), run.project_on_nuisances(residual)
        information.append(every.T @ every - seen.T @ seen)
        score.append(every.T @ residual - seen.T @ left)
    centre = _find_centre(fitted, columns)
    # an explanation without a form has its values at 0, and not where it was fitted
    forms = np.zeros(columns.count)
    own = [column for candidate in columns.candidates if candidate.base < 0 for column in candidate.columns]
    forms[own] = centre[own]
    known = np.array(information)
    return RunGrams(
        information=known, score=np.array(score) + known @ forms, centre=centre - forms, columns=columns
    )


def _find_centre(fitted: Fit, columns: Columns) -> NDArray[np.float64]:
    """Return the value of every column's number in a fit, float64 [C]."""
    centre, at = np.zeros(columns.count), 0
    for part in fitted.parts:
        for candidate in columns.candidates:
            if candidate.name == part.name and not np.isfinite(candidate.second):
                own = list(candidate.columns)
                centre[own] = fitted.values[at : at + len(own)]
                break
        else:
            # an effect of two numbers whose first belongs to another effect: the first column is its derivative now
            own = [c.columns[0] for c in columns.candidates if part.names[0] == _name_number(c)][:1]
            centre[own] = fitted.values[at]
        at += len(part.names)
    centre[-len(FILE_NUMBERS) :] = fitted.session
    return centre


def _name_number(candidate: Candidate) -> str:
    return candidate.effect.parameters[0].name if candidate.effect is not None else ""


def _is_fitted(explanation: Explanation, fitted: Fit) -> bool:
    """Whether a fit is that of an explanation; numbers of the session are in every fit."""
    names = {m.name for m in explanation.members if m.columns[0] < _session_begins(m, fitted)}
    return names == {part.name for part in fitted.parts}


def _session_begins(member: Candidate, fitted: Fit) -> float:
    retuned = member.effect is not None and member.effect.parameters[0].name in SESSION
    return -1.0 if retuned else np.inf


def make_hypotheses(
    explanation: Explanation, evidence: Evidence, fitted: Fit | None = None
) -> tuple[Hypothesis, ...]:
    """Return the members of an explanation as hypotheses that start at its values; numbers of the session have none.

    Parameters
    ----------
    explanation : the members with their values
    evidence : the runs, whose ranges the splines have
    fitted : an earlier fit; a second number that it holds is kept
    """
    ranges = find_scanned_ranges(evidence.train)
    parts = []
    for member in explanation.members:
        values = explanation.values[explanation.find_numbers(member)]
        if member.effect is None:
            grid = np.linspace(*ranges[member.variable], KNOTS)
            parts.append(make_spline_hypothesis(member.port, member.variable, grid, values))
        elif member.effect.parameters[0].name not in SESSION:
            second = member.second
            if not np.isfinite(second) and fitted is not None:
                second = _find_second(member.name, fitted)
            parts.append(make_library_hypothesis(member.effect, float(values[0]), second))
    return tuple(parts)


def _find_second(name: str, fitted: Fit) -> float:
    """Return the second number of an effect in a fit; NaN where the fit has none."""
    at = 0
    for part in fitted.parts:
        if part.name == name and len(part.names) == 2:
            return float(fitted.values[at + 1])
        at += len(part.names)
    return np.nan


def widen_session(explanation: Explanation, sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the session's prior sigmas, with the slab where an explanation names one of its numbers, float64 [8].

    Parameters
    ----------
    explanation : its members
    sigma : float64 [8] tolerances
    """
    wide = sigma.copy()
    for member in explanation.members:
        if member.effect is not None and member.effect.parameters[0].name in SESSION:
            wide[SESSION.index(member.effect.parameters[0].name)] = member.slab
    return wide


def _fit_explanation(explanation: Explanation, state: _SearchState, null: Fit) -> Fit:
    """Return the fit of an explanation through the simulation, from the fit without candidates on."""
    return fit_hypotheses(
        state.evidence.train, make_hypotheses(explanation, state.evidence, state.fitted),
        widen_session(explanation, state.evidence.session_sigma), session=null.session, iterations=STEPS,
    )  # fmt: skip


def _move_to(fitted: Fit, state: _SearchState) -> _SearchState:
    """Return the runs about a fit."""
    evidence = differentiate_at(state.evidence, fitted)
    return replace(state, evidence=evidence, fitted=_refit(evidence, fitted), refuted=False)


def _refit(evidence: Evidence, fitted: Fit) -> Fit:
    """Return the same fit under the present derivatives and scales."""
    return fit_hypotheses(
        evidence.train, fitted.parts, fitted.session_sigma, values=fitted.values, session=fitted.session,
        iterations=STEPS,
    )  # fmt: skip


def _settle_scales(state: _SearchState) -> _SearchState:
    """Return the same runs with the scales of disturbances and noise that they ask for, every candidate free."""
    state = _scale_disturbances(state)
    noisy = _scale_noise(state)
    return state if noisy is state else _scale_disturbances(noisy)


def _scale_noise(state: _SearchState) -> _SearchState:
    evidence = set_run_noise(state.evidence, estimate_run_noise(state.evidence, state.fitted))
    if all(run is before for run, before in zip(evidence.train, state.evidence.train, strict=True)):
        return state
    splines = rewhiten_splines(state.splines, state.evidence, evidence)
    return replace(state, evidence=evidence, fitted=_refit(evidence, state.fitted), splines=splines)


def _scale_disturbances(state: _SearchState) -> _SearchState:
    here = state.evidence
    residuals = compute_whitened_residuals(here, state.fitted)
    scales = fit_disturbance(
        here.train, residuals, here.tolerances, here.effects, here.disturbance, state.splines, RIDGE
    )
    if scales == here.disturbance:
        return state
    evidence = rescale_disturbances(here, scales)
    return replace(state, evidence=evidence, fitted=_refit(evidence, state.fitted))
