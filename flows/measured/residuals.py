"""Predictions of a verdict's models for each measured run, and the residuals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.verdict import Outcome
from tasks.identification.inference.forward import RunModel, predict_channels
from tasks.identification.joint.fit import lead_offsets
from tasks.identification.joint.stops import predict_stop
from tasks.identification.joint.verdict import JointOutcome
from tasks.vehicle.effects.table import EFFECT_TABLE

MODELS = ("frozen", "retuned", "after")
"""Models of a verdict: the vehicle file's, with its own numbers fitted, and with what was found."""


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


def predict_runs(
    outcome: Outcome | JointOutcome,
) -> tuple[tuple[RunPrediction, ...], tuple[RunPrediction, ...]]:
    """Return the training runs and the held-out runs with the predictions of the frozen and the grown model.

    Parameters
    ----------
    outcome : the verdict and what it stands on; a joint fit has the re-tuned model too on its held-out runs
    """
    if isinstance(outcome, JointOutcome):
        return _predict_stops(outcome)
    evidence = outcome.finding.evidence
    channels = tuple(np.flatnonzero(np.isfinite(evidence.sensors[1])).tolist())
    train, held_out = (
        tuple(
            RunPrediction(
                model=run,
                channels=channels,
                predicted={"frozen": predict_channels(run, np.zeros(len(EFFECT_TABLE))), "after": after},
            )
            for run, after in zip(runs, outcome.predict_readings(runs), strict=True)
        )
        for runs in ([run.model for run in evidence.train], evidence.held_out)
    )
    return train, held_out


def _predict_stops(outcome: JointOutcome) -> tuple[tuple[RunPrediction, ...], tuple[RunPrediction, ...]]:
    fitted = outcome.fitted
    train = tuple(
        RunPrediction(
            model=stop.model,
            channels=tuple(stop.channels.tolist()),
            predicted={
                "frozen": predict_stop(stop, {}, lead_offsets(stop, {}, fitted.scales)),
                "after": predict_stop(stop, fitted.by_name, offsets),
            },
        )
        for stop, offsets in zip(outcome.train, fitted.offsets, strict=True)
    )
    held_out = tuple(
        RunPrediction(
            model=stop.model,
            channels=tuple(stop.channels.tolist()),
            predicted=dict(zip(MODELS, predicted, strict=True)),
        )
        for stop, predicted in zip(outcome.held_out, outcome.predicted, strict=True)
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
                name: float(np.sqrt(run.model.compute_square_error(run.predicted[name])[c]))
                for name in ("frozen", "after")
            }
            for c in run.channels
        }
        for run in runs
    }
