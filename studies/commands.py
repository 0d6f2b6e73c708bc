"""Commands of the laboratory, which ``musync lab`` runs beside those of the house."""

from collections import Counter

from flows.commands.audits import GROUP as AUDITS
from flows.commands.audits import VERIFIED
from flows.commands.command import (
    CAMPAIGN_VEHICLE,
    DATASET,
    OUT,
    VEHICLE,
    Command,
    Result,
    define_argument,
    define_option,
    require_key,
    select_keys,
)
from flows.commands.measured import MODE
from studies.evaluation import commands as evaluation

EVALUATION = "Evaluation"
MEASURED, KNOWN, PAPER = "Drives of real cars", "Known truths and faults", "The paper"
ORIGINS, SPEED = "Where numbers come from", "Speed"
WIDE_COLUMNS = {
    "criterion",
    "fails_only_here",
    "mean_trajectory",
    "trained_on",
    "rate_correlation",
    "no_dive_rmse",
}
LAW_COLUMNS = ("label", "passed", "laws", "column", "tightest", "not_judged")
BUMP_FIGURES = ("rate_rmse", "rate_rms", "rate_correlation", "vertical_correlation", "peak_pitch")


def shorten_brake_protocol(result: Result) -> Result:
    """Return a brake protocol without its events and the widest columns of its tables."""
    brief = {key: value for key, value in result.items() if key != "events"}
    for table in ("attrition", "folds"):
        brief[table] = [{k: v for k, v in row.items() if k not in WIDE_COLUMNS} for row in result[table]]
    return brief


def shorten_stop_study(result: Result) -> Result:
    """Return a stop study with the held-out figures of each step."""
    return result | {"rungs": [{"rung": row["rung"], **row["held_out"]} for row in result["rungs"]]}


def shorten_bump_study(result: Result) -> Result:
    """Return a bump study with a row for each window and car."""
    rows = [
        {
            "window": row["window"],
            "car": car,
            **row[car]["feature"],
            **{name: row[car][name] for name in BUMP_FIGURES},
        }
        for row in result["windows"]
        for car in ("uncalibrated", "calibrated")
    ]
    return result | {"windows": rows}


def shorten_controls(result: Result) -> Result:
    """Return of each negative control which metrics see it, and by how many methods; or why it was not tried."""
    controls = []
    for row in result["controls"]:
        methods = Counter(reading.split(" by ")[0] for reading in row["seen_by"])
        seen = ", ".join(f"{metric} ({count})" for metric, count in methods.items())
        controls.append(
            {"control": row["control"], "seen by metric (methods)": seen or row["reason"] or "none"}
        )
    return {key: result[key] for key in ("all_detected", "undetected")} | {"controls": controls}


def shorten_law_rows(result: Result) -> Result:
    """Return the result of a physics audit with the main columns of each clip."""
    return result | {"clips": [{key: row[key] for key in LAW_COLUMNS} for row in result["clips"]]}


