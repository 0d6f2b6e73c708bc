"""Commands that judge pixels."""

from typing import Any

from flows.commands.command import (
    CAMERA,
    DATASET,
    OUT,
    VEHICLE,
    Command,
    define_argument,
    define_option,
    require_key,
)

GROUP = "Evaluation"
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


COMMANDS = (
    Command(
        name="lab aeb",
        group=GROUP,
        sentence="Emergency brakes against UN R152 and Euro NCAP in every weather: the speed of the impact.",
        function="flows.driving.aeb:compare_brakes",
        options=(
            define_option("vehicle", str, VEHICLE.help, "bmw-320i", known=VEHICLE.known),
            define_option(
                "protocol",
                list[str] | None,
                "Protocol of catalogs/emergency_braking.yaml, or an OpenSCENARIO file; by default each.",
                None,
            ),
            define_option("weather", list[str] | None, "Weather of that file; by default each.", None),
            define_option(
                "brake",
                list[str] | None,
                "blind, friction or driver; by default each.",
                None,
                known=("blind", "friction", "driver"),
            ),
            define_option(
                "policy",
                str | None,
                "module:function of a brake of your own, as of musync drive, beside these.",
                None,
            ),
            define_option("bounds", bool, "Drive each approach under the bounds of the surface too.", True),
            OUT,
        ),
        brief=lambda result: {"summary": result["summary"]},
    ),
    Command(
        name="lab evaluate",
        group=GROUP,
        sentence="Judge a dataset from its pixels: poses, motion, road edits and weather, beside the paper's figures.",
        function="flows.judging.evaluation:evaluate_dataset",
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
        function="flows.judging.foreign:judge_video",
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
        function="flows.judging.foreign:measure_retention",
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
)
