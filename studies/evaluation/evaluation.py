"""Every figure of a dataset judged from its pixels: poses, motion, road edits and weather."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pyarrow as pa

from flows.making.locations import refuse_changed_scene
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_reading
from flows.store.missing import null_missing
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, refuse_changed_content, require_frames
from flows.store.telemetry import write_parquet
from manifests.manifest import list_scenes
from studies.evaluation.dataset_motion import list_motion_panels
from studies.evaluation.judged_clip import JudgedClip, Row, View, judge_clip
from studies.evaluation.learned_judges import load_judges
from studies.evaluation.learned_rows import learned_rows
from studies.evaluation.means import mean_rows
from studies.evaluation.metrics.severity import severity_agreement
from studies.evaluation.motion_rows import EventWindow, motion_rows
from studies.evaluation.page import render_page
from studies.evaluation.road_edit_rows import road_edit_rows
from studies.evaluation.rows import figure_row, group_weather_families
from studies.evaluation.standards import find_reference_cases, own_telemetry, reference_traces
from studies.foreign_video.trajectories import trajectory_files
from studies.physics_judge.audit_physics import clip_facts
from tasks.errors import InputError

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
    reference: str | None = None,
    event_window: EventWindow = "contact",
) -> dict[str, Any]:
    """Judge a finished dataset from its pixels and write every figure with its unit and the paper's value.

    Parameters
    ----------
    dataset : a finished dataset folder
    out : folder for evaluation.json, evaluation.parquet and evaluation.html
    trajectories : folder with METHOD/CLIP_ID.txt in the TUM format, scored beside our own checks
    metric : whether their lengths are metres
    crf : constant rate factor of H.264 that the pictures pass through before they are judged [1]
    reference : folder of independent traces that the motion is judged against as well, beside the clips' telemetry
    event_window : whether that of E_geometry opens as the front axle meets the feature, or at the paper's fixed time
    learned : YAML of local checkpoints of learned judges, as `studies.evaluation.learned_judges` reads it

    Raises
    ------
    InputError
        If the folder is no finished dataset with frames, or what is judged of it or its scene is not as recorded, or a
        trajectory, a checkpoint or a reference cannot be used.
    """
    if event_window not in get_args(EventWindow):
        raise InputError(f"event_window must be {' or '.join(get_args(EventWindow))}; it is {event_window}")
    if metric and trajectories is None:
        raise InputError(
            "--metric speaks of the lengths in --trajectories, and there are none: give their folder too"
        )
    results = Outputs(out, "lab evaluate", "evaluation.json", "evaluation.parquet", "evaluation.html")
    layout = open_for_reading(dataset)
    manifest, root = read_manifest(layout), layout.root
    require_frames(manifest, layout, stored=True)
    refuse_changed_content(layout, manifest, manifest["clips"])
    for scene in list_scenes(manifest):
        refuse_changed_scene(scene)
    judges = load_judges(learned)
    facts = clip_facts(root)
    outside = trajectory_files(Path(trajectories), [row["clip_id"] for row in facts]) if trajectories else {}
    cases = find_reference_cases(facts, Path(reference)) if reference is not None else None
    view = View(root=root, crf=crf)
    clips = [run_as_stage(judge_clip)(view, row, outside.get(row["clip_id"]), metric=metric) for row in facts]
    standards = [own_telemetry(clips)]
    if cases is not None:
        standards.append(reference_traces(clips, cases))
    rows = [row for standard in standards for row in motion_rows(clips, standard, event_window)]
    rows += [*severity_rows(clips), *quality_rows(clips)]
    rows += run_as_stage(road_edit_rows)(view, clips)
    rows += learned_rows(view, clips, judges)
    rows += [figure_row(name, "-", "-", None, "1", note=note) for name, note in NOT_RUN.items()]
    rows += list(mean_rows(rows, clips))
    curves = {
        name: list_motion_panels(clips, standard, event_window)
        for name, standard in zip(("telemetry", "reference"), standards, strict=False)
    }
    codec = "lossless" if crf is None else f"H.264 crf {crf}"
    run_id = manifest["run_id"]
    result = {
        "run_id": run_id, "codec": codec, "clips": len(clips), "rows": rows
    }  # fmt: skip
    results.write_json("evaluation.json", result)
    write_parquet(null_missing(pa.Table.from_pylist(rows, SCHEMA)), results.path("evaluation.parquet"))
    results.write("evaluation.html", render_page(clips, rows, curves, run_id, codec))
    return result


def quality_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """Quality of each clip's pictures without a reference."""
    for clip in clips:
        for name, value in clip.quality.items():
            yield figure_row(name, "no reference", clip.facts["label"], value, "1", note="lower is better")


def severity_rows(clips: list[JudgedClip]) -> Iterator[Row]:
    """Rank agreement of the named image statistics with the rate, within one drive and one kind of weather."""
    for _, condition, levels in group_weather_families(clips):
        rates = {c.facts["clip_id"]: c.facts["precipitation_mm_h"] for c in levels}
        for name in levels[0].statistics:
            values = {c.facts["clip_id"]: c.statistics[name] for c in levels}
            rho, accuracy = severity_agreement(rates, values)
            note = "stand-in for a learned judge"
            yield figure_row("severity_rank_correlation", name, condition, rho, "1", note=note)
            yield figure_row("severity_adjacent_accuracy", name, condition, accuracy, "1", note=note)
