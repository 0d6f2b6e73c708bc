"""Named effects of an explanation as a verdict reports them: their numbers with intervals."""

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import FILE_NUMBERS, SESSION
from tasks.identification.decision.answer import NamedEffect, Parameter, make_estimate
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.odds import (
    Explanation,
    RunGrams,
    weigh_explanation,
)
from tasks.identification.decision.open_explanations import OpenExplanation
from tasks.identification.decision.search import Finding
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.ports import PORT_UNITS


def name_members(
    opened: OpenExplanation, grams: RunGrams, fitted: Fit | None, share: float = 0.0
) -> list[NamedEffect]:
    """Return what an explanation names in the form in which the verdict reports it, what gains most first.

    Parameters
    ----------
    opened : the explanation
    grams : what the runs say
    fitted : fit of what it names; None to report the values of the explanation
    share : `estimate_signature_share` [1]
    """
    named = []
    for member in opened.named:
        rest = [m for m in opened.explanation.members if m is not member]
        without = weigh_explanation(grams, rest)
        score = opened.explanation.log_odds - (0.0 if without is None else without.log_odds)
        gain = opened.explanation.gain - (0.0 if without is None else without.gain)
        spread = opened.explanation.spreads[opened.explanation.members.index(member)]
        name, parameters = list_parameters(member, opened.explanation, fitted, share)
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


def knows_brakes(fitted: Fit, rules: DecisionRules) -> bool:
    """Return whether a vehicle file knows the gain of its brakes.

    Parameters
    ----------
    fitted : under the tolerances of the file
    rules : from which tolerance it hardly knows it
    """
    return float(fitted.session_sigma[FILE_NUMBERS.index("pressure_gain")]) < rules.hardly_known_tolerance


def list_calibrated(
    fitted: Fit, named: Sequence[NamedEffect], library: Sequence[Effect], rules: DecisionRules
) -> list[NamedEffect]:
    """Return the vehicle's own numbers that a prediction rests on where its file hardly knows the brake's gain.

    They are no discovery: those whose 95 % interval does not hold the file's value, without what is named.

    Parameters
    ----------
    fitted : fit of what is named
    named : effects that are named
    library : effects, of which the numbers are
    rules : from which tolerance of the gain the file hardly knows it
    """
    if knows_brakes(fitted, rules):
        return []
    taken = {effect.parameters[0].name for effect in named}
    numbers = {e.parameters[0].name: e for e in library if e.effect_class == "retune"}
    calibrated = []
    for name, value, error in zip(FILE_NUMBERS, fitted.session, fitted.session_error, strict=True):
        if name in numbers and name not in taken and abs(value) > NORMAL_QUANTILE * error:
            row = numbers[name].parameters[0]
            estimate = _make_parameter(name, value, error, row.lower, row.upper, row.unit)
            calibrated.append(make_estimate(numbers[name], estimate, float(error)))
    return calibrated


def list_parameters(
    member: Candidate, explanation: Explanation, fitted: Fit | None, share: float
) -> tuple[str, tuple[Parameter, ...]]:
    """Return the name and the parameters of a member: of the last fit, if there is one.

    Intervals hold noise, what differs from run to run, and what the signature of another car may be off.

    Parameters
    ----------
    member : of the explanation
    explanation : with values and errors of its own
    fitted : the last fit; None takes the explanation's values
    share : error of a value by the car's equations, over the value [1]
    """
    own = explanation.find_numbers(member)
    value, error = explanation.values[own], explanation.errors[own]
    if member.effect is None:
        return _list_form_parameters(member, value, error, fitted, share)
    values, errors, scatter = value, error, np.zeros(len(value))
    if fitted is not None:
        values, errors, scatter = value.copy(), error.copy(), scatter.copy()
        if member.effect.parameters[0].name not in SESSION:
            values, errors, scatter = _find_part(member.name, fitted)
        values[0], errors[0], scatter[0] = find_first_number(member, member.effect, explanation, fitted)
    rows = member.effect.parameters[: len(values)]
    errors = np.sqrt(errors**2 + scatter**2 + (share * values) ** 2)
    return member.name, tuple(
        _make_parameter(row.name, v, e, row.lower, row.upper, row.unit)
        for row, v, e in zip(rows, values, errors, strict=True)
    )


def find_first_number(
    member: Candidate, effect: Effect, explanation: Explanation, fitted: Fit
) -> tuple[float, float, float]:
    """Return the first number of a member by the last fit, its error, and what the runs' scatter adds.

    The explanation's error knows what every other number may be off, and what differs from run to run; that of the fit
    is about each run's own offsets. The larger holds.

    Parameters
    ----------
    member, effect : of the explanation, and its effect
    explanation : with errors of its own
    fitted : the last fit
    """
    error = float(explanation.errors[explanation.find_numbers(member)][0])
    name = effect.parameters[0].name
    if name in SESSION:
        index, last = SESSION.index(name), len(fitted.values)
        own = fitted.session_error[index], fitted.scatter[last + index]
        return float(fitted.session[index]), max(error, float(own[0])), float(own[1])
    values, errors, scatter = _find_part(member.name, fitted)
    return float(values[0]), max(error, float(errors[0])), float(scatter[0])


def _list_form_parameters(
    member: Candidate,
    value: NDArray[np.float64],
    error: NDArray[np.float64],
    fitted: Fit | None,
    share: float,
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
    values, errors, scatter = _find_part(part.name, fitted)
    # the shape's own errors know nothing of the small errors everywhere: the spline's do
    wider = max(1.0, float(np.median(error)) / max(float(np.median(errors)), 1e-300))
    errors = np.sqrt((wider * errors) ** 2 + scatter**2 + (share * values) ** 2)
    return part.name, tuple(
        _make_parameter(n, v, e, low, high, u)
        for n, v, e, low, high, u in zip(
            part.names, values, errors, part.lower, part.upper, part.units, strict=True
        )
    )


def _find_part(name: str, fitted: Fit) -> tuple[NDArray[np.float64], ...]:
    """Return values, standard errors and scatter of a part of a fit."""
    at = 0
    for part in fitted.parts:
        own = slice(at, at + len(part.names))
        if part.name == name:
            errors = np.sqrt(np.maximum(np.diag(fitted.covariance)[own], 0.0))
            return fitted.values[own].copy(), errors, fitted.scatter[own].copy()
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
