"""A set of edited videos judged by a protocol: every figure, and one table of models and of what the paper prints."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.sentences import cap_problems
from flows.pages.static import as_svg
from flows.running.orchestration import run_as_stage
from flows.running.progress import progress_bar
from flows.store.outputs import Outputs
from studies.evaluation.judged_clip import Row
from studies.evaluation.learned_judges import load_judges
from studies.evaluation.means import average_within_seeds
from studies.evaluation.metrics.foreign_video import VideoClaim
from studies.evaluation.metrics.video_motion import WINDOWS
from studies.evaluation.motion_curves import draw_motion
from studies.foreign_video.judge import read_claim
from studies.foreign_video.sources import read_camera
from studies.video_sets.files import VideoSet, find_set
from studies.video_sets.motion import JudgedSet, Key, SetMotion, look_at_clip
from studies.video_sets.motion_panels import list_set_panels
from studies.video_sets.picture_rows import PIXELS
from studies.video_sets.protocol import VideoProtocol, load_protocol
from studies.video_sets.rows import set_rows
from tasks.errors import InputError

COLUMNS = (
    "e_weather", "e_geometry_hump", "e_geometry_depression", "motion_retention", "e_path",
    "dover_overall", "clip_rho_rain", "clip_rho_snow", "localised_edit_rate", "temporal_iou", "anchor_error",
    "dover_technical", "dover_aesthetic", "fast_vqa", "clip_adjacent_rain", "clip_adjacent_snow",
    "temporal_lpips_rain", "temporal_lpips_excess_rain", "temporal_lpips_snow", "temporal_lpips_excess_snow",
)  # fmt: skip
"""Figures of the table, in the order of the paper's tables vggt_motion, geometry_visual_consistency and
visual_quality_full_supp."""
MOTION = "motion.svg"
"""The paper's figure of recovered motion, drawn of the set."""
MEASURED, FLOOR, PRINTED = "measured", "floor of a perfect pose", "printed"
POSED = ("e_weather", "e_geometry_hump", "e_geometry_depression", "motion_retention", "e_path")
"""Figures that rest on a pose method; the others are of the pixels alone."""


def judge_video_set(
    folder: str, *, protocol: str = "paper", out: str, learned: str | None = None, window: int | None = None
) -> dict[str, Any]:
    """Judge the clips of every model of a set, and average them as the protocol says.

    Parameters
    ----------
    folder : of the set, as `studies.video_sets.files.find_set` reads it
    protocol : name or file of a video protocol
    out : folder for judge-set.json, judge-set.md and motion.svg
    learned : YAML of local checkpoints of learned judges
    window : smoothing of the table's motion figures; 0 for none, None for the protocol's [frames]

    Raises
    ------
    InputError
        For every file that cannot be read, or that no clip of the protocol has; or for another window.
    """
    results = Outputs(out, "lab judge-set", "judge-set.json", "judge-set.md", MOTION)
    chosen = load_protocol(protocol)
    smoothing = int(chosen.smoothing_window.value) if window is None else window
    known = [width or 0 for width in WINDOWS]
    if smoothing not in known:
        raise InputError(f"--window must be one of {', '.join(map(str, known))} frames; it is {smoothing}")
    judged = _look_at_set(find_set(Path(folder), chosen), chosen, learned)
    rows = list(run_as_stage(list_figures)(judged))
    table = [*measured_table(judged.files, rows, smoothing), *printed_table(chosen)]
    result = {
        "protocol": protocol, "window": smoothing, "models": list(judged.files.models), "table": table,
        "missing": list_missing(judged), "unprinted": list(chosen.unprinted), "rows": rows,
    }  # fmt: skip
    results.write_json("judge-set.json", result)
    panels = list_set_panels(judged, smoothing or None)
    if panels:
        results.write(MOTION, as_svg(draw_motion(panels, "claimed")))
    results.write("judge-set.md", write_markdown(table, smoothing, MOTION if panels else ""))
    return result


def list_figures(judged: JudgedSet) -> list[Row]:
    """Return every figure of a set.

    Parameters
    ----------
    judged : set
    """
    return list(set_rows(judged))


