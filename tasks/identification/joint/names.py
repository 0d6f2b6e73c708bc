"""Names of what a joint fit leaves: new physics, numbers of the vehicle's file, and the rivals of both."""

from collections.abc import Mapping, Sequence

from tasks.campaign.campaign import SESSION, Campaign
from tasks.identification.decision.answer import NamedEffect, Parameter, is_within_tolerance, make_estimate
from tasks.identification.joint.fit import JointFit
from tasks.identification.joint.numbers import FRICTION, GAIN, JointNumber
from tasks.identification.joint.substitutes import Substitute
from tasks.identification.joint.uncertainty import compute_interval_reach, compute_told_errors
from tasks.identification.rules import JointRules
from tasks.vehicle.effects.table import PARAMETERS


def name_numbers(
    fitted: JointFit, tolerances: Mapping[str, float], rules: JointRules
) -> tuple[list[NamedEffect], list[NamedEffect]]:
    """Return what is named, new physics first, and what only calibrates the file within its tolerances.

    What every car needs anew is told whatever its size: the prediction rests on it.

    Parameters
    ----------
    fitted : what is left
    tolerances : of the numbers of the file [their units]
    rules : of the joint fit
    """
    told = [*fitted.removable_numbers]
    told += [n for n in fitted.numbers if not n.removable and not n.is_at_bound(fitted.by_name[n.name])]
    order = {"effect": 0, "sensor": 1, "retune": 2}
    named = sorted((_name_number(fitted, n, rules) for n in told), key=lambda e: order[e.effect_class])
    within = [is_within_tolerance(e, tolerances, rules.wrong_number_tolerances) for e in named]
    effects = [e for e, calibrates in zip(named, within, strict=True) if not calibrates]
    return effects, [e for e, calibrates in zip(named, within, strict=True) if calibrates]


def name_rivals(
    fitted: JointFit, substitutes: Sequence[Substitute], effects: Sequence[NamedEffect], rules: JointRules
) -> list[tuple[str, NamedEffect]]:
    """Return the rivals of what is named, each with the name that it stands in for.

    Parameters
    ----------
    fitted : what is left
    substitutes : what explains the runs as well
    effects : that are named
    rules : of the joint fit
    """
    effect_of = {n.name: n.effect.name for n in fitted.numbers}
    rivals = []
    for other in substitutes:
        number = next(n for n in other.fitted.numbers if n.name == other.name)
        rivals.append((effect_of[other.of], _name_number(other.fitted, number, rules)))
    named = {effect.name for effect in effects}
    grips = [
        _name_number(fitted, n, rules)
        for n in fitted.numbers
        if n.group == FRICTION and n.effect.name not in named
    ]
    curve = {n.effect.name for n in fitted.numbers if n.group == "curve"}
    # tyres at their limit bend the brake's curve too
    return rivals + [(effect.name, grip) for effect in effects if effect.name in curve for grip in grips]


def _name_number(fitted: JointFit, number: JointNumber, rules: JointRules) -> NamedEffect:
    """Return a number with its interval in the form in which the verdict reports an effect."""
    place = fitted.numbers.index(number)
    value, error = float(fitted.values[place]), float(compute_told_errors(fitted, rules)[place])
    reach = float(compute_interval_reach(fitted, rules)[place])
    estimate = Parameter(
        name=number.name, value=value, ci_low=max(value - reach, number.lower),
        ci_high=min(value + reach, number.upper), lower=number.lower, upper=number.upper,
        unit=PARAMETERS[number.name].unit,
    )  # fmt: skip
    return make_estimate(number.effect, estimate, error)


def collect_tolerances(campaign: Campaign, shown: Sequence[JointNumber]) -> dict[str, float]:
    """Return the declared tolerance of each number that re-tuning moves [its unit].

    Parameters
    ----------
    campaign : measured runs
    shown : numbers that they can show
    """
    session = dict(zip(SESSION, campaign.tolerances.session, strict=True))
    frictions = [n.name for n in shown if n.group == FRICTION]
    return {name: session[name] for name in (GAIN, "wheel_radius", "mass", "slope")} | dict.fromkeys(
        frictions, campaign.tolerances.friction
    )
