"""Every figure of a dataset judged from its pixels: poses, motion, road edits and weather."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from catalogs.gates import load_gates
from catalogs.learned_judges import load_judges
from flows.judging.evaluation_means import mean_rows
from flows.judging.evaluation_page import render_page
from flows.judging.evaluation_rows import control_of, figure_row, weather_families
from flows.judging.judged_clip import JudgedClip, Row, View, judge_clip
from flows.judging.learned_rows import learned_rows
from flows.judging.physics import clip_facts
from flows.judging.road_edit_rows import road_edit_rows
from flows.judging.trajectories import trajectory_files
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_reading
from flows.store.layout import Layout
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.telemetry import write_parquet
from tasks.errors import InputError
from tasks.eval.motion_agreement import rms
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.severity import severity_agreement
from tasks.eval.video_motion import (
    WINDOWS,
    geometry_error,
    path_error,
    reference_progress,
    weather_error,
)

NOT_RUN = {
    "motion_retention": "not run: a dataset holds no editor's input and output pair",
}
TEXT = ("metric", "method", "condition", "unit", "note")
SCHEMA = pa.schema(
    [
        *((name, pa.string()) for name in TEXT),
        *((name, pa.float64()) for name in ("value", "paper", "floor", "uncertainty", "seed_std")),
        *((name, pa.int64()) for name in ("window", "averaged")),
    ]
)
"""Columns of the table of figures; an empty column keeps its type."""


def evaluate_dataset(
    dataset: str,
    *,
    out: str,
    trajectories: str | None = None,
    metric: bool = False,
    learned: str | None = None,
    crf: int | None = None,
) -> dict[str, Any]:
    """Judge a finished dataset from its pixels and write every figure with its unit and the paper's value.

    Parameters
    ----------
    dataset : a finished dataset folder
    out : folder for evaluation.json, evaluation.parquet and evaluation.html
    trajectories : folder with METHOD/CLIP_ID.txt in the TUM format, scored beside our own checks
    metric : whether their lengths are metres
    crf : constant rate factor of H.264 that the pictures pass through before they are judged [1]
    learned : YAML of local checkpoints of learned judges, as `catalogs.learned_judges` reads it

    Raises
    ------
    InputError
        If the folder is no finished dataset, or a trajectory or a checkpoint cannot be used.
    """
    results = Outputs(out, "evaluate", "evaluation.json", "evaluation.parquet", "evaluation.html")
    root = open_for_reading(dataset).root
    judges = load_judges(learned)
    facts = clip_facts(root)
    told = trajectory_files(Path(trajectories), [row["clip_id"] for row in facts]) if trajectories else {}
    view = View(root=root, crf=crf)
    clips = [run_as_stage(judge_clip)(view, row, told.get(row["clip_id"]), metric=metric) for row in facts]
    rows = [*pose_rows(clips), *weather_rows(clips), *geometry_rows(clips), *severity_rows(clips)]
    rows += quality_rows(clips)
    rows += run_as_stage(road_edit_rows)(view, clips)
    rows += learned_rows(view, clips, judges)
    rows += [figure_row(name, "-", "-", None, "1", note=note) for name, note in NOT_RUN.items()]
    rows += list(mean_rows(rows, clips))
    codec = "lossless" if crf is None else f"H.264 crf {crf}"
    run_id = read_manifest(Layout(root))["run_id"]
    result = {
        "run_id": run_id, "codec": codec, "clips": len(clips), "rows": rows
    }  # fmt: skip
    results.write_json("evaluation.json", result)
    write_parquet(pa.Table.from_pylist(rows, SCHEMA), results.path("evaluation.parquet"))
    results.write("evaluation.html", render_page(clips, rows, run_id, codec))
    return result


def pose_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """Yield pitch and progress of each clip by each method, with uncertainty; a failure is reported, not scored."""
    responds = load_gates().response_deg
    for clip, method, motion in _list_recovered(clips):
        claimed = clip.frames["pitch"] - clip.frames["pitch"][0]
        way = clip.frames["station"] - clip.frames["station"][0]
        failure = _describe_failure(motion)
        label = clip.facts["label"]
        error = None if failure else float(np.rad2deg(rms(motion.pitch - claimed)))
        yield figure_row("pitch_rmse", method, label, error, "deg", note=failure,
                   uncertainty=float(np.rad2deg(motion.typical_pitch_std)))  # fmt: skip
        if np.rad2deg(rms(claimed)) >= responds:
            share = None if failure else rms(motion.pitch - claimed) / rms(claimed)
            yield figure_row("pitch_relative_error", method, label, share, "1", note=failure)
        if way[-1] > 0:
            drift = None if failure else rms(motion.normalised_path[:, 0] - reference_progress(way))
            yield figure_row("normalised_progress_rmse", method, label, drift, "1", note=failure)
        if np.isfinite(motion.progress).all():
            yield figure_row("progress_rmse", method, label, rms(motion.progress - way), "m")


def weather_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """E_weather and E_path of each clip against the dry one of the same drive, with the perfect pose's floor."""
    for clip, method, motion in _list_recovered(clips):
        control = control_of(clip, clips, weather=True)
        if control is None:
            continue
        other, label = control.motions.get(method), clip.facts["label"]
        if other is None:
            continue
        failure = _describe_failure(motion) or _describe_failure(other)
        station, control_station = clip.frames["station"], control.frames["station"]
        forward = motion.normalised_path, other.normalised_path
        for window in WINDOWS:
            try:
                floor = weather_error(station, control_station, station, control_station, window)
                error = None if failure else weather_error(
                    forward[0][:, 0], forward[1][:, 0], station, control_station, window
                )  # fmt: skip
                note = failure
            except InputError as fault:
                floor, error, note = None, None, str(fault)
            yield figure_row("e_weather", method, label, error, "1", note=note, window=window, floor=floor)
        error = None if failure else path_error(forward[0][:, :2], forward[1][:, :2])
        yield figure_row("e_path", method, label, error, "1", note=failure, floor=0.0)


