"""Explanations that are named, fitted alone through the simulation until they settle."""

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np
from scipy.special import ndtri

from tasks.campaign.campaign import CHANNELS, SESSION
from tasks.identification.decision.agreement import measure_disagreement
from tasks.identification.decision.comparison import compare_explanations, temper_odds
from tasks.identification.decision.forms import KNOTS, find_scanned_ranges, make_form_hypotheses
from tasks.identification.decision.naming import find_first_number, knows_brakes, list_parameters
from tasks.identification.decision.odds import (
    PORT_OF_NUMBER,
    can_stand_for,
    compute_likelihood,
    keep_members,
    weigh_explanation,
)
from tasks.identification.decision.open_explanations import OpenExplanation
from tasks.identification.decision.search import Finding, make_hypotheses, widen_session
from tasks.identification.inference.disturbance import DISTURBED
from tasks.identification.inference.fit import SETTLED, Fit, fit_hypotheses
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import Hypothesis, compose_parameters
from tasks.identification.inference.linearisation import differentiate_about_offsets
from tasks.identification.rules import DecisionRules

FELT = CHANNELS.index("longitudinal_acceleration")
STEPS = 8
"""Gauss-Newton steps of a last fit [1]."""
MOST_REFINED = 4
"""Times that a last fit is taken about its own offsets [1]."""


def fit_named(finding: Finding, opened: OpenExplanation) -> Fit:
    """Return the fit of what an explanation names, and nothing else, through the simulation.

    A form is fitted in the shape of the grammar that follows its spline best.

    Parameters
    ----------
    finding : the runs and what was fitted to them
    opened : the explanation
    """
    if not opened.named and finding.fitted is finding.null:
        return finding.null
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
            own = kept.find_numbers(member)
            grid = np.linspace(*ranges[part.variable], KNOTS)
            shapes = make_form_hypotheses(part.port, part.variable, grid, kept.values[own], kept.errors[own])
            trials = [(*parts[:i], shape, *parts[i + 1 :]) for shape in shapes]
    return min((fit(trial) for trial in trials), key=lambda fitted: fitted.objective)


def settle_named(
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
        fitted = fit_named(finding, first)
        if not first.named and knows_brakes(fitted, rules):
            return [first], fitted  # there is nothing whose size a closer fit would tell
        fitted = refine_fit(finding, fitted)
        large = []
        for member in first.named:
            _, numbers = list_parameters(member, first.explanation, fitted, share)
            if member.effect is not None:
                value, error, _ = find_first_number(member, member.effect, first.explanation, fitted)
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
        anew = refine_fit(finding, fit_named(finding, varying))
        odds = _compare_fits((anew, varying), (fitted, first), finding, rules)
        if odds > log(rules.named_odds):
            first, fitted = varying, anew
        elif odds > -log(rules.named_odds):
            others.append(replace(varying, log_odds=odds))
    return [first, *others, *_list_strained(finding, first, fitted, rules)], fitted


def _find_varying(finding: Finding, first: OpenExplanation) -> OpenExplanation | None:
    """Return what is named with the best form in place of a number of the file; None where no such number is named.

    At the ports where each run has a disturbance of its own, that disturbance takes up what varies: derivatives about
    the fit of one value undervalue a form there. Nothing takes it up at the brake.
    """
    grams = finding.grams
    varying = [
        weigh_explanation(grams, [*(m for m in first.named if m is not level), form], spread=False)
        for level in first.named
        if PORT_OF_NUMBER.get(level.name) in DISTURBED
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
    fitted : fit of what an explanation names
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
