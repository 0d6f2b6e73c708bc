"""The brakes' numbers must show from the brake on: before it, a driver whom no channel tells of may feign them."""

from collections.abc import Sequence

from tasks.campaign.campaign import Campaign
from tasks.identification.inference.driver import begin_at_brake
from tasks.identification.joint.elimination import eliminate_without, interval_holds_zero
from tasks.identification.joint.fit import JointFit, fit_jointly
from tasks.identification.joint.stops import Stop, make_stop
from tasks.identification.rules import JointRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.parameters import Vehicle

CURVE = "curve"
"""Group of the numbers that act through the brake alone, for as long as it is applied."""


def drop_what_the_drive_feigns(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    train: Sequence[Stop],
    fitted: JointFit,
    rules: JointRules,
    reasons: list[str],
) -> JointFit:
    """Return the fit without numbers of the brakes whose interval holds 0 from the brake on, and say so.

    Where neither throttle nor engine was logged, a driver who lifts before he brakes has moved the speed from which he
    brakes, by more the slower he drives: that looks like pads whose friction depends on the speed.

    Parameters
    ----------
    campaign : measured runs
    vehicle, surface : the model that is judged
    train : its training runs
    fitted : to them
    rules : of the joint fit
    reasons : is added to
    """
    asked = [n for n in fitted.removable_numbers if n.group == CURVE]
    if not asked or not any(stop.guesses_lift for stop in train):
        return fitted
    begun = begin_at_brake(campaign, vehicle, surface, rules.brake_onset_share)
    stops = [make_stop(run, vehicle, surface, begun.channels, rules) for run in begun.train]
    alone = fit_jointly(stops, fitted.numbers, [fitted.by_name], scales=fitted.scales)[0]
    gone = [number for number in asked if interval_holds_zero(alone, number.name, rules)]
    if not gone:
        return fitted
    reasons += [
        f"the training runs suggest that {number.say(fitted.by_name[number.name])}, but from the brake on they do not"
        " tell that from 0, and no channel says what drove the car before it: not named"
        for number in gone
    ]
    left = eliminate_without(train, fitted, gone, rules)
    return drop_what_the_drive_feigns(campaign, vehicle, surface, train, left, rules, reasons)
