"""Figures of the motion recovered from a dataset's pictures, against a standard: own telemetry or reference traces."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Literal

import numpy as np

from catalogs.entries import load
from studies.evaluation.judged_clip import JudgedClip, Row
from studies.evaluation.metrics.video_motion import (
    PAPER_OPENING,
    geometry_error,
    path_error,
    reference_progress,
    weather_error,
)
from studies.evaluation.rows import Scored, figure_row, find_control, windowed_rows
from studies.evaluation.standards import Floats, MeantMotion, Standard, opening_of, require_whole_way
from tasks.eval.body_agreement import rms
from tasks.eval.poses.motion import LEAST_PROGRESS, RecoveredMotion

EventWindow = Literal["contact", "paper"]
"""When the event window opens: as the front axle meets the feature, or 2.2 s into the clip, as the paper's does."""
TELEMETRY = "telemetry"
"""Method whose motion is the clip's own telemetry, not recovered: what a perfect recovery would score."""

Judged = tuple[JudgedClip, str, RecoveredMotion, MeantMotion]


def motion_rows(
    clips: Sequence[JudgedClip], standard: Standard, event_window: EventWindow = "contact"
) -> Iterator[Row]:
    """Yield every figure of the clips' motion against a standard; a clip without one gets a row that says why.

    Parameters
    ----------
    clips : as their judges saw them
    standard : what their motion is compared with
    event_window : of E_geometry
    """
    yield from pose_rows(clips, standard)
    yield from weather_rows(clips, standard)
    yield from geometry_rows(clips, standard, event_window)
    for clip in clips:
        if (why := standard.absent.get(clip.facts["clip_id"])) is not None:
            yield figure_row(f"case{standard.suffix}", "-", clip.facts["label"], None, "1", note=why)


def pose_rows(clips: Sequence[JudgedClip], standard: Standard) -> Iterator[Row]:
    """Yield pitch and progress of each clip by each method, with uncertainty; a failure is reported, not scored."""
    responds = load("gate file").response_deg
    for clip, method, motion, meant in _list_judged(clips, standard):
        known = np.isfinite(meant.pitch)
        if not known[0]:
            continue
        claimed = (meant.pitch - meant.pitch[0])[known]
        way = meant.station - meant.station[0]
        failure = _describe_failure(motion)
        note = failure or _describe_case(meant, ends=True)
        label = clip.facts["label"]
        error = None if failure else float(np.rad2deg(rms(motion.pitch[known] - claimed)))
        yield figure_row(f"pitch_rmse{standard.suffix}", method, label, error, "deg", note=note,
                   uncertainty=float(np.rad2deg(motion.typical_pitch_std)))  # fmt: skip
        if np.rad2deg(rms(claimed)) >= responds:
            share = None if failure else rms(motion.pitch[known] - claimed) / rms(claimed)
            yield figure_row(f"pitch_relative_error{standard.suffix}", method, label, share, "1", note=note)
        if way[-1] > 0:
            drift = None if failure else rms(motion.normalised_path[:, 0] - reference_progress(way))
            yield figure_row(
                f"normalised_progress_rmse{standard.suffix}", method, label, drift, "1",
                note=failure or _describe_case(meant),
            )  # fmt: skip
        if np.isfinite(motion.progress).all() and np.isfinite(way).all():
            yield figure_row(
                f"progress_rmse{standard.suffix}", method, label, rms(motion.progress - way), "m",
                note=_describe_case(meant),
            )  # fmt: skip


def weather_rows(clips: Sequence[JudgedClip], standard: Standard) -> Iterator[Row]:
    """E_weather and E_path of each clip against the dry one of the same drive, with the perfect pose's floor.

    Against reference traces E_path has no dry clip: the route itself, on which the reference drives, stands for it.
    """
    for clip, method, motion, meant in _list_judged(clips, standard):
        control = find_control(clip, list(clips), weather=True)
        dry = None if control is None else standard.motions.get(control.facts["clip_id"])
        if control is None or dry is None:
            continue
        other = motion_of(control, method)
        if other is None:
            continue
        label = clip.facts["label"]
        failure = _describe_failure(motion) or _describe_failure(other)
        forward = motion.normalised_path, other.normalised_path
        seen = None if failure else (forward[0][:, 0], forward[1][:, 0])
        change = partial(_score_change, meant, dry, seen)
        note = failure or _describe_case(meant)
        yield from windowed_rows(f"e_weather{standard.suffix}", method, label, change, note)
        route = np.column_stack([forward[0][:, 0], np.zeros(len(meant.station))])
        against = route if standard.suffix else forward[1][:, :2]
        error = None if failure else path_error(forward[0][:, :2], against)
        note = failure or ("against the route: a trace holds no lateral motion" if standard.suffix else "")
        yield figure_row(f"e_path{standard.suffix}", method, label, error, "1", note=note, floor=0.0)


