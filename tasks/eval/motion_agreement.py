"""Agreement of the motion recovered from the pixels with the motion that the telemetry claims."""

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.eval.body_agreement import BodyClaim, BodyErrors, compare_body, rms
from tasks.eval.poses.motion import RecoveredMotion

Floats = NDArray[np.float64]

TOO_LITTLE = "not judged: the pictures show too little to follow"
COVERAGE = 2.0
"""Standard uncertainties within which 95 % of Gaussian errors lie [1] (JCGM 100:2008, 6.3.3)."""
SURE = 5.0
"""Standard uncertainties beyond a limit from which on an error is another motion, however little is seen [1]."""


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
    roll_rmse_deg, yaw_rmse_deg : largest RMSE of roll and yaw [deg]
    lateral_rmse_m, rise_rmse_m : largest RMSE of the rig's place to the side and upward [m]
    heave_gain_error : largest difference of the heave gain from 1 [1]
    heave_gain_std : standard uncertainty of that gain above which there is too little heave to judge it by [1]
    halved_from_px : height of pictures from which on a clip is judged by pictures of half the size [px]
    """

    pitch_rmse_deg: float
    pitch_relative_error: float
    pitch_correlation: float
    response_deg: float
    progress_rmse_m: float | None
    normalised_progress_rmse: float | None
    failed_share: float = 0.0
    roll_rmse_deg: float | None = None
    yaw_rmse_deg: float | None = None
    lateral_rmse_m: float | None = None
    rise_rmse_m: float | None = None
    heave_gain_error: float | None = None
    heave_gain_std: float | None = None
    halved_from_px: float = float("inf")


@dataclass(frozen=True, kw_only=True)
class PoseVerdict:
    """One method's judgement of one clip.

    Parameters
    ----------
    method : name of the pose check
    passed : whether every judged figure keeps its threshold; None where one does not, and the check sees too little to
        say that it should
    pitch_rmse_deg : RMSE of recovered against claimed pitch, both counted from frame 0 [deg]
    pitch_relative_error : the same over the RMS of the claimed pitch [1]; NaN without a response
    pitch_correlation : Pearson's, over the frames with a pose [1]; NaN where either does not vary
    claimed_pitch_rms_deg : RMS of the claimed pitch, counted from frame 0 [deg]
    progress_rmse_m : RMSE of forward progress from frame 0 [m]; NaN where the method knows no scale
    normalised_progress_rmse : RMSE of progress over the whole progress [1]; NaN for a car that stands
    failed_frames : number of frames without a pose [1]
    judged_frames : number of frames after the first with a pose; without any, every figure is NaN [1]
    roll_rmse_deg, yaw_rmse_deg, lateral_rmse_m, rise_rmse_m, heave_gain, heave_gain_std : as in `BodyErrors`; NaN where
        the claim says nothing of them
    reasons : one sentence per threshold missed, after those that say why the clip is not judged
    """

    method: str
    passed: bool | None
    pitch_rmse_deg: float = nan
    pitch_relative_error: float = nan
    pitch_correlation: float = nan
    claimed_pitch_rms_deg: float = nan
    progress_rmse_m: float = nan
    normalised_progress_rmse: float = nan
    failed_frames: int
    judged_frames: int
    roll_rmse_deg: float = nan
    yaw_rmse_deg: float = nan
    lateral_rmse_m: float = nan
    rise_rmse_m: float = nan
    heave_gain: float = nan
    heave_gain_std: float = nan
    reasons: tuple[str, ...]


def judge_pose(
    recovered: RecoveredMotion,
    claimed_pitch: Floats,
    claimed_station: Floats,
    thresholds: PoseThresholds,
    body: BodyClaim | None = None,
) -> PoseVerdict:
    """Compare recovered motion with the telemetry at the frame times.

    Parameters
    ----------
    recovered : result of a pose check
    claimed_pitch : float64 [F] nose-down positive [rad]
    claimed_station : float64 [F] [m]
    thresholds : thresholds of the verdict
    body : the rest of the rig's motion; None where the claim says nothing of it

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
    failed, judged_frames = int(recovered.failed.sum()), int(seen[1:].sum())
    reasons = []
    if failed > thresholds.failed_share * frames:
        reasons.append(f"{failed} of {frames} frames have no pose: {recovered.failures[0]}")
    if judged_frames == 0:
        reasons.append("no frame after the first has a pose")
        blindness = [TOO_LITTLE] if recovered.blind else []
        return PoseVerdict(
            method=recovered.method, passed=None if blindness else False, failed_frames=failed, judged_frames=0,
            reasons=(*blindness, *reasons),
        )  # fmt: skip
    claimed = np.rad2deg(claimed_pitch - claimed_pitch[0])[seen]
    pitch = np.rad2deg(recovered.pitch)[seen]
    way = (claimed_station - claimed_station[0])[seen]
    pitch_rmse, response = rms(pitch - claimed), rms(claimed)
    judged = response >= thresholds.response_deg
    relative = pitch_rmse / response if judged else nan
    varies = bool(np.ptp(pitch) > 0 and np.ptp(claimed) > 0)
    correlation = float(np.corrcoef(pitch, claimed)[0, 1]) if varies else nan
    progress_rmse = rms(recovered.progress[seen] - way)
    moved = way[-1] > 0
    normalised = rms(recovered.normalised_path[seen, 0] - way / way[-1]) if moved else nan
    errors = BodyErrors() if body is None else compare_body(recovered, body)

    limits: list[tuple[str, float, float | None, str]] = [
        ("pitch RMSE", pitch_rmse, thresholds.pitch_rmse_deg, "deg"),
        ("progress RMSE", progress_rmse, thresholds.progress_rmse_m, "m"),
    ]
    if judged:
        limits.append(("relative pitch error", relative, thresholds.pitch_relative_error, ""))
    if moved:
        limits.append(("normalised progress RMSE", normalised, thresholds.normalised_progress_rmse, ""))
    if body is not None:
        limits += _list_body_limits(errors, thresholds)
    for name, value, limit, unit in limits:
        # in this form NaN fails
        if limit is not None and not value <= limit:
            reasons.append(f"{name} is {value:.4g} {unit}".rstrip() + f", at most {limit:g} is allowed")
    if judged and not correlation >= thresholds.pitch_correlation:
        reasons.append(
            f"pitch correlation is {correlation:.4g}, at least {thresholds.pitch_correlation:g} is needed"
        )
    blindness = _find_blindness(recovered, thresholds, pitch_rmse, progress_rmse, errors) if reasons else []
    return PoseVerdict(
        method=recovered.method,
        passed=None if blindness else not reasons,
        pitch_rmse_deg=pitch_rmse,
        pitch_relative_error=relative,
        pitch_correlation=correlation,
        claimed_pitch_rms_deg=response,
        progress_rmse_m=progress_rmse,
        normalised_progress_rmse=normalised,
        failed_frames=failed,
        judged_frames=judged_frames,
        **vars(errors),
        reasons=(*blindness, *reasons),
    )