def measured_table(files: VideoSet, rows: Sequence[Row], window: int) -> list[Row]:
    """Return a row for each model and pose method, with mean, deviation over seeds and number of clips of every figure.

    Clips are averaged within a seed, then over seeds; the deviation is the sample's over seeds (paper, Appendix A.5).

    Parameters
    ----------
    files : of the set
    rows : every figure
    window : of the motion figures [frames]
    """
    table: list[Row] = []
    for model in files.models:
        mine = [row for row in rows if row["model"] == model]
        for method in dict.fromkeys(row["method"] for row in mine if row["metric"] in POSED):
            line: Row = {"model": model, "by": MEASURED, "method": method}
            floors: Row = {"model": model, "by": FLOOR, "method": method}
            for metric in COLUMNS:
                by = method if metric in POSED else PIXELS
                found = [
                    row for row in mine
                    if (row["metric"], row["method"]) == (metric, by)
                    and row["window"] in ((window,) if metric.startswith(("e_weather", "e_geometry")) else (0,))
                    and row["value"] is not None
                ]  # fmt: skip
                line[metric] = _average(found, "value")
                floors[metric] = _average([row for row in found if row["floor"] is not None], "floor")
            table += [line, floors]
    return table


def printed_table(protocol: VideoProtocol) -> list[Row]:
    """Return the figures that the source prints, a row a model.

    Parameters
    ----------
    protocol : with its printed figures
    """
    return [
        {"model": model, "by": PRINTED, "method": ""}
        | {
            metric: None
            if metric not in figures
            else {"mean": figures[metric][0], "seed_std": (*figures[metric], None)[1], "clips": None}
            for metric in COLUMNS
        }
        for model, figures in protocol.printed_figures.items()
    ]


def list_missing(judged: JudgedSet) -> list[Row]:
    """Return the protocol's clips that a model and seed has by no method.

    Parameters
    ----------
    judged : set
    """
    held = {(model, seed, clip) for model, seed, clip, _ in judged.motions}
    found = []
    for model in judged.files.models:
        for seed in judged.files.seeds(model):
            lacking = [clip for clip in judged.protocol.clips if (model, seed, clip) not in held]
            if lacking:
                found.append({"model": model, "seed": seed, "clips": lacking})
    return found


def write_markdown(table: Sequence[Row], window: int, figure: str = "") -> str:
    """Return the table as Markdown, a model a row, without columns that nobody has a figure of.

    Parameters
    ----------
    table : rows of `measured_table` and `printed_table`
    window : of the motion figures [frames]
    figure : file of the motion curves, shown below; empty for none
    """
    head = ("model", "by", "method", *(name for name in COLUMNS if any(row[name] for row in table)))
    lines = [head, ["---"] * len(head), *([format_cell(row[name]) for name in head] for row in table)]
    smoothed = f"Motion is smoothed over {window} frames." if window else "Motion is not smoothed."
    shown = (
        f"\n![Recovered motion, mean and deviation over seeds, against the claims]({figure})\n"
        if figure
        else ""
    )
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + f"\n\n{smoothed}\n{shown}"


def format_cell(value: Any) -> str:
    """Return a cell of the table as text: mean and deviation over seeds, a dash where there is none.

    Parameters
    ----------
    value : text, or figure of `measured_table`, or None
    """
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    spread = "" if value["seed_std"] is None else f" ± {value['seed_std']:.4f}"
    return f"{value['mean']:.4f}{spread}"


def _look_at_set(files: VideoSet, protocol: VideoProtocol, learned: str | None) -> JudgedSet:
    camera, judges = read_camera(files.camera), load_judges(learned)
    kinds = tuple(dict.fromkeys(level.weather for level in protocol.weather_levels.values()))
    motions: dict[Key, SetMotion] = {}
    claims: dict[str, VideoClaim] = {}
    problems: list[str] = []
    for name, path in files.claims.items():
        try:
            claims[name] = read_claim(path)
        except InputError as error:
            problems += error.problems
    with progress_bar("clips", len(files.clips)) as advance:
        for clip in files.clips:
            try:
                seen = look_at_clip(clip, camera, judges, kinds)
                motions[clip.model, clip.seed, clip.clip, clip.method] = seen
            except InputError as error:
                problems += [
                    problem if problem.startswith(str(clip.path)) else f"{clip.path}: {problem}"
                    for problem in error.problems
                ]
            advance(f"{clip.model} {clip.clip}")
    if problems:
        raise InputError(cap_problems(problems))
    return JudgedSet(protocol=protocol, files=files, motions=motions, claims=claims, judges=judges)


def _average(rows: Sequence[Mapping[str, Any]], key: str) -> dict[str, Any] | None:
    if not rows:
        return None
    means = average_within_seeds([row[key] for row in rows], [row["seed"] for row in rows])
    return {
        "mean": float(np.mean(means)),
        "seed_std": float(np.std(means, ddof=1)) if len(means) > 1 else None,
        "clips": len(rows),
    }
