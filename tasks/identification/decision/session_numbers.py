"""Numbers of the vehicle that a session holds under a prior: which of them may be wrong, and which look alike."""

import numpy as np

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.screening import find_look_alikes
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.hypothesis import Hypothesis, make_library_hypothesis


def free_session_number(evidence: Evidence, base: Fit, name: str) -> Hypothesis | None:
    """Return the hypothesis that the vehicle's own number is wrong; None where the library does not hold the number.

    Parameters
    ----------
    evidence : the runs
    base : fit whose pulled number is the first value
    name : of `SESSION`
    """
    place = _find_in_library(evidence, name)
    if place is None:
        return None
    return make_library_hypothesis(evidence.effects[place], float(base.session[SESSION.index(name)]))


def find_alike_numbers(evidence: Evidence, name: str) -> list[str]:
    """Return the other numbers of the session that the runs can hardly tell from one of them, the most alike first.

    A deceleration shows the quotient of brake gain and mass. What tells the two apart is the body's motion, and the
    tyre's load at its limit.

    Parameters
    ----------
    evidence : the runs
    name : of `SESSION`
    """
    place = _find_in_library(evidence, name)
    if place is None:
        return []
    alike = (evidence.effects[j].parameters for j in find_look_alikes(evidence, place))
    return [numbers[0].name for numbers in alike if len(numbers) == 1 and numbers[0].name in SESSION]


def find_alike_instruments(evidence: Evidence, name: str) -> list[Hypothesis]:
    """Return the errors of instruments that the runs can hardly tell from a number of the session.

    Wheels that are smaller than the file says turn as fast as wheels whose sensor counts too much.

    Parameters
    ----------
    evidence : the runs, with the number held: free, it would follow either
    name : of `SESSION`
    """
    place = _find_in_library(evidence, name)
    if place is None:
        return []
    alike = (evidence.effects[j] for j in find_look_alikes(evidence, place))
    return [make_library_hypothesis(effect) for effect in alike if effect.effect_class == "sensor"]


def compute_joint_pull(fitted: Fit, names: list[str]) -> float:
    """Return how far numbers that look alike are pulled together, in their prior sigmas [1].

    A shift that each takes a part of, in proportion to its variance, is as improbable as if one number had it all under
    the sum of their variances.

    Parameters
    ----------
    fitted : the fit
    names : of `SESSION`
    """
    return float(np.linalg.norm(fitted.pulls[[SESSION.index(name) for name in names]]))


def _find_in_library(evidence: Evidence, name: str) -> int | None:
    """Return the position of the effect that frees a number of the session; None where the library has none."""
    for place, effect in enumerate(evidence.effects):
        if [p.name for p in effect.parameters] == [name]:
            return place
    return None
