"""Two searches for what a model lacks, and which of them judges a campaign."""

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.verdict import Trace
from tasks.identification.joint.calibration import needs_joint_fit
from tasks.identification.joint.second_look import find_effects_in_two_looks
from tasks.identification.joint.verdict import JointTrace, judge_jointly
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

SEARCHES = ("one effect at a time", "joint fit")
"""How a verdict was reached."""


def judge_campaign(
    measured: Campaign, model: Vehicle, road: SurfaceParameters, effects: tuple[Effect, ...]
) -> Trace | JointTrace:
    """Look for one effect at a time where the car is the model's but for its brake gain; else fit all numbers at once.

    Parameters
    ----------
    measured : runs with their split
    model, road : the model that is judged
    effects : library of candidates
    """
    rules, numbers = load_decision_rules(), load_joint_numbers()
    disagreement = ""
    if not needs_joint_fit(measured, rules.joint):
        single = tuple(effect for effect in effects if effect.alone)
        try:
            return find_effects_in_two_looks(measured, model, road, single, numbers, rules)
        except ForeignCarError as error:
            disagreement = str(error)
    return judge_jointly(measured, model, road, numbers, rules, disagreement=disagreement)
