"""Two searches for what a model lacks, and which of them judges a campaign."""

from contextlib import suppress

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.verdict import Trace, find_missing_effects
from tasks.identification.joint.verdict import JointTrace, judge_jointly, needs_joint_fit
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

SEARCHES = ("one effect at a time", "joint fit")
"""How a verdict was reached."""


def judge_campaign(
    measured: Campaign, model: Vehicle, road: SurfaceParameters, effects: tuple[Effect, ...]
) -> Trace | JointTrace:
    """Look for one effect at a time where the file knows its car; fit all numbers at once where it does not.

    Parameters
    ----------
    measured : runs with their split
    model, road : the model that is judged
    effects : library of candidates
    """
    rules = load_decision_rules()
    if not needs_joint_fit(measured, rules.joint):
        with suppress(ForeignCarError):
            return find_missing_effects(measured, model, road, effects, rules)
    return judge_jointly(measured, model, road, load_joint_numbers(), rules)
