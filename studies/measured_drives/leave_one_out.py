"""Leave one complete drive out: calibrate on the others, score its events, average drives equally."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from studies.measured_drives.brake_dive import DiveModel, Prediction, fit_brake_gain, fit_pitch, predict_event
from studies.measured_drives.events import Event
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.parameters import Vehicle

Variant = Literal["pitch_only", "joint"]
VARIANTS: tuple[Variant, ...] = ("pitch_only", "joint")


@dataclass(frozen=True, kw_only=True)
class Score:
    """How near a prediction comes; NaN where there is nothing to compare.

    Parameters
    ----------
    pitch_rmse : [deg]
    pitch_correlation : [1]
    rate_rmse : [deg/s]
    rate_correlation : [1]
    no_dive_rmse : error of predicting that nothing moves, for comparison [deg]
    """

    pitch_rmse: float
    pitch_correlation: float
    rate_rmse: float
    rate_correlation: float
    no_dive_rmse: float


@dataclass(frozen=True, kw_only=True)
class Fold:
    """One drive left out.

    Parameters
    ----------
    variant : calibration signals
    drive : left out
    model : calibrated on the other drives
    trained_on : number of training events
    scores : of each held-out event, in time order
    mean : over the drive's events
    peak_ratio : peak of the mean predicted dive over that of the mean measured dive, q_theta [1]
    time, dive, predicted_dive : mean trajectory of the drive, float64 [N] [s], [deg], [deg]
    """

    variant: Variant
    drive: str
    model: DiveModel
    trained_on: int
    scores: tuple[Score, ...]
    mean: Score
    peak_ratio: float
    time: NDArray[np.float64]
    dive: NDArray[np.float64]
    predicted_dive: NDArray[np.float64]


def leave_one_drive_out(
    events: Sequence[Event], vehicle: Vehicle, surface: SurfaceParameters
) -> tuple[Fold, ...]:
    """Every variant on every drive; empty where fewer than two drives have events.

    Parameters
    ----------
    events : retained, with longitudinal acceleration and pitch; the joint variant needs pitch rate
    vehicle : whose equations are used and from which the calibration starts
    surface : pavement
    """
    drives = list(dict.fromkeys(event.drive for event in events))
    if len(drives) < 2:
        return ()
    variants = VARIANTS if all("pitch_rate" in event.columns for event in events) else VARIANTS[:1]
    folds = []
    for drive in drives:
        training = [event for event in events if event.drive != drive]
        held_out = [event for event in events if event.drive == drive]
        gain = fit_brake_gain(training, vehicle, surface)
        for variant in variants:
            zeta = training[0].protocol.fixed_damping_ratio if variant == "pitch_only" else None
            model = fit_pitch(training, vehicle, gain, damping_ratio=zeta)
            predictions = [predict_event(event, vehicle, model, surface) for event in held_out]
            folds.append(_fold(variant, drive, model, len(training), predictions))
    return tuple(folds)


def macro_mean(folds: Sequence[Fold], variant: Variant) -> Score:
    """Mean of the drives' means, each drive counting once.

    Parameters
    ----------
    folds : of any variant
    variant : the one to average
    """
    return mean_score([fold.mean for fold in folds if fold.variant == variant])


def mean_score(scores: Sequence[Score]) -> Score:
    """Figure by figure; a figure that one of them lacks is NaN."""

    def mean(name: str) -> float:
        return float(np.mean([getattr(score, name) for score in scores])) if scores else nan

    return Score(**{name: mean(name) for name in Score.__dataclass_fields__})


def score_of(prediction: Prediction) -> Score:
    """Errors and correlations of one event.

    Parameters
    ----------
    prediction : measured and predicted
    """
    has_rate = prediction.rate is not None
    rate = prediction.rate if prediction.rate is not None else np.zeros(0)
    return Score(
        pitch_rmse=_rmse(prediction.predicted_dive - prediction.dive),
        pitch_correlation=_correlation(prediction.dive, prediction.predicted_dive),
        rate_rmse=_rmse(prediction.predicted_rate - rate) if has_rate else nan,
        rate_correlation=_correlation(rate, prediction.predicted_rate) if has_rate else nan,
        no_dive_rmse=_rmse(prediction.dive),
    )


def _fold(
    variant: Variant, drive: str, model: DiveModel, trained_on: int, predictions: list[Prediction]
) -> Fold:
    scores = tuple(score_of(prediction) for prediction in predictions)
    # events start on a sample, so their windows hold the same number of samples
    dive = np.mean([prediction.dive for prediction in predictions], axis=0)
    predicted = np.mean([prediction.predicted_dive for prediction in predictions], axis=0)
    return Fold(
        variant=variant, drive=drive, model=model, trained_on=trained_on, scores=scores, mean=mean_score(scores),
        peak_ratio=float(np.max(predicted) / np.max(dive)) if np.max(dive) > 0 else nan,
        time=predictions[0].time, dive=dive, predicted_dive=predicted,
    )  # fmt: skip


def _rmse(error: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    a, b = a - a.mean(), b - b.mean()
    spread = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / spread if spread > 0 else nan