def geometry_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """E_geometry of each clip with a road feature, at every window beside the perfect pose's floor."""
    for clip, method, motion in _list_recovered(clips):
        height = clip.facts["hazard_height_m"]
        if height == 0:
            continue
        claimed = clip.frames["pitch"]
        opening = np.inf if clip.opening is None else clip.opening
        name = "e_geometry_hump" if height > 0 else "e_geometry_depression"
        failure = _describe_failure(motion)
        for window in WINDOWS:
            try:
                floor = geometry_error(clip.times, claimed, claimed, opening, window)
                error = (
                    None if failure else geometry_error(clip.times, motion.pitch, claimed, opening, window)
                )
                note = failure
            except InputError as fault:
                floor, error, note = None, None, str(fault)
            yield figure_row(
                name, method, clip.facts["label"], error, "1", note=note, window=window, floor=floor
            )


def quality_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """Quality of each clip's pictures without a reference."""
    for clip in clips:
        for name, value in clip.quality.items():
            yield figure_row(name, "no reference", clip.facts["label"], value, "1", note="lower is better")


def severity_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """Rank agreement of the named image statistics with the rate, within one drive and one kind of weather."""
    for _, condition, levels in weather_families(clips):
        rates = {c.facts["clip_id"]: c.facts["precipitation_mm_h"] for c in levels}
        for name in levels[0].statistics:
            values = {c.facts["clip_id"]: c.statistics[name] for c in levels}
            rho, accuracy = severity_agreement(rates, values)
            note = "stand-in for a learned judge"
            yield figure_row("severity_rank_correlation", name, condition, rho, "1", note=note)
            yield figure_row("severity_adjacent_accuracy", name, condition, accuracy, "1", note=note)


def _list_recovered(clips: list[JudgedClip]) -> Iterator[tuple[JudgedClip, str, RecoveredMotion]]:
    for clip in clips:
        for method, motion in clip.motions.items():
            yield clip, method, motion


def _describe_failure(motion: RecoveredMotion) -> str:
    failed = int(motion.failed.sum())
    return f"{failed} of {len(motion.failed)} frames without a pose; {motion.failures[0]}" if failed else ""
