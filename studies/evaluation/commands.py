"""Commands that hold pixels and replays against what the paper prints."""

from typing import Any

from flows.commands.audits import GROUP as AUDITS
from flows.commands.audits import VERIFIED
from flows.commands.command import (
    CAMERA,
    DATASET,
    GRID,
    OUT,
    Command,
    define_argument,
    define_option,
    require_key,
)

GROUP, PAPER = "Evaluation", "The paper"
EVALUATION_COLUMNS = ("metric", "method", "condition", "value", "unit", "paper")


def shorten_evaluation(result: dict[str, Any]) -> dict[str, Any]:
    """Return an evaluation's means over all clips and over the paper's, and what lacks; or a single clip's rows."""
    rows = [row for row in result["rows"] if not row["window"]]
    means = [row for row in rows if row["condition"] == "all" or row["condition"].startswith("paper/")]
    shown = [
        {key: row[key] for key in EVALUATION_COLUMNS} for row in means or rows if row["value"] is not None
    ]
    lacking = {row["metric"]: row["note"] for row in rows if row["condition"] == "-" and row["value"] is None}
    return result | {"rows": shown, "lacking": [f"{metric} ({note})" for metric, note in lacking.items()]}


def leave_out_differences(result: dict[str, Any]) -> dict[str, Any]:
    """Return the result of a replay audit without the figures of every channel."""
    return {key: value for key, value in result.items() if key != "largest_difference"}


def show_table(result: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a judged set with a text in each cell, and what is missing."""
    from studies.video_sets.judge_set import format_cell

    rows = [{key: format_cell(cell) for key, cell in row.items()} for row in result["table"]]
    empty = {key for key in rows[0] if all(row[key] == "-" for row in rows)}
    table = [{key: cell for key, cell in row.items() if key not in empty} for row in rows]
    return {
        "protocol": result["protocol"],
        "window": result["window"],
        "table": table,
        "missing": result["missing"],
    }


COMMANDS = (
    Command(
        name="lab evaluate",
        group=GROUP,
        sentence="Judge a dataset from its pixels: poses, motion, road edits and weather, beside the paper's figures.",
        function="studies.evaluation.evaluation:evaluate_dataset",
        options=(
            DATASET,
            define_option("out", str, "Folder for evaluation.json, .parquet and .html."),
            define_option(
                "trajectories",
                str | None,
                "Folder of camera trajectories to judge as well: METHOD/CLIP_ID.txt in the TUM format.",
                None,
            ),
            define_option(
                "metric",
                bool,
                "Take the lengths in the trajectories as metres; without it, their scale is unknown.",
                False,
            ),
            define_option(
                "learned",
                str | None,
                "YAML file of local checkpoints of learned judges (CLIP, DOVER, FAST-VQA, LPIPS).",
                None,
            ),
            define_option(
                "reference",
                str | None,
                "Folder of independent reference traces (cases.json and Parquet files) to judge the motion against as"
                " well.",
                None,
            ),
            define_option(
                "event_window",
                str,
                "Opening of E_geometry's window: contact, as the front axle meets the feature, or paper, at 2.2 s.",
                "contact",
                known=("contact", "paper"),
            ),
            define_option(
                "crf",
                int | None,
                "Encode with H.264 at this constant rate factor first, and judge the decoded frames.",
                None,
                minimum=0,
                maximum=51,
            ),
        ),
        brief=shorten_evaluation,
    ),
    Command(
        name="lab judge",
        group=GROUP,
        sentence="Judge the motion of any video against the telemetry claimed for it, from pixels and intrinsics"
        " alone.",
        function="studies.foreign_video.judge:judge_video",
        options=(
            define_argument("video", str, "Any video file, or a trajectory (TUM format, .txt or .tum)."),
            define_option(
                "claim",
                str,
                "Parquet file of telemetry: t_ns [ns] or time [s], pitch [rad], and station [m] or speed [m/s].",
            ),
            CAMERA,
            define_option(
                "metric",
                bool,
                "Take the lengths in the trajectory as metres; without it, their scale is unknown.",
                False,
            ),
            OUT,
        ),
        passed=require_key("passed"),
    ),
    Command(
        name="lab retention",
        group=GROUP,
        sentence="Measure how much of a road event's pitch a video editor kept (the paper's source-motion retention).",
        function="studies.foreign_video.retention:measure_retention",
        options=(
            define_argument("source", str, "Video given to the editor: the drive over the road feature."),
            define_argument(
                "source_braking", str, "Video given to the editor: the same drive, braking on a flat road."
            ),
            define_argument("edited", str, "What the editor made of the first video."),
            define_argument("edited_braking", str, "What the editor made of the second video."),
            CAMERA,
            define_option(
                "event", tuple[int, int], "First and last frame of the road event, counted from 0.", (16, 42)
            ),
            OUT,
        ),
    ),
    Command(
        name="lab judge-set",
        group=PAPER,
        sentence="Judge the clips of video editors by a protocol: a table of models, the paper's figures beside them.",
        function="studies.video_sets.judge_set:judge_video_set",
        options=(
            define_argument(
                "folder", str, "Folder of models, sources, claims and targets (docs/evidence/evaluation.md)."
            ),
            define_option(
                "protocol",
                str,
                "Protocol: YAML file, or the name of one in studies/video_sets.",
                "paper",
            ),
            define_option("out", str, "Folder for judge-set.json, judge-set.md and motion.svg."),
            define_option(
                "learned",
                str | None,
                "YAML file of local checkpoints of learned judges (CLIP, DOVER, FAST-VQA, LPIPS).",
                None,
            ),
            define_option(
                "window",
                int | None,
                "Smoothing of the table's motion figures [frames]: 0, 5, 7 or 9; by default the protocol's.",
                None,
                minimum=0,
                maximum=9,
            ),
        ),
        brief=show_table,
    ),
    Command(
        name="lab replay-audit",
        group=AUDITS,
        sentence="Prove that visual seeds change the weather in the picture and nothing in the motion.",
        function="studies.paper.replay:replay_audit",
        options=(
            define_argument("grid", str, GRID.help, "severity", known=GRID.known),
            define_option("seeds", int, "Number of visual seeds for each scenario.", 3),
            define_option("frames", int, "Number of frames drawn from each run.", 2),
            OUT,
        ),
        brief=leave_out_differences,
        passed=VERIFIED,
    ),
)
