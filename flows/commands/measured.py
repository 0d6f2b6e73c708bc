"""Commands that read measured data, calibrate vehicles and find the effects that the model lacks."""

from typing import Any

from flows.commands.command import (
    CAMPAIGN,
    CAMPAIGN_VEHICLE,
    OUT,
    TRACES,
    VEHICLE,
    Command,
    define_argument,
    define_option,
    select_keys,
)
from flows.commands.studies import MODE

GROUP = "Measured data"
WIDE_COLUMNS = {
    "criterion",
    "fails_only_here",
    "mean_trajectory",
    "trained_on",
    "rate_correlation",
    "no_dive_rmse",
}
BUMP_FIGURES = ("rate_rmse", "rate_rms", "rate_correlation", "vertical_correlation", "peak_pitch")


def shorten_import(result: dict[str, Any]) -> dict[str, Any]:
    """Return the report of an import, or a narrow table of signals for each recording."""
    if "signals" not in result:
        return result
    return {
        file: [_shorten_signal(row, any(row["note"] for row in rows)) for row in rows]
        for file, rows in result["signals"].items()
    }


def _shorten_signal(row: dict[str, Any], noted: bool) -> dict[str, Any]:
    def join(low: float | None, high: float | None) -> str | None:
        return None if low is None else f"{low:.6g} to {high:.6g}"

    return {
        **{key: row[key] for key in ("signal", "unit", "samples", "rate_hz")},
        "time_s": join(row["start_s"], row["end_s"]),
        "range": join(row["lowest"], row["highest"]),
        **({"note": row["note"]} if noted else {}),
    }


def shorten_brake_protocol(result: dict[str, Any]) -> dict[str, Any]:
    """Return a brake protocol without its events and the widest columns of its tables."""
    brief = {key: value for key, value in result.items() if key != "events"}
    for table in ("attrition", "folds"):
        brief[table] = [{k: v for k, v in row.items() if k not in WIDE_COLUMNS} for row in result[table]]
    return brief


def shorten_stop_study(result: dict[str, Any]) -> dict[str, Any]:
    """Return a stop study with the held-out figures of each step."""
    return result | {"rungs": [{"rung": row["rung"], **row["held_out"]} for row in result["rungs"]]}


def shorten_bump_study(result: dict[str, Any]) -> dict[str, Any]:
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


def shorten_agreement(result: dict[str, Any]) -> dict[str, Any]:
    """Return an agreement with the main columns of each case, and the groups."""
    hidden = {"window", "note"}
    cases = [{key: value for key, value in row.items() if key not in hidden} for row in result["cases"]]
    figures = tuple(result["mean"])
    groups = [
        {"split": row["split"], "group": row["group"], "cases": row["count"]}
        | {name: _write_pair(row[name], row["maximum"][name]) for name in figures}
        for row in result["groups"]
    ]
    printed = [
        {"cases of": f"{row['split']}, {row['group']}", "figure": row["figure"],
         "here": _write_pair(row["mean"], row["maximum"]),
         "paper": _write_pair(row["paper_mean"], row["paper_maximum"]), "note": row["note"]}
        for row in result["beside_print"]
    ]  # fmt: skip
    return {"cases": cases, "mean / maximum of groups": groups, "beside the paper's against CarSim": printed}


def _write_pair(mean: float | None, maximum: float | None) -> str | None:
    """Mean and, where there is one, maximum in one cell, as the paper prints them."""
    if mean is None:
        return None
    return f"{mean:.4g}" if maximum is None else f"{mean:.4g} / {maximum:.4g}"


def shorten_verdict(result: dict[str, Any]) -> dict[str, Any]:
    """Return a verdict with a row for each parameter of a named effect, and for the error of each channel."""
    effects = [
        {
            "name": effect["name"],
            "class": effect["class"],
            "parameter": name,
            **{key: parameter[key] for key in ("value", "ci_low", "ci_high", "unit")},
        }
        for effect in result["effects"]
        for name, parameter in effect["parameters"].items()
    ]
    error = [
        {"channel": channel, **{key: entry[key] for key in ("frozen", "retuned", "after", "unit")}}
        for channel, entry in result["error"].items()
    ]
    kept = {key: result[key] for key in ("verdict", "sentence", "reasons", "vehicle_file", "report")}
    return kept | {"effects": effects, "error": error}


