"""Backward elimination: what does not earn its place goes, the least certain first, each time with a new fit."""

from collections.abc import Collection, Sequence

import numpy as np

from tasks.identification.joint.fit import JointFit, fit_jointly
from tasks.identification.joint.numbers import FRICTION, JointNumber
from tasks.identification.joint.stops import Stop
from tasks.identification.joint.uncertainty import (
    compute_interval_reach,
    compute_naming_distance,
    compute_standard_errors,
    measure_certainty,
    measure_worst_misfit,
    weigh_robustly,
)
from tasks.identification.rules import JointRules

RESTART_COST = 1.2
"""Cost of a fit over that with the numbers that went from which other starts are tried [1]."""
NEEDED_COST = 0.75
"""Cost of a fit over that without a number below which the number stays though it is not certain [1]."""
GRIPS = (0.0, 0.2, 0.5)
"""Friction from which fits start, where runs saturate the tyres [1]."""
KNOWN_SHARE = 0.5
"""Share of its prior's sigma up to which the runs must tell a friction for it to stay whatever its value [1]."""


def eliminate_uncertain_numbers(stops: Sequence[Stop], fitted: JointFit, rules: JointRules) -> JointFit:
    """Return the fit of what is left when every removable number that is not certain has gone.

    What is named must not hang on one run: from `fewest_scatter_runs` runs on, a number goes that elimination about the
    same fit would take away without any one of them (stability selection, Meinshausen and Buehlmann 2010,
    doi:10.1111/j.1467-9868.2010.00740.x). Of what that leaves, a number stays, too, whose interval of 95 % does not
    hold 0 and which takes a quarter off the cost: fade that rests on estimated temperatures scatters over the runs, and
    makes good half of what they miss. A friction of which the runs say little more than its prior may go.

    Parameters
    ----------
    stops : training runs
    fitted : with every number free
    rules : of the joint fit
    """
    unstable = {n.name for n in fitted.numbers if n.removable} - _find_stable_names(fitted, rules)
    if unstable:
        fitted = _refit_without(stops, fitted, unstable)
    # a friction that nobody needs makes the certain uncertain
    fitted = _drop_unknown_frictions(stops, fitted, rules)
    needed: set[str] = set()
    while True:
        certainty = measure_certainty(fitted, rules)
        weak = [
            (float(here), n.name)
            for n, here in zip(fitted.numbers, certainty, strict=True)
            if n.removable and n.name not in needed
        ]
        if not weak or min(weak)[0] >= 1.0:
            return _drop_unknown_frictions(stops, fitted, rules)
        name = min(weak)[1]
        without = _refit_without(stops, fitted, {name})
        if fitted.cost < NEEDED_COST * without.cost and not interval_holds_zero(fitted, name, rules):
            needed.add(name)
        else:
            fitted, needed = without, set()


def _refit_without(stops: Sequence[Stop], fitted: JointFit, gone: Collection[str]) -> JointFit:
    """Return the fit without some numbers, from several starts where the first ends much worse.

    Without much of what moved the car, tyres that grip less may hide a brake's curve, and a fit ends far from the best.
    """
    left = tuple(n for n in fitted.numbers if n.name not in gone)
    first = refit_numbers(stops, fitted, left)
    if first.cost < RESTART_COST * fitted.cost:
        return first
    others = (refit_numbers(stops, fitted, left, grip) for grip in vary_grip(fitted))
    return min((first, *others), key=lambda fit: fit.cost)


def interval_holds_zero(fitted: JointFit, name: str, rules: JointRules) -> bool:
    """Whether the 95 % interval of a number holds 0.

    Parameters
    ----------
    fitted : the fit
    name : of the number
    rules : of the joint fit
    """
    place = [n.name for n in fitted.numbers].index(name)
    return bool(abs(fitted.values[place]) <= compute_interval_reach(fitted, rules)[place])


def _drop_unknown_frictions(stops: Sequence[Stop], fitted: JointFit, rules: JointRules) -> JointFit:
    """Return the fit without the frictions that its runs neither tell nor need.

    Tyres at their limit and the brake's curve stand in for each other, so that neither may be certain where one of them
    is needed: a friction goes only if the runs are explained as well without it.
    """
    errors = compute_standard_errors(fitted, rules)
    for number, error in zip(fitted.numbers, errors, strict=True):
        if number.group == FRICTION and error > KNOWN_SHARE * number.sigma:
            without = refit_numbers(stops, fitted, tuple(n for n in fitted.numbers if n is not number))
            if without.cost - fitted.cost < 0.5 * compute_naming_distance(len(stops), rules) ** 2:
                return _drop_unknown_frictions(stops, without, rules)
    return fitted


