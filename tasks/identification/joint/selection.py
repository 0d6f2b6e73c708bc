"""Which numbers of a car stay in the joint fit: all that its runs can show, less what does not earn its place."""

from collections.abc import Mapping, Sequence

import numpy as np

from tasks.campaign.campaign import Campaign
from tasks.identification.joint.calibration import fit_first_numbers, is_gain_unknown
from tasks.identification.joint.elimination import (
    drop_at_bounds,
    eliminate_uncertain_numbers,
    refit_numbers,
    vary_grip,
)
from tasks.identification.joint.fit import JointFit, choose_misfit_scales, fit_jointly, suggest_starts
from tasks.identification.joint.held_out import drop_what_predicts_worse
from tasks.identification.joint.instruments import drop_contradicted_instruments
from tasks.identification.joint.numbers import JointNumber, free_numbers
from tasks.identification.joint.stops import Stop
from tasks.identification.joint.substitutes import foresee_falls
from tasks.identification.joint.uncertainty import (
    compute_naming_distance,
    compute_standard_errors,
    measure_certainty,
)
from tasks.identification.rules import JointRules

MOST_ADDED = 2
"""Numbers that are tried beside what is left, of those whose derivatives promise most [1]."""
PROMISED = 0.05
"""Fall of the cost that they must promise, over the square of the standard errors that a name needs [1]: a tenth of
what such a number makes good, for a brake's curve makes good four times what its derivatives foresee."""
BENDS_RESISTANCE = "pad_speed"
"""Pad friction that depends on speed: with it a constant resistance may stand for air drag, and air drag for it."""


def select_numbers(
    campaign: Campaign,
    train: Sequence[Stop],
    held_out: Sequence[Stop],
    shown: Sequence[JointNumber],
    rules: JointRules,
    reasons: list[str],
) -> tuple[JointFit, tuple[int, int]]:
    """Fit all that the runs can show, and take away what does not earn its place.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    train, held_out : the runs
    shown : numbers that the campaign can show
    rules : of the joint fit
    reasons : is added to

    Returns
    -------
    The fit of what is left, and how many starts reach the same one, of all.
    """
    starts = suggest_starts(train) if is_gain_unknown(campaign, rules) else [{}]
    everything = _fit_everything(train, starts, free_numbers(shown, [stop.model for stop in train], rules))
    settled, agreeing = _settle(train, eliminate_uncertain_numbers(train, everything, rules), starts, rules)
    # at a better fit a number may be no longer certain
    fitted = eliminate_uncertain_numbers(train, settled, rules)
    fitted = add_certain_numbers(train, fitted, everything.numbers, rules)
    fitted = drop_contradicted_instruments(train, fitted, rules, reasons)
    fitted = drop_at_bounds(train, fitted, rules, reasons)
    fitted = drop_what_predicts_worse(train, held_out, fitted, rules, reasons)
    return drop_at_bounds(train, fitted, rules, reasons), agreeing


def _fit_everything(
    train: Sequence[Stop], starts: Sequence[Mapping[str, float]], sets: Sequence[tuple[JointNumber, ...]]
) -> JointFit:
    """Return the fit of every number of the set that explains most: from the best of several starts of the first few.

    Sets are compared without `BENDS_RESISTANCE`, which makes a resistance of one shape look like that of another.
    """
    best = fit_first_numbers(train, {n.name: n for numbers in sets for n in numbers}.values(), starts)
    scales = choose_misfit_scales(best, train)

    def fit_set(numbers: Sequence[JointNumber], start: JointFit) -> JointFit:
        return fit_jointly(train, tuple(numbers), [start.by_name], scales=scales, offsets=start.offsets)[0]

    if len(sets) == 1:
        return fit_set(sets[0], best)
    plain = [fit_set([n for n in numbers if n.name != BENDS_RESISTANCE], best) for numbers in sets]
    place = min(range(len(sets)), key=lambda i: plain[i].cost)
    return fit_set(sets[place], plain[place])


def _settle(
    train: Sequence[Stop], fitted: JointFit, starts: Sequence[Mapping[str, float]], rules: JointRules
) -> tuple[JointFit, tuple[int, int]]:
    """Return the best fit of the numbers left, from several starts too, and how many of these reach it."""
    grips = vary_grip(fitted) or [{}]
    begins = [fitted.by_name, *({**starts[0], **grip} for grip in grips), *starts[1:]]
    fits = fit_jointly(train, fitted.numbers, begins, scales=fitted.scales)
    # runs whose own numbers start anew may end in a worse minimum than where they are
    best = min((fitted, *fits), key=lambda fit: fit.cost)
    near = rules.same_fit_errors * compute_standard_errors(best, rules)
    same = sum(bool(np.all(np.abs(f.values - best.values) < near)) for f in fits)
    return best, (same, len(fits))


def add_certain_numbers(
    stops: Sequence[Stop], fitted: JointFit, everything: Sequence[JointNumber], rules: JointRules
) -> JointFit:
    """Return the fit with those numbers that are certain beside what is left, of the few that promise most.

    Where all numbers are free, those that stand in for each other are uncertain, and elimination may take the wrong one
    away: of four stops of a race car it took the brake's curve, of four others it kept it.
    """
    left = {n.name for n in fitted.numbers}
    others = [n for n in everything if n.removable and n.name not in left]
    falls = foresee_falls(stops, fitted, others) if others else np.empty(0)
    for place in np.argsort(-falls)[:MOST_ADDED]:
        number = others[place]
        if falls[place] < PROMISED * compute_naming_distance(len(stops), rules) ** 2:
            break
        wider = refit_numbers(stops, fitted, (*fitted.numbers, number), {number.name: 0.5 * number.sigma})
        if measure_certainty(wider, rules)[-1] < 1.0 or number.is_at_bound(wider.by_name[number.name]):
            continue
        wider = eliminate_uncertain_numbers(stops, wider, rules)
        if number.name in wider.by_name and wider.cost < fitted.cost:
            return add_certain_numbers(stops, wider, everything, rules)
    return fitted
