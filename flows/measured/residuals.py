"""Predictions of a verdict's models for each measured run, and the residuals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.verdict import Outcome
from tasks.identification.inference.forward import RunModel, predict_channels
from tasks.vehicle.effects.table import EFFECT_TABLE


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


def predict_runs(outcome: Outcome) -> tuple[tuple[RunPrediction, ...], tuple[RunPrediction, ...]]:
    """Return the training runs and the held-out runs with the predictions of the frozen and the grown model.

    Parameters
    ----------
    outcome : the verdict and what it stands on
    """
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
