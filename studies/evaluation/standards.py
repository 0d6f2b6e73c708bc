"""The motion that a dataset's pictures are compared with: the clips' own telemetry, or independent reference traces."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.reference_match import find_case
from catalogs.references import Traces, read_reference
from catalogs.scenario import SCENARIO_FIELDS, Scenario
from studies.evaluation.judged_clip import JudgedClip
from tasks.errors import InputError
from tasks.vehicle.replayed_trace import ENDS_STANDING

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class MeantMotion:
    """The motion that one clip's pictures are compared with, at its frames.

    Parameters
    ----------
    pitch : float64 [F] nose-down positive; NaN where it is not known [rad]
    station : float64 [F] NaN where it is not known [m]
    name : of the reference case; empty for the clip's own telemetry
    end : of what is known [s]; infinity where every frame is
    """

    pitch: Floats
    station: Floats
    name: str = ""
    end: float = np.inf


@dataclass(frozen=True, kw_only=True)
class Standard:
    """Motion that each clip is compared with.

    Parameters
    ----------
    suffix : of the metrics' names
    motions : by clip id; a clip without one is not scored
    absent : why a clip has none, by clip id
    """

    suffix: str
    motions: Mapping[str, MeantMotion]
    absent: Mapping[str, str]


def own_telemetry(clips: Sequence[JudgedClip]) -> Standard:
    """Return the telemetry that the clips were rendered from.

    Parameters
    ----------
    clips : as their judges saw them
    """
    motions = {
        clip.facts["clip_id"]: MeantMotion(pitch=clip.frames["pitch"], station=clip.frames["station"])
        for clip in clips
    }
    return Standard(suffix="", motions=motions, absent={})


@dataclass(frozen=True, kw_only=True)
class ReferenceCases:
    """The reference trace of each clip that has one.

    Parameters
    ----------
    traces : name of the case and its columns, by clip id
    absent : why a clip has none, by clip id
    """

    traces: Mapping[str, tuple[str, Traces]]
    absent: Mapping[str, str]


def find_reference_cases(rows: Sequence[Mapping[str, Any]], folder: Path) -> ReferenceCases:
    """Return the reference case whose conditions each clip has; no picture is needed for it.

    Parameters
    ----------
    rows : of the clip table
    folder : of reference traces

    Raises
    ------
    InputError
        If the folder cannot be read, or has the conditions of no clip.
    """
    reference = read_reference(folder)
    columns = {case.case: columns for case, columns in reference}
    traces, absent = {}, {}
    for row in rows:
        try:
            name = find_case([case for case, _ in reference], _scenario_of(row), row["surface_friction"]).case
        except InputError as error:
            absent[row["clip_id"]] = "; ".join(error.problems)
            continue
        traces[row["clip_id"]] = name, columns[name]
    if not traces:
        raise InputError(
            [f"{folder}: no clip of the dataset has a reference case"]
            + [f"{folder}: clip {row['label']}: {absent[row['clip_id']]}" for row in rows[:3]]
        )
    return ReferenceCases(traces=traces, absent=absent)


def reference_traces(clips: Sequence[JudgedClip], cases: ReferenceCases) -> Standard:
    """Return each clip's reference trace, sampled at the clip's frames and not shifted.

    After the end of a trace its station is held if the car stood by then; its pitch is not, for a car that has just
    stopped rocks back.

    Parameters
    ----------
    clips : as their judges saw them
    cases : of `find_reference_cases`
    """
    motions = {}
    for clip in clips:
        key, times = clip.facts["clip_id"], clip.times
        if key not in cases.traces:
            continue
        case, trace = cases.traces[key]
        time, stands = trace["time"], trace["speed"][-1] <= ENDS_STANDING
        known = (times >= time[0] - 1e-9) & (times <= time[-1] + 1e-9)
        station = np.interp(times, time, trace["station"])
        motions[key] = MeantMotion(
            pitch=np.where(known, np.deg2rad(np.interp(times, time, trace["pitch"])), np.nan),
            station=np.where(known | (stands & (times > time[-1])), station, np.nan),
            name=case,
            end=np.inf if known.all() else float(time[-1]),
        )
    return Standard(suffix="_reference", motions=motions, absent=cases.absent)


def opening_of(clip: JudgedClip, meant: MeantMotion) -> float:
    """Return when the front axle of the meant motion meets the clip's road feature [s]; infinity if it never does.

    Parameters
    ----------
    clip : with a road feature
    meant : motion
    """
    edge = clip.facts["hazard_center_m"] - clip.facts["hazard_length_m"] / 2
    known = np.isfinite(meant.station)
    if not known.any() or meant.station[known][-1] <= edge:
        return np.inf
    return float(np.interp(edge, meant.station[known], clip.times[known]))


def require_whole_way(meant: MeantMotion) -> None:
    """Check that the station of a motion is known at every frame.

    Parameters
    ----------
    meant : motion

    Raises
    ------
    InputError
        If its trace ends while the car rolls.
    """
    if not np.isfinite(meant.station).all():
        raise InputError(
            f"case {meant.name} ends at {meant.end:g} s, before the clip, and its car still rolls"
        )


def _scenario_of(row: Mapping[str, Any]) -> Scenario:
    """The scenario of a clip from its row, in which null and NaN both mean that there is no value."""
    values: dict[str, Any] = {name: row[name] for name in SCENARIO_FIELDS}
    known: dict[str, Any] = {name: None if value != value else value for name, value in values.items()}
    return Scenario(**known)