def geometry_rows(
    clips: Sequence[JudgedClip], standard: Standard, event_window: EventWindow = "contact"
) -> Iterator[Row]:
    """E_geometry of each clip with a road feature, at every smoothing window beside the perfect pose's floor."""
    for clip, method, motion, meant in _list_judged(clips, standard):
        height = clip.facts["hazard_height_m"]
        if height == 0:
            continue
        opening = find_opening(clip, meant, event_window)
        name = f"e_geometry_{'hump' if height > 0 else 'depression'}{standard.suffix}"
        failure = _describe_failure(motion)
        seen = None if failure else motion.pitch
        error = partial(_score_pitch, clip.times, meant.pitch, seen, opening)
        note = failure or _describe_case(meant)
        yield from windowed_rows(name, method, clip.facts["label"], error, note)


def find_opening(clip: JudgedClip, meant: MeantMotion, event_window: EventWindow) -> float:
    """Return when the event window of a clip opens [s]; infinity if its car never meets the feature.

    Parameters
    ----------
    clip : with a road feature
    meant : motion
    event_window : of E_geometry
    """
    return PAPER_OPENING if event_window == "paper" else opening_of(clip, meant)


def motion_of(clip: JudgedClip, method: str) -> RecoveredMotion | None:
    """Return the motion of a clip by a method; None if the method has none.

    Parameters
    ----------
    clip : as its judges saw it
    method : of a pose check, or `TELEMETRY`
    """
    if method == TELEMETRY:
        return motion_of_telemetry(clip.frames["pitch"], clip.frames["station"])
    return clip.motions.get(method)


def motion_of_telemetry(pitch: Floats, station: Floats) -> RecoveredMotion:
    """Return telemetry as if a pose check had recovered it without error.

    Parameters
    ----------
    pitch : float64 [F] nose-down positive [rad]
    station : float64 [F] [m]
    """
    count, zero = len(pitch), np.zeros(len(pitch))
    way = station - station[0]
    path = np.stack([way, zero, zero], axis=1)
    return RecoveredMotion(
        method="telemetry",
        T_rig0_rig=np.full((count, 4, 4), np.nan),
        pitch=pitch - pitch[0],
        progress=way,
        lateral=zero,
        heave=np.full(count, np.nan),
        normalised_path=path / way[-1] if way[-1] > LEAST_PROGRESS else np.full_like(path, np.nan),
        pitch_std=np.full(count, np.nan),
        progress_std=np.full(count, np.nan),
        inliers=np.zeros(count, np.int64),
        failed=np.zeros(count, bool),
        failures=(),
    )


def _list_judged(clips: Sequence[JudgedClip], standard: Standard) -> Iterator[Judged]:
    for clip in clips:
        meant = standard.motions.get(clip.facts["clip_id"])
        if meant is None:
            continue
        for method, motion in clip.motions.items():
            yield clip, method, motion, meant
        if standard.suffix and (own := motion_of(clip, TELEMETRY)) is not None:
            yield clip, TELEMETRY, own, meant


def _score_change(
    meant: MeantMotion, dry: MeantMotion, seen: tuple[Floats, Floats] | None, window: int | None
) -> Scored:
    """E_weather of the progress of a clip and its dry control; no value where it was not recovered."""
    require_whole_way(meant)
    require_whole_way(dry)
    stations = meant.station, dry.station
    floor = weather_error(*stations, *stations, window)
    return None if seen is None else weather_error(*seen, *stations, window), floor


def _score_pitch(
    times: Floats, meant: Floats, seen: Floats | None, opening: float, window: int | None
) -> Scored:
    """E_geometry of a clip's pitch; no value where it was not recovered."""
    floor = geometry_error(times, meant, meant, opening, window)
    return None if seen is None else geometry_error(times, seen, meant, opening, window), floor


def _describe_case(meant: MeantMotion, *, ends: bool = False) -> str:
    until = f", to {meant.end:g} s" if ends and np.isfinite(meant.end) else ""
    return f"against {meant.name}{until}" if meant.name else ""


def _describe_failure(motion: RecoveredMotion) -> str:
    failed = int(motion.failed.sum())
    return f"{failed} of {len(motion.failed)} frames without a pose; {motion.failures[0]}" if failed else ""