COMMANDS = (
    Command(
        name="import-measurements",
        group=GROUP,
        sentence="Make a campaign folder of measured recordings, or say what is wrong in which run and channel.",
        function="flows.measured.importing:import_measurements",
        options=(
            define_argument(
                "source",
                str,
                "CSV, Parquet, MDF4, MATLAB, ROS bag, MCAP or bus-JSON file, ROS 2 bag folder, or a folder of them.",
            ),
            define_option(
                "map",
                str | None,
                "Channel map: YAML file, or the name of one in catalogs/channel_maps.",
                None,
                known="catalogs/channel_maps/*.yaml",
            ),
            define_option("out", str | None, "Campaign folder to make.", None),
            define_option(
                "list_signals",
                bool,
                "List every signal with unit, samples, rate, times and range, and make nothing.",
                False,
            ),
        ),
        brief=shorten_import,
    ),
    Command(
        name="brake-protocol",
        group=GROUP,
        sentence="Select braking events by the paper's rules and predict each drive from the others (Appendix C.5).",
        function="flows.measured.protocol:brake_protocol",
        options=(
            define_argument("campaign", str, "Campaign folder with brake pressure and pitch."),
            define_option(
                "protocol",
                str,
                "Protocol: YAML file, or the name of one in catalogs/protocols.",
                "brake-dive",
                known="catalogs/protocols/*.yaml",
            ),
            CAMPAIGN_VEHICLE,
            define_option("all_events", bool, "Use every candidate event, whatever rules it breaks.", False),
            OUT,
        ),
        brief=shorten_brake_protocol,
    ),
    Command(
        name="stop-study",
        group=GROUP,
        sentence="Calibrate on one stop of a car, predict another, and add what the model lacks step by step.",
        function="flows.measured.stop_study:stop_study",
        options=(
            define_argument("campaign", str, "Campaign folder with brake and engine torque."),
            define_option(
                "study",
                str,
                "Stop study: YAML file, or the name of one in catalogs/stop_studies.",
                "bmw-m8",
                known="catalogs/stop_studies/*.yaml",
            ),
            CAMPAIGN_VEHICLE,
            OUT,
        ),
        brief=shorten_stop_study,
    ),
    Command(
        name="bump-study",
        group=GROUP,
        sentence="Find the road features in a recording's pitch rate, and fit the car that drove over them.",
        function="flows.measured.bump_study:bump_study",
        options=(
            define_argument("campaign", str, "Campaign folder with pitch rate and speed."),
            define_option(
                "study",
                str,
                "Bump study: YAML file, or the name of one in catalogs/bump_studies.",
                "comma2k19",
                known="catalogs/bump_studies/*.yaml",
            ),
            CAMPAIGN_VEHICLE,
            OUT,
        ),
        brief=shorten_bump_study,
    ),
    Command(
        name="synthetic-drives",
        group=GROUP,
        sentence="Write drives as a car's bus logs them, with known truth, to try the brake protocol on.",
        function="flows.measured.bus_drives:synthetic_drives",
        options=(
            define_option("out", str, "Folder for one bus log of each drive."),
            define_option("drives", int, "Number of drives.", 3),
            define_option("events", int, "Number of brake applications in each drive.", 46),
            define_option("seed", int, "Seed of the random numbers.", 2020),
        ),
    ),
    Command(
        name="agreement",
        group=GROUP,
        sentence="Compare the vehicle model with reference traces, as the paper's Appendix A.2 does.",
        function="flows.studies.vehicle_model:measure_agreement",
        options=(TRACES, VEHICLE, MODE, OUT),
        brief=shorten_agreement,
    ),
    Command(
        name="calibrate",
        group=GROUP,
        sentence="Calibrate a vehicle in stages on reference traces, freeze it, and say how well each number is known.",
        function="flows.measured.calibration:calibrate_on_traces",
        options=(
            TRACES,
            define_option("out", str, "Folder for the frozen vehicle and calibration.json."),
            define_option(
                "vehicle",
                str,
                "Vehicle to start from: YAML file, or the name of one in catalogs/vehicles.",
                VEHICLE.default,
                known=VEHICLE.known,
            ),
            define_option(
                "procedure",
                str,
                "Procedure: YAML file, or the name of one in catalogs/calibration.",
                "paper-staged",
                known="catalogs/calibration/*.yaml",
            ),
            define_option("split", str, "Split of the traces to fit; no other split is read.", "development"),
            define_option("name", str, "Name of the frozen vehicle.", "calibrated"),
        ),
        brief=select_keys("vehicle_file", "vehicle_sha256", "stages", "before", "after"),
    ),
    Command(
        name="close-loop",
        group=GROUP,
        sentence="Find the effects that the model lacks in a measured campaign, and write the vehicle with them.",
        function="flows.measured.closing:close_loop",
        options=(
            CAMPAIGN,
            define_option(
                "out", str, "Folder for the verdict, the report and the vehicle with the effects found."
            ),
            CAMPAIGN_VEHICLE,
        ),
        brief=shorten_verdict,
        one_thread=True,
    ),
    Command(
        name="close-loop-benchmark",
        group=GROUP,
        sentence="Count how often close-loop is right on campaigns whose truth is known.",
        function="flows.measured.closing_benchmark:close_loop_benchmark",
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
)
