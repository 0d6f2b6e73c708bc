"""Named effects of an explanation, fitted alone through the simulation, with their intervals."""

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, SESSION
from tasks.identification.decision.answer import NamedEffect, Parameter, make_estimate
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.forms import KNOTS, find_scanned_ranges, make_form_hypotheses
from tasks.identification.decision.odds import Explanation, RunGrams, keep_members, weigh_explanation
from tasks.identification.decision.search import Finding, make_hypotheses, widen_session
from tasks.identification.decision.told import OpenExplanation
from tasks.identification.inference.fit import SETTLED, Fit, fit_hypotheses
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import Hypothesis, compose_parameters
from tasks.identification.inference.linearisation import differentiate_about_offsets
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.ports import PORT_UNITS

FELT = CHANNELS.index("longitudinal_acceleration")
STEPS = 8
"""Gauss-Newton steps of a last fit [1]."""
MOST_REFINED = 4
"""Times that a last fit is taken about its own offsets [1]."""


def fit_told(finding: Finding, opened: OpenExplanation) -> Fit:
    """Return the fit of what an explanation tells, and nothing else, through the simulation.

    A form is fitted in the shape of the grammar that follows its spline best.

    Parameters
    ----------
    finding : the runs and what was fitted to them
    opened : the explanation
    """
    kept = keep_members(opened.explanation, opened.told)
    evidence, parts = finding.evidence, make_hypotheses(kept, finding.evidence, finding.fitted)
    sigma = widen_session(kept, evidence.session_sigma)

    def fit(hypotheses: tuple[Hypothesis, ...]) -> Fit:
        return fit_hypotheses(
            evidence.train, hypotheses, sigma, session=finding.fitted.session, iterations=STEPS
        )

    ranges = find_scanned_ranges(evidence.train)
    trials = [parts]
    for i, part in enumerate(parts):
        if part.effect_class == "form":
            member = next(m for m in opened.told if m.name == part.name)
            places = kept.find_places(member)
            grid = np.linspace(*ranges[part.variable], KNOTS)
            shapes = make_form_hypotheses(
                part.port, part.variable, grid, kept.values[places], kept.errors[places]
            )
            trials = [(*parts[:i], shape, *parts[i + 1 :]) for shape in shapes]
    return min((fit(trial) for trial in trials), key=lambda fitted: fitted.objective)


def settle_told(
    finding: Finding, opened: Sequence[OpenExplanation], rules: DecisionRules
) -> tuple[list[OpenExplanation], Fit]:
    """Return the open explanations and the fit of the first, whose members are surely large when fitted alone too.

    No form is told whose every coefficient has an interval that holds 0, the file's value.

    Parameters
    ----------
    finding : the runs and what was fitted to them
    opened : the explanations that are open, the first being the one that is told
    rules : the odds of a name
    """
    first, *others = opened
    reach = float(ndtri(rules.named_odds / (1.0 + rules.named_odds)))
    while True:
        fitted = refine_fit(finding, fit_told(finding, first))
        large = []
        for member in first.told:
            if member.effect is None:
                _, coefficients = _list_parameters(member, first.explanation, fitted)
                if all(number.ci_low <= 0.0 <= number.ci_high for number in coefficients):
                    continue
            else:
                value, error = _find_first_number(member, member.effect, first.explanation, fitted)
                if abs(value) - reach * error <= member.matters:
                    continue
            large.append(member)
        if len(large) == len(first.told):
            return [first, *(other for other in others if not other.numbers >= first.numbers)], fitted
        first = replace(first, told=tuple(large))


def refine_fit(finding: Finding, fitted: Fit) -> Fit:
    """Return a fit again with the derivatives taken about it and about each run's own offsets, until it settles.

    Parameters
    ----------
    finding : the runs
    fitted : fit of what an explanation tells
    """
    for _ in range(MOST_REFINED):
        runs = differentiate_about_offsets(finding.evidence, fitted)
        before, fitted = fitted, fit_hypotheses(
            runs, fitted.parts, fitted.session_sigma, values=fitted.values, session=fitted.session,
            offsets=fitted.offsets, iterations=STEPS,
        )  # fmt: skip
        if before.objective - fitted.objective < SETTLED:
            break
    return fitted


