"""Runs whose tyres do not grip as the surface mapping says, beside a verdict on what the model lacks."""

from collections.abc import Mapping
from typing import Any

from tasks.identification.decision.verdict import Outcome
from tasks.identification.decision.words import join_phrases
from tasks.identification.inference.disturbance import FRICTION

REPORTED_PULL = 2.5
"""Pull of a run's friction from which it is reported, in tolerances: one such run in 80 has it by chance [1]."""


def compute_friction_pulls(outcome: Outcome) -> dict[str, float]:
    """Return by training run how far its friction is pulled from the surface mapping, in its tolerances [1].

    It is 0 for a run that does not reach its limit of friction.

    Parameters
    ----------
    outcome : the verdict and what it stands on
    """
    evidence = outcome.finding.evidence
    runs, tolerance = evidence.train, evidence.tolerances.friction
    return {
        run.model.run.name: float(offsets[FRICTION] / tolerance)
        for run, offsets in zip(runs, outcome.fitted.offsets, strict=True)
    }


def find_pulled_runs(result: Mapping[str, Any]) -> dict[str, float]:
    """Return the runs of a verdict that pull friction by more than `REPORTED_PULL` tolerances, with their pull [1].

    Parameters
    ----------
    result : the verdict as plain values
    """
    pulls: Mapping[str, float] = result["friction_pulls_sigma"]
    return {name: pull for name, pull in pulls.items() if abs(pull) > REPORTED_PULL}


def describe_friction_pulls(result: Mapping[str, Any], tolerance: float) -> dict[str, Any]:
    """Return a verdict with a reason that names the pulled runs, if any; where nothing is named, its sentence does too.

    Parameters
    ----------
    result : the verdict as plain values
    tolerance : one sigma of a run's friction, relative [1]
    """
    pulled = find_pulled_runs(result)
    if not pulled:
        return dict(result)
    sentence = result["sentence"]
    if result["verdict"] == "NOTHING":
        sentence += f" But in {join_phrases(pulled)} the tyres do not grip as the surface mapping says."
    listed = join_phrases(f"{name} by {pull:+.1f}" for name, pull in pulled.items())
    reason = (
        f"runs at their limit pull friction by more than {REPORTED_PULL:g} of its tolerances ({tolerance:.1%} each):"
        f" {listed}; what is named does not explain it, and stops at the limit are predicted no better"
    )
    return {**result, "sentence": sentence, "reasons": [*result["reasons"], reason]}
