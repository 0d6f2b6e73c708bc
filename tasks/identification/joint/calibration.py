"""Campaigns that need a joint fit, and its first numbers: the brake's gain before anything else."""

from collections.abc import Iterable, Mapping, Sequence

from tasks.campaign.campaign import SESSION, Campaign
from tasks.identification.joint.fit import JointFit, fit_jointly
from tasks.identification.joint.numbers import GAIN, JointNumber
from tasks.identification.joint.stops import Stop
from tasks.identification.rules import JointRules

FIRST = ("lag", "drag_area", "speed_delay")
"""Numbers that are free beside those of every car while the best start is looked for."""
HELD = 1e-5
"""Sigma of a number that stays as the file has it [1]."""


def needs_joint_fit(campaign: Campaign, rules: JointRules) -> bool:
    """Whether a campaign has too few runs for odds of explanations, or has what only a joint fit knows.

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
    """Whether there are too few training or held-out runs for odds of explanations.

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
