"""Predictions of a verdict's models for each measured run, whichever search reached it, and the residuals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.verdict import Trace
from tasks.identification.decision.words import join_phrases
from tasks.identification.inference.forward import RunModel, predict_channels
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.identification.joint.fit import lead_offsets
from tasks.identification.joint.stops import predict_stop
from tasks.identification.joint.verdict import JointTrace
from tasks.vehicle.effects.table import EFFECT_TABLE

MODELS = ("frozen", "retuned", "after")
"""Models of a verdict: the vehicle file's, with its own numbers fitted, and with what was found."""

FRICTION_OFFSET = 1
"""Place of friction among a run's own offsets (`tasks.identification.inference.evidence.move_by_offsets`)."""
TOLD_PULL = 2.5
"""Pull of a run's friction from which it is told, in tolerances: one such run in 80 has it by chance [1]."""


@dataclass(frozen=True, kw_only=True)
class RunPrediction:
    """A measured run beside what the models predict for it.

    Parameters
    ----------
    model : the run
    channels : indices of the channels that were compared
    predicted : by name of the model, float64 [N, 7] readings [units of the channels]
    """

    model: RunModel
    channels: tuple[int, ...]
    predicted: Mapping[str, NDArray[np.float64]]


def predict_runs(trace: Trace | JointTrace) -> tuple[tuple[RunPrediction, ...], tuple[RunPrediction, ...]]:
    """Return the training runs and the held-out runs with the predictions of the frozen and the grown model.

    Parameters
    ----------
    trace : the verdict and what it stands on; a joint fit has the re-tuned model too on its held-out runs
    """
    if isinstance(trace, JointTrace):
        return _predict_stops(trace)
    theta, slots = compose_parameters(trace.end.base.parts, trace.end.base.values, trace.end.base.session)
    evidence = trace.start.evidence
    train, held_out = (
        tuple(
            RunPrediction(
                model=run.model,
                channels=tuple(np.flatnonzero(np.isfinite(run.sigma)).tolist()),
                predicted={
                    "frozen": predict_channels(run.model, np.zeros(len(EFFECT_TABLE))),
                    "after": predict_channels(run.model, theta, slots=slots),
                },
            )
            for run in runs
        )
        for runs in (evidence.train, evidence.held_out)
    )
    return train, held_out


def _predict_stops(trace: JointTrace) -> tuple[tuple[RunPrediction, ...], tuple[RunPrediction, ...]]:
    fitted = trace.fitted
    train = tuple(
        RunPrediction(
            model=stop.model,
            channels=tuple(stop.channels.tolist()),
            predicted={
                "frozen": predict_stop(stop, {}, lead_offsets(stop, {}, fitted.scales)),
                "after": predict_stop(stop, fitted.by_name, offsets),
            },
        )
        for stop, offsets in zip(trace.train, fitted.offsets, strict=True)
    )
    held_out = tuple(
        RunPrediction(
            model=stop.model,
            channels=tuple(stop.channels.tolist()),
            predicted=dict(zip(MODELS, predicted, strict=True)),
        )
        for stop, predicted in zip(trace.held_out, trace.predicted, strict=True)
    )
    return train, held_out


def compute_residual_rmse(runs: Sequence[RunPrediction]) -> dict[str, dict[str, dict[str, float]]]:
    """Return RMSE by run, channel and model, frozen and after [unit of the channel].

    Parameters
    ----------
    runs : measured runs with their predictions
    """
    return {
        run.model.run.name: {
            CHANNELS[c]: {
                name: float(np.sqrt(np.mean((run.model.measured - run.predicted[name])[:, c] ** 2)))
                for name in ("frozen", "after")
            }
            for c in run.channels
        }
        for run in runs
    }


def compute_friction_pulls(trace: Trace) -> dict[str, float]:
    """Return by training run how far its friction is pulled from the surface mapping, in its tolerances [1].

    It is 0 for a run that does not reach its limit of friction.

    Parameters
    ----------
    trace : the verdict and what it stands on
    """
    runs, tolerance = trace.end.evidence.train, trace.end.evidence.tolerances.friction
    return {
        run.model.run.name: float(offsets[FRICTION_OFFSET] / tolerance)
        for run, offsets in zip(runs, trace.end.base.offsets, strict=True)
    }


def find_pulled_runs(pulls: Mapping[str, float]) -> dict[str, float]:
    """Return the runs whose friction is pulled by more than `TOLD_PULL` tolerances, with their pull [1].

    Parameters
    ----------
    pulls : of `compute_friction_pulls`
    """
    return {name: pull for name, pull in pulls.items() if abs(pull) > TOLD_PULL}


def say_friction_pulls(pulled: Mapping[str, float], tolerance: float) -> tuple[str, str]:
    """Return in brief and in full that runs pull their friction.

    Parameters
    ----------
    pulled : of `find_pulled_runs`, at least one
    tolerance : one sigma of a run's friction, relative [1]
    """
    listed = join_phrases(f"{name} by {pull:+.1f}" for name, pull in pulled.items())
    return (
        f"But in {join_phrases(pulled)} the tyres do not grip as the surface mapping says.",
        f"runs at their limit pull friction by more than {TOLD_PULL:g} of its tolerances ({tolerance:.1%} each):"
        f" {listed}; what is named does not explain it, and stops at the limit are predicted no better",
    )
