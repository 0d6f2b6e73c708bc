"""The search of a verdict, with the rules and tables that it takes from the catalogues."""

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.verdict import Outcome, judge_runs
from tasks.identification.joint.calibration import needs_joint_fit
from tasks.identification.joint.verdict import JointOutcome, judge_jointly
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

SEARCHES = ("odds of explanations", "joint fit")
"""How a verdict was reached."""


def judge_campaign(
    measured: Campaign, model: Vehicle, road: SurfaceParameters, effects: tuple[Effect, ...]
) -> Outcome | JointOutcome:
    """Return what a model lacks, by the rules and the numbers of the catalogues.

    Parameters
    ----------
    measured : runs with their split
    model, road : the model that is judged
    effects : library of candidates
    """
    rules = load_decision_rules()
    if needs_joint_fit(measured, rules.joint):
        return judge_jointly(measured, model, road, load_joint_numbers(), rules)
    return judge_runs(measured, model, road, effects, rules)
