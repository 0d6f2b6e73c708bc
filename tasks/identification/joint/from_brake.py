"""The brakes' numbers must show from the brake on: before it, a driver whom no channel tells of may feign them."""

from collections.abc import Callable, Collection, Sequence

from tasks.campaign.campaign import Campaign
from tasks.identification.inference.driver import begin_at_brake
from tasks.identification.joint.elimination import eliminate_without, interval_holds_zero
from tasks.identification.joint.fit import JointFit, fit_jointly
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.stops import Stop, make_stop
from tasks.identification.rules import JointRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.parameters import Vehicle

CURVE = "curve"
"""Group of the numbers that act through the brake alone, for as long as it is applied."""
FeignedNumbers = Callable[[JointFit], Collection[JointNumber]]
"""Returns the numbers of a fit that an unlogged driver may feign."""


def make_driver_check(
    campaign: Campaign, vehicle: Vehicle, surface: SurfaceParameters, train: Sequence[Stop], rules: JointRules
) -> FeignedNumbers:
    """Return a function that finds the numbers of the brakes in a fit whose interval holds 0 from the brake on.

    Where neither throttle nor engine was logged, a driver who lifts before he brakes has changed the speed from which
    he brakes, by a larger share the slower he drives: that looks like pads whose friction depends on the speed.

    Parameters
    ----------
    campaign : measured runs
    vehicle, surface : the model that is judged
    train : its training runs
    rules : of the joint fit
    """
    if not any(stop.guesses_lift for stop in train):
        return lambda _: ()
    begun = begin_at_brake(campaign, vehicle, surface, rules.brake_onset_share)
    stops = [make_stop(run, vehicle, surface, begun.channels, rules) for run in begun.train]

    def find_feigned_numbers(fitted: JointFit) -> list[JointNumber]:
        asked = [n for n in fitted.removable_numbers if n.group == CURVE]
        if not asked:
            return []
        alone = fit_jointly(stops, fitted.numbers, [fitted.by_name], scales=fitted.scales)[0]
        return [number for number in asked if interval_holds_zero(alone, number.name, rules)]

    return find_feigned_numbers


def drop_feigned_numbers(
    train: Sequence[Stop],
    fitted: JointFit,
    find_feigned: FeignedNumbers,
    rules: JointRules,
    reasons: list[str],
) -> JointFit:
    """Return the fit without the numbers that an unlogged driver may feign, and say so.

    Parameters
    ----------
    train : training runs
    fitted : to them
    find_feigned : by `make_driver_check`
    rules : of the joint fit
    reasons : is added to
    """
    gone = find_feigned(fitted)
    if not gone:
        return fitted
    reasons += [
        f"the training runs suggest that {number.say(fitted.by_name[number.name])}, but from the brake on they do not"
        " tell that from nothing, and no channel says what drove the car before it: not named"
        for number in gone
    ]
    left = eliminate_without(train, fitted, gone, rules)
    return drop_feigned_numbers(train, left, find_feigned, rules, reasons)