def _find_blindness(
    recovered: RecoveredMotion,
    thresholds: PoseThresholds,
    pitch_rmse: float,
    progress_rmse: float,
    errors: BodyErrors,
) -> list[str]:
    """Return a sentence for each figure that the check sees less well than its limit needs.

    There is none where an error exceeds its limit by more than such a sight explains: then the motion is another.
    Roll and yaw are seen about as well as pitch, the rig's place about as well as progress. As the figures are RMS over
    the frames, so are their uncertainties.
    """
    seen = ~recovered.failed
    turn_std = rms(np.rad2deg(recovered.pitch_std[seen]))
    way_std = rms(recovered.progress_std[seen])
    figures = [
        ("pitch", pitch_rmse, turn_std, thresholds.pitch_rmse_deg, "deg"),
        ("progress", progress_rmse, way_std, thresholds.progress_rmse_m, "m"),
    ]
    rig = [
        (errors.roll_rmse_deg, turn_std, thresholds.roll_rmse_deg),
        (errors.yaw_rmse_deg, turn_std, thresholds.yaw_rmse_deg),
        (errors.lateral_rmse_m, way_std, thresholds.lateral_rmse_m),
        (errors.rise_rmse_m, way_std, thresholds.rise_rmse_m),
    ]
    missed = [(error, std, limit) for _, error, std, limit, _ in figures] + rig
    if any(limit is not None and error > limit + SURE * std for error, std, limit in missed):
        return []
    return ([TOO_LITTLE] if recovered.blind else []) + [
        f"not judged: {name} is known to {std:.2g} {unit}, and its limit of {limit:.2g} {unit} needs"
        f" {limit / COVERAGE:.2g}"
        for name, _, std, limit, unit in figures
        if limit is not None and COVERAGE * std > limit
    ]


def _list_body_limits(
    errors: BodyErrors, thresholds: PoseThresholds
) -> list[tuple[str, float, float | None, str]]:
    """Name, value, limit and unit of each figure of the rig; of the heave only where it is certain enough."""
    limits = [
        ("roll RMSE", errors.roll_rmse_deg, thresholds.roll_rmse_deg, "deg"),
        ("yaw RMSE", errors.yaw_rmse_deg, thresholds.yaw_rmse_deg, "deg"),
        ("lateral RMSE", errors.lateral_rmse_m, thresholds.lateral_rmse_m, "m"),
        ("RMSE of the rise", errors.rise_rmse_m, thresholds.rise_rmse_m, "m"),
    ]
    if thresholds.heave_gain_std is not None and errors.heave_gain_std <= thresholds.heave_gain_std:
        gain = f"recovered heave is {errors.heave_gain:.3g} of the claimed, and their difference"
        limits.append((gain, abs(errors.heave_gain - 1), thresholds.heave_gain_error, ""))
    return limits
