"""Named effects of an explanation, fitted alone through the simulation, with their intervals."""

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, SESSION
from tasks.identification.decision.agreement import measure_disagreement
from tasks.identification.decision.answer import NamedEffect, Parameter, make_estimate
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.comparison import compare_explanations, temper_odds
from tasks.identification.decision.forms import KNOTS, find_scanned_ranges, make_form_hypotheses
from tasks.identification.decision.odds import (
    Explanation,
    RunGrams,
    can_stand_for,
    compute_likelihood,
    keep_members,
    weigh_explanation,
)
from tasks.identification.decision.open_explanations import OpenExplanation
from tasks.identification.decision.search import Finding, make_hypotheses, widen_session
from tasks.identification.inference.fit import SETTLED, Fit, fit_hypotheses
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import Hypothesis, compose_parameters
from tasks.identification.inference.linearisation import differentiate_about_offsets
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.ports import PORT_UNITS

FELT = CHANNELS.index("longitudinal_acceleration")
FRICTION_LEVEL = "retuned_friction_level"
"""Number of the file that a form of friction with one value everywhere is too."""
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
    kept = keep_members(opened.explanation, opened.named)
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
            member = next(m for m in opened.named if m.name == part.name)
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

    Nothing is named whose interval holds 0, the file's value: of an effect its first number's, of a form every one. A
    number of the file that this fit pulls far beyond its tolerance stays open beside it.

    Parameters
    ----------
    finding : the runs and what was fitted to them
    opened : the explanations that are open, the first being the one that is named
    rules : the odds of a name
    """
    first, *others = opened
    reach = float(ndtri(rules.named_odds / (1.0 + rules.named_odds)))
    share = estimate_signature_share(finding, first, rules)
    while True:
        fitted = fit_told(finding, first)
        if not first.named and knows_brakes(fitted, rules):
            return [first], fitted  # there is nothing whose size a closer fit would tell
        fitted = refine_fit(finding, fitted)
        large = []
        for member in first.named:
            _, numbers = _list_parameters(member, first.explanation, fitted, share)
            if member.effect is not None:
                value, error, _ = _find_first_number(member, member.effect, first.explanation, fitted)
                if abs(value) - reach * error <= member.matters:
                    continue
                numbers = numbers[:1]
            if not all(number.ci_low <= 0.0 <= number.ci_high for number in numbers):
                large.append(member)
        if len(large) == len(first.named):
            break
        first = replace(first, named=tuple(large))
    others = [other for other in others if not other.numbers >= first.numbers]
    varying = _find_varying(finding, first)
    if varying is not None:
        anew = refine_fit(finding, fit_told(finding, varying))
        odds = _compare_fits((anew, varying), (fitted, first), finding, rules)
        if odds > log(rules.named_odds):
            first, fitted = varying, anew
        elif odds > -log(rules.named_odds):
            others.append(replace(varying, log_odds=odds))
    return [first, *others, *_list_strained(finding, first, fitted, rules)], fitted


def _find_varying(finding: Finding, first: OpenExplanation) -> OpenExplanation | None:
    """Return what is named with the best form in place of a level; None where no level is named.

    Derivatives about the fit of one value undervalue what varies at its port: a run's own friction decides when its
    tyres let go.
    """
    grams = finding.grams
    varying = [
        weigh_explanation(grams, [*(m for m in first.named if m is not level), form], spread=False)
        for level in first.named
        if level.name == FRICTION_LEVEL
        for form in grams.columns.candidates
        if form.effect is None and can_stand_for(form, level)
    ]
    found = max((e for e in varying if e), key=lambda e: compute_likelihood(grams, e), default=None)
    return None if found is None else OpenExplanation(explanation=found, named=found.members, log_odds=0.0)


def _compare_fits(
    one: tuple[Fit, OpenExplanation],
    other: tuple[Fit, OpenExplanation],
    finding: Finding,
    rules: DecisionRules,
) -> float:
    """Return the logarithm of the odds of one named fit against another, each about its own values [1].

    Every number costs what a run tells of it (Schwarz 1978, doi:10.1214/aos/1176344136).
    """
    runs, gains, odds = len(finding.evidence.train), [], []
    for fitted, opened in (one, other):
        gains.append(0.5 * (finding.null.objective - fitted.objective))
        numbers = len(fitted.values) + sum(n in SESSION for n in opened.numbers)
        odds.append(gains[-1] + sum(m.log_prior for m in opened.named) - 0.5 * numbers * log(runs))
    return temper_odds(odds[0] - odds[1], max(gains), 0.0, rules.signature_error)


def _list_strained(
    finding: Finding, first: OpenExplanation, fitted: Fit, rules: DecisionRules
) -> list[OpenExplanation]:
    """Return explanations with a number of the file besides, where what is named pulls it far from its value.

    Data that contradict a prior (Box 1980, doi:10.2307/2982063) leave open that the number itself is another.
    """
    members, grams = first.explanation.members, finding.grams
    strained = []
    for candidate in grams.columns.candidates if first.named else ():
        number = candidate.effect.parameters[0].name if candidate.effect else ""
        if number not in SESSION or fitted.pulls[SESSION.index(number)] <= rules.foreign_misfit:
            continue
        if any(member.effect is None and can_stand_for(member, candidate) for member in first.named):
            continue  # a form at its port holds it
        explanation = weigh_explanation(grams, [*members, candidate]) if candidate not in members else None
        if explanation is not None:
            odds = min(
                compare_explanations(grams, explanation, first.explanation, rules.signature_error),
                log(rules.named_odds),
            )
            more = OpenExplanation(explanation=explanation, named=(*first.named, candidate), log_odds=odds)
            strained.append(more)
    return strained


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


def estimate_signature_share(finding: Finding, opened: OpenExplanation, rules: DecisionRules) -> float:
    """Return the error of a value, over the value, by what the car's equations differ from the model's [1].

    It is the error of a signature where the runs disagree with the model by as much as their noise, and 0 where noise
    alone explains them.

    Parameters
    ----------
    finding : what the runs say
    opened : the explanation that is named
    rules : the error of a signature
    """
    excess = measure_disagreement(finding.grams, opened.explanation) - 1.0
    return rules.signature_error * float(np.sqrt(np.clip(excess, 0.0, 1.0)))


def name_members(
    opened: OpenExplanation, grams: RunGrams, fitted: Fit | None, share: float = 0.0
) -> list[NamedEffect]:
    """Return what an explanation tells in the form in which the verdict reports it, what gains most first.

    Parameters
    ----------
    opened : the explanation
    grams : what the runs say
    fitted : fit of what it tells; None to report the values of the explanation
    share : `estimate_signature_share` [1]
    """
    named = []
    for member in opened.named:
        rest = [m for m in opened.explanation.members if m is not member]
        without = weigh_explanation(grams, rest)
        score = opened.explanation.log_odds - (0.0 if without is None else without.log_odds)
        gain = opened.explanation.gain - (0.0 if without is None else without.gain)
        spread = opened.explanation.spreads[opened.explanation.members.index(member)]
        name, parameters = _list_parameters(member, opened.explanation, fitted, share)
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


def _list_parameters(
    member: Candidate, explanation: Explanation, fitted: Fit | None, share: float
) -> tuple[str, tuple[Parameter, ...]]:
    """Return the name and the parameters of a member: of the last fit, if there is one.

    Intervals hold noise, what differs from run to run, and what the signature of another car may be off.
    """
    places = explanation.find_places(member)
    value, error = explanation.values[places], explanation.errors[places]
    if member.effect is None:
        return _list_form_parameters(member, value, error, fitted, share)
    values, errors, scatter = value, error, np.zeros(len(value))
    if fitted is not None:
        values, errors, scatter = value.copy(), error.copy(), scatter.copy()
        if member.effect.parameters[0].name not in SESSION:
            values, errors, scatter = _find_part(member.name, fitted)
        values[0], errors[0], scatter[0] = _find_first_number(member, member.effect, explanation, fitted)
    rows = member.effect.parameters[: len(values)]
    errors = np.sqrt(errors**2 + scatter**2 + (share * values) ** 2)
    return member.name, tuple(
        _make_parameter(row.name, v, e, row.lower, row.upper, row.unit)
        for row, v, e in zip(rows, values, errors, strict=True)
    )


def _find_first_number(
    member: Candidate, effect: Effect, explanation: Explanation, fitted: Fit
) -> tuple[float, float, float]:
    """Return the first number of a member by the last fit, its error, and what the runs' scatter adds.

    The explanation's error knows what every other number may be off, and what differs from run to run; that of the fit
    is about each run's own offsets. The larger holds.
    """
    error = float(explanation.errors[explanation.find_places(member)][0])
    name = effect.parameters[0].name
    if name in SESSION:
        place, last = SESSION.index(name), len(fitted.values)
        own = fitted.session_error[place], fitted.scatter[last + place]
        return float(fitted.session[place]), max(error, float(own[0])), float(own[1])
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
