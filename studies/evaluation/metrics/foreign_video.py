"""Recovered motion of any video, compared with claimed telemetry that has its own clock."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.evaluation.metrics.video_motion import geometry_error
from tasks.errors import InputError
from tasks.eval.motion_agreement import PoseThresholds, judge_pose
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.rigid import Floats

EVENT_PITCH = np.deg2rad(0.3)
"""Least range of the claimed pitch that counts as an event: ten times the error of the chain over a second [rad]."""
EVENT_LEAD = 0.6
"""Time from the opening of the event window to the largest claimed pitch [s]."""

LEAST_SHARED = 5
"""Fewest frames within the claim's time that can be judged [1]."""
FRAMES_PER_ROW = 5
"""Frames of a video for each row of its claim at most [1]: between sparser rows a straight line would be judged."""


@dataclass(frozen=True, kw_only=True)
class VideoClaim:
    """Claimed telemetry on its own clock, which starts when the video starts.

    Parameters
    ----------
    time : [N] rising from 0 [s]
    pitch : [N] nose-down positive [rad]
    station : [N] [m]
    """

    time: Floats
    pitch: Floats
    station: Floats


@dataclass(frozen=True, kw_only=True)
class ClaimAtFrames:
    """A claim at the frames that it covers.

    Parameters
    ----------
    rows : frames of the video within the claim's time [1]
    times : of those [s]
    pitch : at those [rad]
    station : at those [m]
    """

    rows: NDArray[np.int64]
    times: Floats
    pitch: Floats
    station: Floats


def sample_claim(claim: VideoClaim, times: Floats) -> ClaimAtFrames:
    """Return the claim at the video's frames, linear between its rows.

    Parameters
    ----------
    claim : on its own clock
    times : [F] of the frames, from 0 [s]

    Raises
    ------
    InputError
        If too few frames lie within it, or it has too few rows within the video.
    """
    # a frame up to half an interval after the last row takes that row
    slack = 0.5 * float(np.median(np.diff(times)))
    rows = np.flatnonzero(times <= claim.time[-1] + slack)
    if len(rows) < LEAST_SHARED:
        raise InputError(
            f"The claim lasts {claim.time[-1]:.3g} s and covers {len(rows)} of the video's {len(times)} frames;"
            f" at least {LEAST_SHARED} are needed."
        )
    given, needed = int(np.sum(claim.time <= times[-1] + slack)), -(-len(rows) // FRAMES_PER_ROW)
    if given < needed:
        raise InputError(
            f"The claim has {given} rows in the {times[-1]:.3g} s of the video's {len(times)} frames; at least {needed}"
            " are needed: give its time in the unit of its column, or a row for each frame."
        )
    return ClaimAtFrames(
        rows=rows,
        times=times[rows],
        pitch=np.interp(times[rows], claim.time, claim.pitch),
        station=np.interp(times[rows], claim.time, claim.station),
    )


def _event_error(recovered: RecoveredMotion, claim: ClaimAtFrames) -> float | None:
    """E_geometry about the largest claimed pitch, so that drift over a long clip does not hide a short response."""
    swing = np.abs(claim.pitch - np.median(claim.pitch))
    if recovered.failed.any() or swing.max() < EVENT_PITCH:
        return None
    opening = float(claim.times[int(np.argmax(swing))]) - EVENT_LEAD
    try:
        return geometry_error(claim.times, recovered.pitch, claim.pitch, opening, None)
    except InputError:
        return None


def judge_motion(recovered: RecoveredMotion, claim: ClaimAtFrames, limits: PoseThresholds) -> dict[str, Any]:
    """Return figures and verdict; None where a figure cannot be formed.

    Parameters
    ----------
    recovered : from the pixels
    claim : at the same frames
    limits : thresholds of the verdict
    """
    if recovered.failed.all():
        raise InputError("No frame of the video could be placed: it shows too little that can be followed.")
    verdict = judge_pose(recovered, claim.pitch, claim.station, limits)
    figures = {
        "pitch_rmse_deg": verdict.pitch_rmse_deg,
        "pitch_relative_error": verdict.pitch_relative_error,
        "pitch_correlation": verdict.pitch_correlation,
        "claimed_pitch_rms_deg": verdict.claimed_pitch_rms_deg,
        "normalised_progress_rmse": verdict.normalised_progress_rmse,
        "pitch_uncertainty_deg": float(np.rad2deg(recovered.typical_pitch_std)),
    }
    reasons = list(verdict.reasons)
    event = _event_error(recovered, claim)
    if event is not None and not event <= limits.pitch_relative_error:
        reasons.append(
            f"event pitch error is {event:.4g}, at most {limits.pitch_relative_error:g} is allowed"
        )
    figures["event_pitch_error"] = np.nan if event is None else event
    return {
        "passed": not reasons,
        "pitch_judged": event is not None or verdict.claimed_pitch_rms_deg >= limits.response_deg,
        "reasons": reasons,
        "failed_frames": verdict.failed_frames,
        **{name: value if np.isfinite(value) else None for name, value in figures.items()},
    }
