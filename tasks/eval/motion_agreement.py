"""Agreement of the motion recovered from the pixels with the motion that the telemetry claims."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PoseThresholds:
    """Thresholds that a clip must keep to pass; None leaves a figure unjudged.

    Parameters
    ----------
    pitch_rmse_deg : largest RMSE of pitch [deg]
    pitch_relative_error : largest RMSE of pitch over the RMS of the claimed pitch; it detects a wrong
        amplitude or a delay that is small in degrees [1]
    pitch_correlation : least correlation of recovered and claimed pitch [1]
    response_deg : RMS of the claimed pitch below which there is too little response to judge the
        two relative figures by [deg]
    progress_rmse_m : largest RMSE of forward progress [m]; for a method that knows the scale
    normalised_progress_rmse : largest RMSE of progress over the clip's whole progress [1]
    failed_share : largest share of frames without a pose [1]
    """

    pitch_rmse_deg: float
    pitch_relative_error: float
    pitch_correlation: float
    response_deg: float
    progress_rmse_m: float | None
    normalised_progress_rmse: float | None
    failed_share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class PoseVerdict:
    """One method's judgement of one clip.

    Parameters
    ----------
    method : name of the pose check
    passed : whether every judged figure keeps its threshold
    pitch_rmse_deg : RMSE of recovered against claimed pitch, both counted from frame 0 [deg]
    pitch_relative_error : the same over the RMS of the claimed pitch [1]; NaN without a response
    pitch_correlation : Pearson's, over the frames with a pose [1]; NaN where either does not vary
    claimed_pitch_rms_deg : RMS of the claimed pitch, counted from frame 0 [deg]
    progress_rmse_m : RMSE of forward progress from frame 0 [m]; NaN where the method knows no scale
    normalised_progress_rmse : RMSE of progress over the whole progress [1]; NaN for a car that stands
    failed_frames : number of frames without a pose [1]
    reasons : one sentence per threshold missed
    """

    method: str
    passed: bool
    pitch_rmse_deg: float
    pitch_relative_error: float
    pitch_correlation: float
    claimed_pitch_rms_deg: float
    progress_rmse_m: float
    normalised_progress_rmse: float
    failed_frames: int
    reasons: tuple[str, ...]


def judge_pose(
    recovered: RecoveredMotion, claimed_pitch: Floats, claimed_station: Floats, thresholds: PoseThresholds
) -> PoseVerdict:
    """Compare recovered motion with the telemetry at the frame times.

    Parameters
    ----------
    recovered : result of a pose check
    claimed_pitch : float64 [F] nose-down positive [rad]
    claimed_station : float64 [F] [m]
    thresholds : thresholds of the verdict

    Raises
    ------
    InputError
        If the telemetry has not one finite value per frame.
    """
    frames = len(recovered.failed)
    problems = [
        f"The claimed {name} must be one finite value for each of the {frames} frames, got shape {values.shape}."
        for name, values in (("pitch", claimed_pitch), ("station", claimed_station))
        if values.shape != (frames,) or not np.isfinite(values).all()
    ]
    if problems:
        raise InputError(problems)
    seen = ~recovered.failed
    claimed = np.rad2deg(claimed_pitch - claimed_pitch[0])[seen]
    pitch = np.rad2deg(recovered.pitch)[seen]
    way = (claimed_station - claimed_station[0])[seen]
    pitch_rmse, response = rms(pitch - claimed), rms(claimed)
    judged = response >= thresholds.response_deg
    relative = pitch_rmse / response if judged else float("nan")
    varies = bool(np.ptp(pitch) > 0 and np.ptp(claimed) > 0)
    correlation = float(np.corrcoef(pitch, claimed)[0, 1]) if varies else float("nan")
    progress_rmse = rms(recovered.progress[seen] - way)
    moved = way[-1] > 0
    normalised = rms(recovered.normalised_path[seen, 0] - way / way[-1]) if moved else float("nan")
    failed = int(recovered.failed.sum())

    reasons = []
    if failed > thresholds.failed_share * frames:
        reasons.append(f"{failed} of {frames} frames have no pose: {recovered.failures[0]}")
    limits: list[tuple[str, float, float | None, str]] = [
        ("pitch RMSE", pitch_rmse, thresholds.pitch_rmse_deg, "deg"),
        ("progress RMSE", progress_rmse, thresholds.progress_rmse_m, "m"),
    ]
    if judged:
        limits.append(("relative pitch error", relative, thresholds.pitch_relative_error, ""))
    if moved:
        limits.append(("normalised progress RMSE", normalised, thresholds.normalised_progress_rmse, ""))
    for name, value, limit, unit in limits:
        # in this form NaN fails
        if limit is not None and not value <= limit:
            reasons.append(f"{name} is {value:.4g} {unit}".rstrip() + f", at most {limit:g} is allowed")
    if judged and not correlation >= thresholds.pitch_correlation:
        reasons.append(
            f"pitch correlation is {correlation:.4g}, at least {thresholds.pitch_correlation:g} is needed"
        )
    return PoseVerdict(
        method=recovered.method,
        passed=not reasons,
        pitch_rmse_deg=pitch_rmse,
        pitch_relative_error=relative,
        pitch_correlation=correlation,
        claimed_pitch_rms_deg=response,
        progress_rmse_m=progress_rmse,
        normalised_progress_rmse=normalised,
        failed_frames=failed,
        reasons=tuple(reasons),
    )


def rms(values: Floats) -> float:
    """Return the root mean square [any]."""
    return float(np.sqrt(np.mean(np.square(values))))