def vary_grip(fitted: JointFit) -> list[dict[str, float]]:
    """Return frictions from which fits start: of every kind of weather alike.

    Parameters
    ----------
    fitted : the fit
    """
    frictions = [n.name for n in fitted.numbers if n.group == FRICTION]
    return [dict.fromkeys(frictions, grip) for grip in GRIPS] if frictions else []


def drop_at_bounds(
    stops: Sequence[Stop], fitted: JointFit, rules: JointRules, reasons: list[str]
) -> JointFit:
    """Return the fit without the numbers that it takes as far as they may go, and say so.

    Parameters
    ----------
    stops : training runs
    fitted : after elimination
    rules : of the joint fit
    reasons : is added to
    """
    ended = [n for n in fitted.numbers if n.may_go and n.is_at_bound(fitted.by_name[n.name])]
    if not ended:
        return fitted
    reasons += [
        f"the fit ends where {number.say(fitted.by_name[number.name])}, as far as it may go: not named"
        for number in ended
    ]
    return drop_at_bounds(stops, eliminate_without(stops, fitted, ended, rules), rules, reasons)


def eliminate_without(
    stops: Sequence[Stop], fitted: JointFit, gone: Collection[JointNumber], rules: JointRules
) -> JointFit:
    """Return the fit of what is certain when some numbers are gone.

    Parameters
    ----------
    stops : training runs
    fitted : with them
    gone : the numbers
    rules : of the joint fit
    """
    left = refit_numbers(stops, fitted, tuple(n for n in fitted.numbers if n not in gone))
    return eliminate_uncertain_numbers(stops, left, rules)


def _find_stable_names(fitted: JointFit, rules: JointRules) -> set[str]:
    """Return the removable numbers that a linear elimination keeps with all runs, and without any one of them."""
    runs = range(len(fitted.residuals))
    samples = [tuple(runs)]
    if len(samples[0]) >= rules.fewest_scatter_runs:
        samples += [tuple(i for i in runs if i != gone) for gone in runs]
    return set.intersection(*(_eliminate_linearly(fitted, sample, rules) for sample in samples))


def _eliminate_linearly(fitted: JointFit, runs: tuple[int, ...], rules: JointRules) -> set[str]:
    """Return the removable numbers that backward elimination keeps on some runs, linear about the fit."""
    residual = [weigh_robustly(fitted.residuals[i]) for i in runs]
    slopes = [fitted.slopes[i] for i in runs]
    prior = np.array([1.0 / n.sigma**2 for n in fitted.numbers])
    information = np.asarray(np.diag(prior) + sum(a.T @ a for a in slopes))
    # residuals fall along the slopes: the right-hand side of the values themselves, not of a move
    right = np.asarray(
        information @ fitted.values - sum(a.T @ r for a, r in zip(slopes, residual, strict=True))
    )
    right -= prior * fitted.values
    wide = measure_worst_misfit([fitted.residuals[i] for i in runs])
    left = list(range(len(fitted.numbers)))
    while True:
        inverse = np.linalg.inv(information[np.ix_(left, left)])
        values = inverse @ right[left]
        sure = np.abs(values) / np.sqrt(np.diag(inverse) * wide)
        weak = [(float(s), j) for s, j in zip(sure, left, strict=True) if fitted.numbers[j].removable]
        if not weak or min(weak)[0] >= compute_naming_distance(len(fitted.residuals), rules):
            return {fitted.numbers[j].name for j in left if fitted.numbers[j].removable}
        left.remove(min(weak)[1])


def refit_numbers(
    stops: Sequence[Stop],
    fitted: JointFit,
    numbers: tuple[JointNumber, ...],
    start: dict[str, float] | None = None,
) -> JointFit:
    """Fit other numbers from where a fit ended.

    Parameters
    ----------
    stops : its runs
    fitted : the fit
    numbers : that are free now
    start : values beside those of the fit
    """
    begin = fitted.by_name | (start or {})
    return fit_jointly(stops, numbers, [begin], scales=fitted.scales, offsets=fitted.offsets)[0]
