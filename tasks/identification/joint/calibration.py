"""The brake's gain, found before anything else: of a car that its file knows but for it, single effects can be told."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from tasks.campaign.campaign import CHANNELS, SESSION, Campaign
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.inference.noise import estimate_channel_noise
from tasks.identification.joint.fit import JointFit, fit_jointly, measure_misfit, suggest_starts
from tasks.identification.joint.numbers import GAIN, JointNumber, choose_numbers
from tasks.identification.joint.stops import Stop, make_stop
from tasks.identification.rules import JointRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.parameters import Vehicle

FIRST = ("lag", "drag_area", "speed_delay")
"""Numbers that are free beside those of every car while the best start is looked for."""
HELD = 1e-5
"""Sigma of a number that stays as the file has it [1]."""


def needs_joint_fit(campaign: Campaign, rules: JointRules) -> bool:
    """Whether a campaign says too little to look for one effect at a time, or has what only a joint fit knows.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    rules : of the joint fit
    """
    # a throttle, and a brake signal that is no pressure
    return (
        has_few_runs(campaign, rules)
        or campaign.brake_signal != "brake_pressure"
        or any(run.throttle is not None for run in campaign.runs)
    )


def is_gain_unknown(campaign: Campaign, rules: JointRules) -> bool:
    """Whether the brake's gain is to be found: the file hardly knows it, or the signal is no pressure.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    rules : of the joint fit
    """
    tolerance = campaign.tolerances.session[SESSION.index(GAIN)]
    return campaign.brake_signal != "brake_pressure" or tolerance >= rules.unknown_gain_tolerance


def has_few_runs(campaign: Campaign, rules: JointRules) -> bool:
    """Whether there are too few training or held-out runs to look for one effect at a time.

    Parameters
    ----------
    campaign : measured runs with their split
    rules : of the joint fit
    """
    return min(len(campaign.train), len(campaign.held_out)) < rules.fewest_runs


def fit_first_numbers(
    train: Sequence[Stop], shown: Iterable[JointNumber], starts: Sequence[Mapping[str, float]]
) -> JointFit:
    """Fit the few numbers that matter most, from the best of several starts.

    Parameters
    ----------
    train : training runs
    shown : numbers that the campaign can show
    starts : values by name
    """
    few = tuple(n for n in shown if not n.removable or (n.name in FIRST and not n.stands_in))
    return fit_jointly(train, few, starts)[0]


def calibrate_gain(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    numbers: Sequence[JointNumber],
    rules: JointRules,
) -> dict[str, tuple[float, float]]:
    """Return the numbers of the session that the file hardly knows, each with a first value and its prior's sigma.

    That is the brake's gain, as a change of the file's. Mass, and wheel radius where no wheel speed was measured, are
    held at the file's: a deceleration hardly tells them from the gain. Nothing is returned for a file that knows it.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    vehicle, surface : the model as it stands
    numbers : that a joint fit may move
    rules : of the joint fit

    Raises
    ------
    ForeignCarError
        If the runs differ from the calibrated model by much more than their sensors' noise: single effects cannot be
        told then.
    """
    if not is_gain_unknown(campaign, rules):
        return {}
    train = [make_stop(run, vehicle, surface, campaign.channels, rules) for run in campaign.train]
    shown = choose_numbers(numbers, campaign, [stop.model for stop in train], rules)
    fitted = fit_first_numbers(train, shown, suggest_starts(train))
    noise = estimate_channel_noise(campaign)[1]
    misfit = measure_misfit(fitted, train)
    seen = np.flatnonzero(np.isfinite(misfit))
    if np.any(misfit[seen] > rules.foreign_misfit * noise[seen]):
        worst = int(seen[np.argmax(misfit[seen] / noise[seen])])
        raise ForeignCarError(
            f"no brake gain makes the car the model's: the {CHANNELS[worst].replace('_', ' ')} misses by"
            f" {misfit[worst] / noise[worst]:.1f} times its noise (at most {rules.foreign_misfit:g})"
        )
    gain = next(number for number in shown if number.name == GAIN)
    wheels = any(name.startswith("wheel_speed") for name in campaign.channels)
    held = ("mass",) if wheels else ("mass", "wheel_radius")
    return {GAIN: (fitted.by_name[GAIN], gain.sigma)} | dict.fromkeys(held, (0.0, HELD))