COMMANDS = (
    Command(
        name="lab audit-physics",
        group=AUDITS,
        sentence="Compute every telemetry column and pose again; name law, tick, size and column of each break.",
        function="studies.physics_judge.audit_physics:audit_physics",
        options=(DATASET, OUT),
        brief=shorten_law_rows,
        passed=VERIFIED,
    ),
    Command(
        name="lab brake-protocol",
        group=MEASURED,
        sentence="Select braking events by the paper's rules and predict each drive from the others (Appendix C.5).",
        function="studies.measured_drives.brake_protocol:brake_protocol",
        options=(
            define_argument("campaign", str, "Campaign folder with brake pressure and pitch."),
            define_option(
                "protocol",
                str,
                "Protocol: YAML file, or the name of one in studies/measured_drives.",
                "brake-dive",
            ),
            CAMPAIGN_VEHICLE,
            define_option("all_events", bool, "Use every candidate event, whatever rules it breaks.", False),
            OUT,
        ),
        brief=shorten_brake_protocol,
    ),
    Command(
        name="lab stop-study",
        group=MEASURED,
        sentence="Calibrate on one stop of a car, predict another, and add what the model lacks step by step.",
        function="studies.measured_drives.stop_study:stop_study",
        options=(
            define_argument("campaign", str, "Campaign folder with brake and engine torque."),
            define_option(
                "study",
                str,
                "Stop study: YAML file, or the name of one in studies/measured_drives.",
                "bmw-m8",
            ),
            CAMPAIGN_VEHICLE,
            OUT,
        ),
        brief=shorten_stop_study,
    ),
    Command(
        name="lab bump-study",
        group=MEASURED,
        sentence="Find the road features in a recording's pitch rate, and fit the car that drove over them.",
        function="studies.measured_drives.bump_study:bump_study",
        options=(
            define_argument("campaign", str, "Campaign folder with pitch rate and speed."),
            define_option(
                "study",
                str,
                "Bump study: YAML file, or the name of one in studies/measured_drives.",
                "comma2k19",
            ),
            CAMPAIGN_VEHICLE,
            OUT,
        ),
        brief=shorten_bump_study,
    ),
    Command(
        name="lab synthetic-drives",
        group=MEASURED,
        sentence="Write drives as a car's bus logs them, with known truth, to try the brake protocol on.",
        function="studies.measured_drives.synthetic_drives:synthetic_drives",
        options=(
            define_option("out", str, "Folder for one bus log of each drive."),
            define_option("drives", int, "Number of drives.", 3),
            define_option("events", int, "Number of brake applications in each drive.", 46),
            define_option("seed", int, "Seed of the random numbers.", 2020),
        ),
    ),
    Command(
        name="lab close-loop-benchmark",
        group=KNOWN,
        sentence="Count how often close-loop is right on campaigns whose truth is known.",
        function="studies.closing_benchmark.benchmark:close_loop_benchmark",
        options=(
            define_option(
                "out",
                str,
                "Folder for closing-benchmark.json and campaigns.jsonl; a later call continues there.",
            ),
            define_option("seeds", int, "Number of campaigns for each known truth.", 10, minimum=0),
            define_option("first_seed", int, "Of each truth; rules rest on some of 0 to 4.", 0, minimum=0),
            define_option("nulls", int, "Number of campaigns without any effect.", 100, minimum=0),
            define_option(
                "harder",
                int,
                "Number of campaigns for each pair of effects, and for each truth driven with few kinds of manoeuvre.",
                1,
                minimum=0,
            ),
            define_option(
                "minutes", float, "Begin no campaign after this time [min].", 1e9, shown_default="no limit"
            ),
        ),
        brief=select_keys("false_discoveries", "summary", "power", "cpu_s"),
        one_thread=True,
    ),
    Command(
        name="lab controls",
        group=KNOWN,
        sentence="Falsify a dataset's claims and motions in fourteen ways, and say which metric detects which fault.",
        function="studies.negative_controls.study:run_controls",
        options=(DATASET, OUT),
        brief=shorten_controls,
        passed=require_key("all_detected"),
    ),
    Command(
        name="lab sensitivity",
        group=PAPER,
        sentence="Reproduce the paper's bounded surface-parameter study (Appendix E) beside its printed figures.",
        function="studies.paper.sensitivity:run_sensitivity",
        options=(OUT,),
        brief=select_keys("solver_cases", "cpu_s", "beside_print"),
        passed=lambda result: all(row["agrees"] for row in result["beside_print"]),
    ),
    Command(
        name="lab ablation",
        group=PAPER,
        sentence="Cut one coupling at a time (the paper's Section 4.4): stops over the weather, pitch at a hump.",
        function="studies.paper.ablation:run_ablation",
        options=(
            define_option("out", str, "Folder for ablation.json, .parquet, .svg and .html."),
            define_option("vehicle", str, VEHICLE.help, "paper-reference", known=VEHICLE.known),
            MODE,
            define_option(
                "traces",
                str | None,
                "Folder of reference traces, whose pitch is drawn beside the model's.",
                None,
            ),
        ),
        brief=select_keys("pitch", "reference"),
    ),
    Command(
        name="lab bench",
        group=SPEED,
        is_flow=False,
        sentence="Measure speed and memory, beside another implementation in the same run.",
        function="benchmarks.run:run_benchmarks",
        options=(define_argument("name", str | None, "Benchmark to run; by default all.", None), OUT),
    ),
    Command(
        name="lab real-photos",
        group=KNOWN,
        sentence="Train a small network with frames and ask it about your photographs of dry, wet and snowy roads.",
        function="studies.real_photos.study:compare_with_photographs",
        options=(
            define_argument("photos", str, "Folder with the subfolders dry, wet and snow of photographs."),
            define_argument("dataset", list[str], "Datasets with frames, in several weathers."),
            define_option("out", str, "Folder for real_photos.json and real_photos.html."),
            define_option(
                "folder", list[str] | None, "CLASS=NAME: subfolder of a class with another name.", None
            ),
            define_option("seeds", int, "Networks of each kind of training.", 3, minimum=1),
            define_option("frames", int, "Frames of each clip, at most.", 21, minimum=1),
        ),
        brief=select_keys("rows", "page"),
    ),
    Command(
        name="lab lineage",
        group=ORIGINS,
        sentence="List the catalogue lines, works and measured runs that the numbers of a clip rest on, by column.",
        function="studies.lineage.trace:trace_lineage",
        options=(
            DATASET,
            define_argument("clip", str, "Label or id of a clip."),
            define_option("out", str | None, "Folder for lineage.json, lineage.csv and lineage.txt.", None),
        ),
        passed=require_key("follows"),
        output="sentences",
    ),
    Command(
        name="lab sheets",
        group=PAPER,
        sentence="Draw one place in every weather, and each road feature before, at and after the wheels touch it.",
        function="studies.paper.sheets:draw_sheets",
        options=(
            DATASET,
            define_option("out", str, "Folder for weather.png and hazards.png."),
            define_option(
                "station",
                float | None,
                "Station on the route where the weathers are shown [m].",
                None,
                shown_default="12, or as far as every clip comes",
            ),
            define_option(
                "beside",
                list[str] | None,
                "Finished dataset of another street, whose weathers come below; repeat it for more.",
                None,
            ),
        ),
    ),
    Command(
        name="lab aeb",
        group=EVALUATION,
        sentence="Emergency brakes against UN R152 and Euro NCAP in every weather: the speed of the impact.",
        function="studies.emergency_braking.compare:compare_brakes",
        options=(
            define_option("vehicle", str, VEHICLE.help, "bmw-320i", known=VEHICLE.known),
            define_option(
                "protocol",
                list[str] | None,
                "Protocol of emergency_braking.yaml, or an OpenSCENARIO file; by default each.",
                None,
            ),
            define_option("weather", list[str] | None, "Weather of that file; by default each.", None),
            define_option(
                "brake",
                list[str] | None,
                "blind, friction, driver or picture; by default each but picture.",
                None,
                known=("blind", "friction", "driver", "picture"),
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
    *evaluation.COMMANDS,
)