def measure_force(finding: Finding, fitted: Fit, names: Sequence[str]) -> float:
    """Return the mean deceleration that some parts of a fit make over the training runs [m/s2].

    Parameters
    ----------
    finding : the runs
    fitted : the fit
    names : of its parts
    """
    values, at = fitted.values.copy(), 0
    for part in fitted.parts:
        values[at : at + len(part.names)] *= part.name not in names
        at += len(part.names)
    felt, free = (
        np.concatenate(
            [predict_channels(run.model, theta, slots=slots)[:, FELT] for run in finding.evidence.train]
        )
        for theta, slots in (fitted.compose(), compose_parameters(fitted.parts, values, fitted.session))
    )
    return float(np.mean(free - felt))


def name_members(opened: OpenExplanation, grams: RunGrams, fitted: Fit | None) -> list[NamedEffect]:
    """Return what an explanation tells in the form in which the verdict reports it, what gains most first.

    Parameters
    ----------
    opened : the explanation
    grams : what the runs say
    fitted : fit of what it tells; None to report the values of the explanation
    """
    named = []
    for member in opened.told:
        rest = [m for m in opened.explanation.members if m is not member]
        without = weigh_explanation(grams, rest)
        score = opened.explanation.log_odds - (0.0 if without is None else without.log_odds)
        gain = opened.explanation.gain - (0.0 if without is None else without.gain)
        spread = opened.explanation.spreads[opened.explanation.members.index(member)]
        name, parameters = _list_parameters(member, opened.explanation, fitted)
        named.append(
            NamedEffect(
                name=name,
                effect_class=member.effect_class,
                port=member.port,
                variable=member.variable,
                parameters=parameters,
                score=score,
                gain=gain,
                spread=spread,
            )
        )
    return sorted(named, key=lambda effect: -effect.gain)


def list_calibrated(
    fitted: Fit, named: Sequence[NamedEffect], library: Sequence[Effect], least: float
) -> list[NamedEffect]:
    """Return the vehicle's own numbers that a prediction rests on where its file hardly knows the brake's gain.

    They are no discovery: those whose 95 % interval does not hold the file's value, without what is named.

    Parameters
    ----------
    fitted : fit of what is named
    named : effects that are named
    library : effects, of which the numbers are
    least : tolerance of the gain from which the file hardly knows it [1]
    """
    if fitted.session_sigma[FILE_NUMBERS.index("pressure_gain")] < least:
        return []
    told = {effect.parameters[0].name for effect in named}
    numbers = {e.parameters[0].name: e for e in library if e.effect_class == "retune"}
    calibrated = []
    for name, value, error in zip(FILE_NUMBERS, fitted.session, fitted.session_error, strict=True):
        if name in numbers and name not in told and abs(value) > NORMAL_QUANTILE * error:
            row = numbers[name].parameters[0]
            estimate = _make_parameter(name, value, error, row.lower, row.upper, row.unit)
            calibrated.append(make_estimate(numbers[name], estimate, float(error)))
    return calibrated


def _list_parameters(
    member: Candidate, explanation: Explanation, fitted: Fit | None
) -> tuple[str, tuple[Parameter, ...]]:
    """Return the name and the parameters of a member: of the last fit, if there is one."""
    places = explanation.find_places(member)
    value, error = explanation.values[places], explanation.errors[places]
    if member.effect is None:
        return _list_form_parameters(member, value, error, fitted)
    values, errors = value, error
    if fitted is not None:
        number = member.effect.parameters[0].name
        values, errors = (
            _find_part(member.name, fitted) if number not in SESSION else (value.copy(), error.copy())
        )
        values[0], errors[0] = _find_first_number(member, member.effect, explanation, fitted)
    rows = member.effect.parameters[: len(values)]
    return member.name, tuple(
        _make_parameter(row.name, v, e, row.lower, row.upper, row.unit)
        for row, v, e in zip(rows, values, errors, strict=True)
    )


