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

GROUP = "Measured data"
MODE = define_option(
    "mode",
    str | None,
    "Vehicle model: paper or coupled; by default the one that a frozen vehicle was fitted in, else paper.",
    None,
    known=("paper", "coupled"),
)


def shorten_import(result: dict[str, Any]) -> dict[str, Any]:
    """Return the report of an import, or a narrow table of signals for each recording."""
    if "signals" not in result:
        assumed = result["assumed_tolerances_1sigma"]
        listed_tolerances = ", ".join(f"{name} {sigma:g}" for name, sigma in assumed.items())
        runs = [run | {"start_s": _write_time(run["start_s"])} for run in result.get("runs", [])]
        listed = {"runs": runs} if runs else {}
        return result | listed | {"assumed_tolerances_1sigma": listed_tolerances or "none"}
    return {
        file: [_shorten_signal(row, any(row["note"] for row in rows)) for row in rows]
        for file, rows in result["signals"].items()
    }


def _shorten_signal(row: dict[str, Any], noted: bool) -> dict[str, Any]:
    start, low = row["start_s"], row["lowest"]
    return {
        **{key: row[key] for key in ("signal", "unit", "samples", "rate_hz")},
        "time_s": None if start is None else f"{_write_time(start)} to {_write_time(row['end_s'])}",
        "range": None if low is None else f"{low:.6g} to {row['highest']:.6g}",
        **({"note": row["note"]} if noted else {}),
    }


def _write_time(seconds: float) -> str:
    """Return a logger's time to the millisecond [s]; one that counts from 1970 has ten digits before the point."""
    return f"{round(seconds, 3) + 0.0:.3f}".rstrip("0").rstrip(".")  # -0.0004 is 0, and not -0


def shorten_agreement(result: dict[str, Any]) -> dict[str, Any]:
    """Return an agreement with the main columns of each case, and the groups."""
    hidden = {"window", "note"}
    cases = [{key: value for key, value in row.items() if key not in hidden} for row in result["cases"]]
    figures = tuple(result["mean"])
    groups = [
        {"split": row["split"], "by": row["by"], "group": row["name"], "cases": row["cases"]}
        | {name: _write_pair(row["mean"][name], row["maximum"][name]) for name in figures}
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
                "CSV, Parquet, MDF4, MATLAB, VBOX, ROS bag, MCAP or bus-JSON file, folder of a ROS 2 bag or a KITTI"
                " drive, or a folder of them.",
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
        passed=lambda result: not result.get("faulty"),
    ),
    Command(
        name="vehicle agreement",
        group=GROUP,
        sentence="Compare the vehicle model with reference traces, as the paper's Appendix A.2 does.",
        function="flows.measured.agreement:measure_agreement",
        options=(TRACES, VEHICLE, MODE, OUT),
        brief=shorten_agreement,
    ),
    Command(
        name="vehicle calibrate",
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
)
