"""Sensitivity of a metric to a fault: scores of sound and of desynchronised claims, and how well they separate."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from studies.evaluation.metrics.video_motion import geometry_error, reference_progress
from studies.negative_controls.false_rigs import show_rig
from tasks.errors import InputError
from tasks.eval.body_agreement import BodyClaim, compare_body, rms
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.rigid import Floats, invert_pose

SEES, PARTLY = 0.9, 0.5
"""Least detection rates without a false alarm at which a metric detects a fault, and detects it partly [1]."""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """Telemetry claimed for the frames of a clip.

    Parameters
    ----------
    pitch : [F] nose-down positive [rad]
    station : [F] [m]
    body : the rest of the rig's motion; None where it is not claimed
    shown : [F, 4, 4] rig poses that the pictures are taken to show in place of the claimed ones [m]; None for the true
    """

    pitch: Floats
    station: Floats
    body: BodyClaim | None = None
    shown: Floats | None = None


def delay_claim(claim: Claim, frames: int) -> Claim:
    """Return the claim delayed by whole frames, its first value held.

    Parameters
    ----------
    claim : to delay
    frames : delay [frames]
    """
    rows = np.maximum(np.arange(len(claim.pitch)) - frames, 0)
    return Claim(pitch=claim.pitch[rows], station=claim.station[rows])


def scale_claimed_pitch(claim: Claim, factor: float) -> Claim:
    """Return the claim with its pitch, counted from frame 0, times a factor; -1 flips the sign.

    Parameters
    ----------
    claim : to scale
    factor : [1]
    """
    rest = claim.pitch[0]
    return Claim(pitch=rest + factor * (claim.pitch - rest), station=claim.station)


def shows_another_rig(claim: Claim, least_turn: float, least_move: float) -> bool:
    """Return whether the pictures are taken to show another rig than claimed, by a least turn or move.

    Parameters
    ----------
    claim : with `body`
    least_turn : largest turn that counts as none [rad]
    least_move : the same for a move [m]
    """
    if claim.body is None or claim.shown is None:
        return False
    error = invert_pose(claim.body.T_world_rig) @ claim.shown
    turn = np.abs(error[:, [2, 1], [1, 0]]).max()
    return bool(turn > least_turn or np.abs(error[:, 1:3, 3]).max() > least_move)


def claims_differ(claim: Claim, other: Claim, least_pitch: float, least_way: float) -> bool:
    """Return whether two claims differ by more than a least pitch or a least distance.

    Parameters
    ----------
    claim, other : of one clip
    least_pitch : largest pitch difference that counts as equal [rad]
    least_way : the same for the station [m]
    """
    pitch = (claim.pitch - claim.pitch[0]) - (other.pitch - other.pitch[0])
    way = (claim.station - claim.station[0]) - (other.station - other.station[0])
    return bool(np.abs(pitch).max() > least_pitch or np.abs(way).max() > least_way)


def score_claim(
    recovered: RecoveredMotion,
    claim: Claim,
    response: float,
    times: Floats,
    opening: float | None,
    certain: float = np.inf,
) -> dict[str, float]:
    """Return the misfit of a claim to the recovered motion by every metric that can be formed; larger is worse.

    Parameters
    ----------
    recovered : from the pixels, with a pose in every frame
    claim : to be judged
    response : RMS of claimed pitch below which relative figures are left out [rad]
    times : [F] of the frames [s]
    opening : when the road feature's event window opens; None without a feature [s]
    certain : standard uncertainty of the heave gain above which the misfit of heave is left out [1]

    Returns
    -------
    pitch_rmse [rad], pitch_relative_error, pitch_decorrelation, normalised_progress_rmse, e_geometry [1],
    progress_rmse [m]; with the whole rig also roll_rmse, yaw_rmse [deg], lateral_rmse, rise_rmse [m], heave_misfit [1]
    """
    meant, way = claim.pitch - claim.pitch[0], claim.station - claim.station[0]
    error = rms(recovered.pitch - meant)
    scores = {"pitch_rmse": error}
    if rms(meant) >= response:
        scores["pitch_relative_error"] = error / rms(meant)
        scores["pitch_decorrelation"] = 1.0 - float(np.corrcoef(recovered.pitch, meant)[0, 1])
    if way[-1] > 0 and np.isfinite(recovered.normalised_path).all():
        scores["normalised_progress_rmse"] = rms(
            recovered.normalised_path[:, 0] - reference_progress(claim.station)
        )
    if np.isfinite(recovered.progress).all():
        scores["progress_rmse"] = rms(recovered.progress - way)
    if opening is not None:
        with suppress(InputError):  # a clip that ends too early has no event to judge
            scores["e_geometry"] = geometry_error(times, recovered.pitch, claim.pitch, opening, None)
    if claim.body is not None:
        scores |= _score_body(recovered, claim.body, claim.shown, certain)
    return scores


def _score_body(
    recovered: RecoveredMotion, body: BodyClaim, shown: Floats | None, certain: float
) -> dict[str, float]:
    seen = recovered if shown is None else show_rig(recovered, body, shown)
    errors = compare_body(seen, body)
    scores = {"roll_rmse": errors.roll_rmse_deg, "yaw_rmse": errors.yaw_rmse_deg,
              "lateral_rmse": errors.lateral_rmse_m, "rise_rmse": errors.rise_rmse_m}  # fmt: skip
    if errors.heave_gain_std <= certain:
        scores["heave_misfit"] = abs(errors.heave_gain - 1.0)
    return {name: value for name, value in scores.items() if np.isfinite(value)}


@dataclass(frozen=True, kw_only=True)
class Separation:
    """Separation of faulty from sound clips by a metric.

    Parameters
    ----------
    threshold : smallest with no false alarm on a sound clip; a fault above it is detected [the metric's unit]
    detection_rate : share of faulty clips above it [1]
    auc : area under the ROC, ties by half [1]
    false_alarms, detections : the ROC at every threshold from high to low [1]
    verdict : sees, partly or blind
    """

    threshold: float
    detection_rate: float
    auc: float
    false_alarms: tuple[float, ...]
    detections: tuple[float, ...]
    verdict: str


def compute_separation(sound: Sequence[float], faulty: Sequence[float]) -> Separation:
    """Return threshold, ROC and verdict of one metric on one fault.

    Parameters
    ----------
    sound, faulty : scores, at least one each; larger is worse [any]
    """
    good, bad = np.asarray(sound, float), np.asarray(faulty, float)
    above = (bad[:, None] > good).mean() + 0.5 * (bad[:, None] == good).mean()
    levels = np.unique(np.concatenate([good, bad]))[::-1]
    threshold = float(good.max())
    rate = float((bad > threshold).mean())
    return Separation(
        threshold=threshold,
        detection_rate=rate,
        auc=float(above),
        false_alarms=(0.0, *(float((good >= x).mean()) for x in levels)),
        detections=(0.0, *(float((bad >= x).mean()) for x in levels)),
        verdict="sees" if rate >= SEES else "partly" if rate >= PARTLY else "blind",
    )