def _find_first_number(
    member: Candidate, effect: Effect, explanation: Explanation, fitted: Fit
) -> tuple[float, float]:
    """Return the first number of a member by the last fit, and its error: the fit's or the explanation's.

    That of the explanation knows what every other number may be off, and what differs from run to run; that of the fit
    is about each run's own offsets. The larger holds.
    """
    error = float(explanation.errors[explanation.find_places(member)][0])
    name = effect.parameters[0].name
    if name in SESSION:
        place = SESSION.index(name)
        return float(fitted.session[place]), max(error, float(fitted.session_error[place]))
    values, errors = _find_part(member.name, fitted)
    return float(values[0]), max(error, float(errors[0]))


def _list_form_parameters(
    member: Candidate, value: NDArray[np.float64], error: NDArray[np.float64], fitted: Fit | None
) -> tuple[str, tuple[Parameter, ...]]:
    """Return a form's name and coefficients, or the values at its knots where it was not fitted."""
    part = (
        None
        if fitted is None
        else next((p for p in fitted.parts if p.port == member.port and p.effect_class == "form"), None)
    )
    if part is None or fitted is None:
        return member.name, tuple(
            _make_parameter(f"knot_{k + 1}", v, e, member.lower, member.upper, PORT_UNITS[member.port])
            for k, (v, e) in enumerate(zip(value, error, strict=True))
        )
    values, errors = _find_part(part.name, fitted)
    # the shape's own errors know nothing of the small errors everywhere: the spline's do
    wider = max(1.0, float(np.median(error)) / max(float(np.median(errors)), 1e-300))
    return part.name, tuple(
        _make_parameter(n, v, wider * e, low, high, u)
        for n, v, e, low, high, u in zip(
            part.names, values, errors, part.lower, part.upper, part.units, strict=True
        )
    )


def _find_part(name: str, fitted: Fit) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return values and standard errors of a part of a fit."""
    at = 0
    for part in fitted.parts:
        own = slice(at, at + len(part.names))
        if part.name == name:
            return fitted.values[own], np.sqrt(np.maximum(np.diag(fitted.covariance)[own], 0.0))
        at = own.stop
    raise KeyError(name)


def _make_parameter(
    name: str, value: float, error: float, lower: float, upper: float, unit: str
) -> Parameter:
    reach = NORMAL_QUANTILE * float(error)
    return Parameter(
        name=name, value=float(value), ci_low=float(np.clip(value - reach, lower, upper)),
        ci_high=float(np.clip(value + reach, lower, upper)), lower=float(lower), upper=float(upper), unit=unit,
    )  # fmt: skip


def find_detectable_sizes(finding: Finding, rules: DecisionRules) -> dict[str, float]:
    """Return the smallest first parameter of each effect that would be named at the odds of a name.

    Infinite where the bounds exclude that size [unit of the parameter].

    Parameters
    ----------
    finding : what the runs say
    rules : the odds
    """
    sizes: dict[str, float] = {}
    for candidate in finding.grams.columns.candidates:
        if candidate.effect is None or candidate.name in sizes:
            continue
        # how small a size would be seen does not depend on the size that was
        free = replace(candidate, lower=-np.inf, upper=np.inf)
        alone = weigh_explanation(finding.grams, [free], spread=False)
        if alone is None:
            continue
        error = float(alone.errors[0])
        needed = log(rules.named_odds) - candidate.log_prior + log(max(candidate.slab / error, 1.0))
        size = max(np.sqrt(2.0 * needed) * error, candidate.matters + NORMAL_QUANTILE * error)
        sizes[candidate.name] = size if size <= max(candidate.upper, -candidate.lower) else np.inf
    return sizes
