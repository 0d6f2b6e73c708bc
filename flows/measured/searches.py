"""The two searches of a verdict, with the rules and tables that they take from the catalogues."""

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.verdict import SearchOutcome
from tasks.identification.joint.two_searches import judge_by_two_searches
from tasks.identification.joint.verdict import JointOutcome
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

SEARCHES = ("one effect at a time", "joint fit")
"""How a verdict was reached."""


def judge_campaign(
    measured: Campaign, model: Vehicle, road: SurfaceParameters, effects: tuple[Effect, ...]
) -> SearchOutcome | JointOutcome:
    """Return what a model lacks, by the rules and the numbers of the catalogues.

    Parameters
    ----------
    measured : runs with their split
    model, road : the model that is judged
    effects : library of candidates
    """
    single = tuple(effect for effect in effects if effect.alone)
    return judge_by_two_searches(measured, model, road, single, load_joint_numbers(), load_decision_rules())
