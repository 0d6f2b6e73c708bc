"""Measured data in, and closing the loop with it."""

from typing import Annotated, Any

import typer

from flows.commands.console import Json, Out, Prefect, call, one_thread, show

app = typer.Typer()


@app.command("import-measurements")
def import_measurements(
    source: Annotated[str, typer.Argument(help="CSV, Parquet or MDF4 file, or a folder of them.")],
    map: Annotated[str, typer.Option(help="Channel map: YAML file, or the name of one that ships.")],
    out: Annotated[str, typer.Option(help="Campaign folder to make.")],
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Make a campaign folder of measured recordings, or say what is wrong in which run and channel."""
    show(call("import_measurements", prefect, source, map=map, out=out), as_json)


@app.command("brake-protocol")
def brake_protocol(
    campaign: Annotated[str, typer.Argument(help="Campaign folder with brake pressure and pitch.")],
    protocol: Annotated[str, typer.Option(help="Protocol: YAML file, or the name of one.")] = "brake-dive",
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle to start from; by default the campaign's.")
    ] = None,
    all_events: Annotated[
        bool, typer.Option("--all-events", help="Use every candidate, whatever rules it breaks.")
    ] = False,
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Select braking events by the paper's rules and predict each drive from the others (Appendix C.5)."""
    result = call(
        "brake_protocol",
        prefect,
        campaign,
        protocol=protocol,
        vehicle=vehicle,
        all_events=all_events,
        out=out,
    )
    wide = {
        "criterion",
        "fails_only_here",
        "mean_trajectory",
        "trained_on",
        "rate_correlation",
        "no_dive_rmse",
    }
    brief = {key: value for key, value in result.items() if key != "events"}
    for table in ("attrition", "folds"):
        brief[table] = [{k: v for k, v in row.items() if k not in wide} for row in result[table]]
    show(result if as_json else brief, as_json)


@app.command("stop-study")
def stop_study(
    campaign: Annotated[str, typer.Argument(help="Campaign folder with brake and engine torque.")],
    study: Annotated[str, typer.Option(help="Stop study: YAML file, or the name of one.")] = "bmw-m8",
    vehicle: Annotated[
        str | None, typer.Option(help="Uncalibrated vehicle; by default the campaign's.")
    ] = None,
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Calibrate on one stop of a car, predict another, and add what the model lacks step by step."""
    result = call("stop_study", prefect, campaign, study=study, vehicle=vehicle, out=out)
    rungs = [{"rung": row["rung"], **row["held_out"]} for row in result["rungs"]]
    show(result if as_json else {**result, "rungs": rungs}, as_json)


@app.command("bump-study")
def bump_study(
    campaign: Annotated[str, typer.Argument(help="Campaign folder with pitch rate and speed.")],
    study: Annotated[str, typer.Option(help="Bump study: YAML file, or the name of one.")] = "comma2k19",
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle to start from; by default the campaign's.")
    ] = None,
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Find the road features that a recording's pitch rate gives away, and the car that fits them."""
    result = call("bump_study", prefect, campaign, study=study, vehicle=vehicle, out=out)
    figures = ("rate_rmse", "rate_rms", "rate_correlation", "vertical_correlation", "peak_pitch")
    rows = [
        {
            "window": row["window"],
            "car": car,
            **row[car]["feature"],
            **{name: row[car][name] for name in figures},
        }
        for row in result["windows"]
        for car in ("uncalibrated", "calibrated")
    ]
    show(result if as_json else {**result, "windows": rows}, as_json)


@app.command("synthetic-drives")
def synthetic_drives(
    out: Annotated[str, typer.Option(help="Folder for one bus log a drive.")],
    drives: Annotated[int, typer.Option(help="How many drives.")] = 3,
    events: Annotated[int, typer.Option(help="Brake applications in each.")] = 46,
    seed: Annotated[int, typer.Option(help="Of the whole set.")] = 2020,
    as_json: Json = False,
) -> None:
    """Emit drives as a car's bus logs them, with known truth, to try the brake protocol on."""
    show(call("synthetic_drives", False, out, drives=drives, events=events, seed=seed), as_json)


@app.command("close-loop")
def close_loop(
    campaign: Annotated[
        str, typer.Argument(help="Campaign folder: campaign.yaml, runs.csv, runs/*.parquet.")
    ],
    out: Annotated[str, typer.Option(help="Folder for verdict, report and grown vehicle.")],
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle name or file; by default the campaign's.")
    ] = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Say what a measured campaign shows that the model lacks, and write the vehicle model with it."""
    one_thread()
    result = call("close_loop", prefect, campaign, out=out, vehicle=vehicle)
    keys = ("verdict", "reasons", "vehicle_file", "report")
    brief: dict[str, Any] = {
        "effects": [
            {
                "name": e["name"],
                "class": e["class"],
                "parameter": name,
                **{key: p[key] for key in ("value", "ci_low", "ci_high", "unit")},
            }
            for e in result["effects"]
            for name, p in e["parameters"].items()
        ],
        "error": [
            {"channel": channel, **{key: e[key] for key in ("frozen", "retuned", "after", "unit")}}
            for channel, e in result["error"].items()
        ],
    }
    show(result if as_json else {key: result[key] for key in keys} | brief, as_json)


@app.command("close-loop-benchmark")
def close_loop_benchmark(
    out: Annotated[
        str, typer.Option(help="Folder for closing-benchmark.json and campaigns.jsonl; a later call goes on.")
    ],
    seeds: Annotated[int, typer.Option(help="Campaigns of each known truth.", min=0)] = 10,
    nulls: Annotated[int, typer.Option(help="Campaigns of a model that lacks nothing.", min=0)] = 100,
    harder: Annotated[
        int,
        typer.Option(help="Campaigns of each pair of effects, and of each truth on a poor design.", min=0),
    ] = 1,
    minutes: Annotated[float, typer.Option(help="Stop after so long, with what is done.")] = 1e9,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Count how often close-loop is right on campaigns whose truth is known."""
    one_thread()
    result = call(
        "close_loop_benchmark", prefect, out=out, seeds=seeds, nulls=nulls, harder=harder, minutes=minutes
    )
    keys = ("false_discoveries", "summary", "power", "cpu_s")
    show(result if as_json else {key: result[key] for key in keys}, as_json)
