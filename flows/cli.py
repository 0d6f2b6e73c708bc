"""The ``musync`` command: reads arguments, calls one function, prints what it returned."""

import json
import os
import sys
from collections.abc import Callable
from typing import Annotated, Any

import typer

from tasks.errors import InputError

DONE, CHECK_FAILED, INPUT_WRONG, BROKEN = 0, 1, 2, 3

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, help=__doc__)
scene_app = typer.Typer(no_args_is_help=True, help="Build a scene from recordings or other tools.")
app.add_typer(scene_app, name="scene")

Json = Annotated[bool, typer.Option("--json", help="Print the JSON instead of text.")]
Out = Annotated[str | None, typer.Option(help="Folder for the JSON this command writes.")]
Runner = Annotated[str, typer.Option(help="threads, processes or dask.")]
Workers = Annotated[int | None, typer.Option(help="How many at once; by default one a processor.", min=1)]
Scheduler = Annotated[str | None, typer.Option(help="tcp:// or tls:// address of a running Dask scheduler.")]
Prefect = Annotated[
    bool, typer.Option("--prefect", help="Run as a Prefect flow; implied by PREFECT_API_URL.")
]


@app.command()
def generate(
    grid: Annotated[str, typer.Argument(help="Grid file, or the name of one that ships.")],
    out: Annotated[
        str, typer.Option(help="Dataset folder: new, empty, or an unfinished run of the same grid.")
    ],
    runner: Runner = "dask",
    workers: Workers = None,
    scheduler: Scheduler = None,
    backend: Annotated[str, typer.Option(help="Rasteriser: auto, cpu or gsplat.")] = "auto",
    vehicle: Annotated[
        str | None,
        typer.Option(help="Vehicle name or file in place of the grid's; a frozen one in its own mode."),
    ] = None,
    frames: Annotated[bool, typer.Option(help="Render frames; without them, telemetry alone.")] = True,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Make the dataset of a scenario grid, or what is missing of it."""
    report = _call(
        "generate", prefect, grid, out, runner=runner, workers=workers, scheduler=scheduler, backend=backend,
        vehicle=vehicle, pictures=frames,
    )  # fmt: skip
    layout = report.layout
    _show(
        {
            "run_id": report.run_id,
            "clips": report.clips,
            "made": report.made,
            "pose_check_failed": list(report.doubtful),
            "dataset": str(layout.root),
            "manifest": str(layout.manifest),
            "contact_sheet": str(layout.previews / "contact_sheet.png") if frames else None,
        },
        as_json,
    )


@app.command()
def audit(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    share: Annotated[float, typer.Option(help="Share of the clips to make again.")] = 0.1,
    out: Out = None,
    runner: Runner = "dask",
    workers: Workers = None,
    scheduler: Scheduler = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Verify every hash of a dataset and make a share of it again."""
    result = _call(
        "audit", prefect, dataset, share=share, out=out, runner=runner, workers=workers, scheduler=scheduler
    )
    _show(result, as_json)
    if not result["verified"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def schedule(
    grid: Annotated[str, typer.Argument(help="Grid file, or the name of one that ships.")],
    every: Annotated[str, typer.Option(help='Cron expression, UTC: "0 3 * * *" is every night at three.')],
    out: Annotated[str, typer.Option(help="Folder in which each run makes its dated dataset.")],
    runner: Runner = "dask",
    workers: Workers = None,
    notify: Annotated[
        str | None, typer.Option(help="Command or http(s) address that is told of a failed run.")
    ] = None,
) -> None:
    """Make a dataset of a grid again and again, as a Prefect deployment served from this process."""
    _call("schedule", False, grid, every=every, out=out, runner=runner, workers=workers, notify=notify)


@app.command()
def verify(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Verify every hash of a dataset and the seal of its manifest; make nothing."""
    result = _call("verify", prefect, dataset, out=out)
    _show(result, as_json)
    if not result["verified"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def repair(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Out = None,
    runner: Runner = "dask",
    workers: Workers = None,
    scheduler: Scheduler = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Make again what is broken or missing in a dataset; only the recorded bytes are put in place."""
    result = _call("repair", prefect, dataset, out=out, runner=runner, workers=workers, scheduler=scheduler)
    _show(result, as_json)
    if not result["repaired"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def gc(
    dataset: Annotated[str, typer.Argument(help="A dataset folder, finished or not.")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Name the left-overs and leave them.")] = False,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Remove what killed runs left in a dataset and beside it; committed clips stay."""
    _show(_call("gc", prefect, dataset, dry_run=dry_run), as_json)


@app.command("audit-physics")
def audit_physics(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Work every telemetry column out again from the others, and name the one that breaks a law."""
    result = _call("audit_physics", prefect, dataset, out=out)
    keys = ("label", "passed", "laws", "column", "tightest")
    brief = result | {"clips": [{key: row[key] for key in keys} for row in result["clips"]]}
    _show(result if as_json else brief, as_json)
    if not result["verified"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def evaluate(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Annotated[str, typer.Option(help="Folder for evaluation.json, .parquet and .html.")],
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Judge a dataset from its pixels: poses, motion, road edits and weather, beside the paper's figures."""
    result = _call("evaluate", prefect, dataset, out=out)
    keys = ("metric", "method", "condition", "value", "unit", "paper", "floor", "note")
    rows = [{key: row[key] for key in keys} for row in result["rows"] if not row["window"]]
    _show(result if as_json else {**result, "rows": rows}, as_json)


@app.command()
def controls(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Desynchronise a dataset's claims in seven ways and say which metric sees which fault."""
    result = _call("controls", prefect, dataset, out=out)
    rows = [{key: value for key, value in row.items() if key != "roc"} for row in result["rows"]]
    _show(result if as_json else {**result, "rows": rows}, as_json)
    if not result["all_detected"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def judge(
    video: Annotated[str, typer.Argument(help="Any video file.")],
    claim: Annotated[str, typer.Option(help="Telemetry Parquet with t_ns or time, pitch and station.")],
    camera: Annotated[str, typer.Option(help="Camera YAML: a catalogue entry, or fx, fy, cx, cy.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Judge any video's motion against the telemetry claimed for it, from its pixels and intrinsics alone."""
    result = _call("judge", prefect, video, claim=claim, camera=camera, out=out)
    _show(result, as_json)
    if not result["passed"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def diff(
    a: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    b: Annotated[str, typer.Argument(help="Another, of the same scenarios.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Compare two datasets: which clips differ, how far their labels moved, and which input can be why."""
    result = _call("diff", prefect, a, b, out=out)
    if as_json:
        _show(result, as_json)
    else:
        from flows.dataset_diff import as_text

        typer.echo(as_text(result), nl=False)


@app.command()
def describe(dataset: Annotated[str, typer.Argument()], as_json: Json = False) -> None:
    """Say what is in a dataset."""
    _show(_call("describe", False, dataset), as_json)


@app.command()
def sql(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    query: Annotated[str, typer.Argument(help="DuckDB SQL over clips, ticks, frames, verdicts and pairs.")],
    as_json: Json = False,
) -> None:
    """Answer an SQL query over a dataset's views."""
    result = _call("sql", False, dataset, query)
    _show(result if as_json else {"rows": result["rows"]}, as_json)


@app.command()
def schema(as_json: Json = False) -> None:
    """List every column of every view: unit, paper symbol, CF standard name and meaning."""
    _show(_call("schema", False), as_json)


@app.command()
def explain(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    clip: Annotated[str, typer.Argument(help="Label or id of a clip.")],
    frame: Annotated[int, typer.Argument(help="Frame number, from 0.")],
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Follow one frame from the weather to the pixel, every number computed again beside the stored one."""
    result = _call("explain", False, dataset, clip, frame, out=out)
    if as_json:
        _show(result, as_json)
    else:
        from flows.explain import as_text

        typer.echo(as_text(result), nl=False)
    if not result["agrees"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def preview(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Annotated[str, typer.Option(help="Folder for the films.")],
    clip: Annotated[
        list[str] | None, typer.Option(help="Label or id of a clip, more than once; by default all.")
    ] = None,
    traces: Annotated[bool, typer.Option(help="Run the vehicle's traces below the picture.")] = True,
    as_json: Json = False,
) -> None:
    """Make an MP4 film of each clip, with speed, slip, pitch, load and brake pressure below it."""
    _show(_call("preview", False, dataset, out, clips=clip, traces=traces), as_json)


@app.command()
def sheets(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Annotated[str, typer.Option(help="Folder for weather.png and hazards.png.")],
    station: Annotated[float, typer.Option(help="Where the weathers are shown [m].")] = 12.0,
    as_json: Json = False,
) -> None:
    """Draw one place in every weather, and each road feature before, at and after contact."""
    _show(_call("sheets", False, dataset, out, station=station), as_json)


@app.command("replay-audit")
def replay_audit(
    grid: Annotated[str, typer.Argument(help="Grid file, or the name of one that ships.")] = "severity",
    seeds: Annotated[int, typer.Option(help="Visual seeds a scenario.")] = 3,
    frames: Annotated[int, typer.Option(help="Frames drawn a run.")] = 2,
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Prove that visual seeds move the weather in the picture and nothing in the motion."""
    result = _call("replay_audit", prefect, grid, seeds=seeds, frames=frames, out=out)
    brief = {key: value for key, value in result.items() if key != "largest_difference"}
    _show(result if as_json else brief, as_json)
    if not result["verified"]:
        raise typer.Exit(CHECK_FAILED)


@app.command()
def validate(grid: Annotated[str, typer.Argument()], as_json: Json = False) -> None:
    """Check a grid without making anything."""
    _show(_call("validate", False, grid), as_json)


@app.command()
def sensitivity(out: Out = None, as_json: Json = False) -> None:
    """Reproduce the paper's bounded surface-parameter study (Appendix E) beside its printed figures."""
    result = _call("sensitivity", False, out=out)
    brief = {key: result[key] for key in ("solver_cases", "cpu_s", "beside_print")}
    _show(result if as_json else brief, as_json)
    if not all(row["agrees"] for row in result["beside_print"]):
        raise typer.Exit(CHECK_FAILED)


@app.command()
def agreement(
    traces: Annotated[str, typer.Argument(help="Folder with cases.json and the traces as Parquet.")],
    vehicle: Annotated[str, typer.Option(help="Vehicle name or file.")] = "paper-reference",
    mode: Annotated[
        str | None,
        typer.Option(help="paper or coupled; by default what a frozen vehicle was fitted in, or paper."),
    ] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Hold the vehicle model against reference traces, as the paper's Appendix A.2 does."""
    result = _call("agreement", False, traces, vehicle=vehicle, mode=mode, out=out)
    shown = [
        {key: value for key, value in row.items() if key not in {"window", "note"}} for row in result["cases"]
    ]
    brief = {"cases": shown, "groups": result["groups"]}
    _show(result if as_json else brief, as_json)


@app.command()
def calibrate(
    traces: Annotated[str, typer.Argument(help="Folder with cases.json and the traces as Parquet.")],
    out: Annotated[str, typer.Option(help="Folder for the frozen vehicle and calibration.json.")],
    vehicle: Annotated[str, typer.Option(help="Vehicle name or file to start from.")] = "paper-reference",
    procedure: Annotated[str, typer.Option(help="Procedure name or file.")] = "paper-staged",
    split: Annotated[str, typer.Option(help="The split to fit; no other is looked at.")] = "development",
    name: Annotated[str, typer.Option(help="Name of the frozen vehicle.")] = "calibrated",
    as_json: Json = False,
) -> None:
    """Calibrate a vehicle in stages on reference traces, freeze it, and say how well each scalar is known."""
    result = _call(
        "calibrate", False, traces, out=out, vehicle=vehicle, procedure=procedure, split=split, name=name
    )
    brief = {key: result[key] for key in ("vehicle_file", "vehicle_sha256", "stages", "before", "after")}
    _show(result if as_json else brief, as_json)


@app.command()
def render(
    scene: Annotated[str, typer.Argument(help="Scene folder, or street.")],
    pose: Annotated[str, typer.Option(help="JSON file: viewmat 4x4, K 3x3, width, height.")],
    out: Annotated[str, typer.Option(help="Folder for rgb.png and the buffers.")],
    backend: Annotated[str, typer.Option(help="auto, cpu or gsplat.")] = "auto",
    as_json: Json = False,
) -> None:
    """Render one frame of a scene at a world-to-camera pose."""
    _show(_call("render_pose", False, scene, pose, out, backend=backend), as_json)


@app.command()
def bench(
    name: Annotated[str | None, typer.Argument(help="One benchmark; by default all.")] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Measure speed and memory beside a peer in the same run."""
    _show(_call("bench", False, name, out=out), as_json)


@app.command("import-measurements")
def import_measurements(
    source: Annotated[str, typer.Argument(help="CSV, Parquet or MDF4 file, or a folder of them.")],
    map: Annotated[str, typer.Option(help="Channel map: YAML file, or the name of one that ships.")],
    out: Annotated[str, typer.Option(help="Campaign folder to make.")],
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Make a campaign folder of measured recordings, or say what is wrong in which run and channel."""
    _show(_call("import_measurements", prefect, source, map=map, out=out), as_json)


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
    result = _call(
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
    _show(result if as_json else brief, as_json)


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
    result = _call("stop_study", prefect, campaign, study=study, vehicle=vehicle, out=out)
    rungs = [{"rung": row["rung"], **row["held_out"]} for row in result["rungs"]]
    _show(result if as_json else {**result, "rungs": rungs}, as_json)


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
    result = _call("bump_study", prefect, campaign, study=study, vehicle=vehicle, out=out)
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
    _show(result if as_json else {**result, "windows": rows}, as_json)


@app.command("synthetic-drives")
def synthetic_drives(
    out: Annotated[str, typer.Option(help="Folder for one bus log a drive.")],
    drives: Annotated[int, typer.Option(help="How many drives.")] = 3,
    events: Annotated[int, typer.Option(help="Brake applications in each.")] = 46,
    seed: Annotated[int, typer.Option(help="Of the whole set.")] = 2020,
    as_json: Json = False,
) -> None:
    """Emit drives as a car's bus logs them, with known truth, to try the brake protocol on."""
    _show(_call("synthetic_drives", False, out, drives=drives, events=events, seed=seed), as_json)


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
    _one_thread()
    result = _call("close_loop", prefect, campaign, out=out, vehicle=vehicle)
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
    _show(result if as_json else {key: result[key] for key in keys} | brief, as_json)


@app.command("close-loop-benchmark")
def close_loop_benchmark(
    out: Annotated[
        str, typer.Option(help="Folder for closing-benchmark.json; a later call goes on with it.")
    ],
    seeds: Annotated[int, typer.Option(help="Campaigns of each known truth.", min=0)] = 10,
    nulls: Annotated[int, typer.Option(help="Campaigns of a model that lacks nothing.", min=0)] = 100,
    minutes: Annotated[float, typer.Option(help="Stop after so long, with what is done.")] = 1e9,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Count how often close-loop is right on campaigns whose truth is known."""
    _one_thread()
    result = _call("close_loop_benchmark", prefect, out=out, seeds=seeds, nulls=nulls, minutes=minutes)
    keys = ("campaigns", "false_discoveries", "summary")
    _show(result if as_json else {key: result[key] for key in keys}, as_json)


@scene_app.command("from-stereo")
def scene_from_stereo(
    folder: Annotated[str, typer.Argument(help="calib.txt, poses.txt, image_l/, image_r/.")],
    out: Annotated[str, typer.Option(help="Scene folder to make.")],
    as_json: Json = False,
) -> None:
    """Build a Gaussian scene from a posed stereo sequence."""
    _show(_call("scene_from_stereo", False, folder, out), as_json)


@scene_app.command("import")
def scene_import(
    gaussians: Annotated[str, typer.Argument(help=".ply, compressed .ply, .splat or .spz file.")],
    route: Annotated[str, typer.Option(help="Route: CSV, KITTI poses, TUM or nerfstudio transforms.json.")],
    out: Annotated[str, typer.Option(help="Scene folder to make.")],
    camera_height: Annotated[
        float, typer.Option(help="Height of the route's cameras above the road [m].")
    ] = 1.5,
    half_width: Annotated[float, typer.Option(help="Half the carriageway's width [m].")] = 3.5,
    metres_per_unit: Annotated[float, typer.Option(help="Metres in one unit of the files.")] = 1.0,
    as_json: Json = False,
) -> None:
    """Make a scene of Gaussians trained elsewhere and a route through them."""
    sizes = {"camera_height": camera_height, "half_width": half_width, "metres_per_unit": metres_per_unit}
    _show(_call("scene_import", False, gaussians, route, out, **sizes), as_json)


def _one_thread() -> None:
    # many small linear systems: the threads of a BLAS spend more time waiting for each other than computing
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _call(name: str, prefect: bool, /, *args: Any, **kwargs: Any) -> Any:
    """Call a pipeline function, as a Prefect flow where one is asked for."""
    return _function(name, prefect or "PREFECT_API_URL" in os.environ)(*args, **kwargs)


def _function(name: str, as_flow: bool) -> Callable[..., Any]:
    # imports are late so that each command loads only the libraries it needs
    if as_flow:
        from flows import prefect_flows

        if hasattr(prefect_flows, name):
            function: Callable[..., Any] = getattr(prefect_flows, name)
            return function
    from importlib import import_module

    module = {
        "generate": "generate", "audit": "audit", "verify": "verify", "gc": "verify", "repair": "repair",
        "sql": "query", "schema": "query", "explain": "explain", "schedule": "scheduling",
        "describe": "describe", "validate": "describe",
        "preview": "previews", "sheets": "sheets", "replay_audit": "replay",
        "sensitivity": "studies", "agreement": "studies", "bench": "studies",
        "calibrate": "calibration",
        "import_measurements": "importing", "brake_protocol": "protocol", "synthetic_drives": "bus_drives",
        "stop_study": "stop_study", "diff": "dataset_diff",
        "bump_study": "bump_study", "close_loop": "closing",
        "close_loop_benchmark": "closing_benchmark",
        "audit_physics": "physics", "evaluate": "evaluation", "controls": "controls", "judge": "foreign",
        "scene_from_stereo": "reconstruction", "scene_import": "scenes", "render_pose": "scenes",
    }[name]  # fmt: skip
    function = getattr(import_module(f"flows.{module}"), name)
    return function


def _show(value: dict[str, Any], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(value, indent=1))
        return
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, soft_wrap=True)
    for key, entry in value.items():
        if isinstance(entry, list) and entry and isinstance(entry[0], dict):
            table = Table(title=key, title_justify="left")
            for column in entry[0]:
                table.add_column(column, overflow="fold")
            for row in entry:
                table.add_row(*(_text(row.get(column)) for column in entry[0]))
            Console(highlight=False).print(table)
        else:
            console.print(f"{key}: {_text(entry)}")


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    return "-" if value is None else str(value)


def main() -> None:
    """Entry point: exit codes 0 done, 1 a check failed, 2 the input is wrong, 3 something broke."""
    from flows.failures import ClipsFailed, disk_full_sentence

    try:
        app(standalone_mode=True)
    except InputError as error:
        for problem in error.problems:
            print(f"musync: {problem}", file=sys.stderr)
        sys.exit(INPUT_WRONG)
    except ClipsFailed as error:
        print(f"musync: {error}", file=sys.stderr)
        sys.exit(BROKEN)
    except OSError as error:
        sentence = disk_full_sentence(error)
        if sentence is None:
            raise
        print(f"musync: {sentence}", file=sys.stderr)
        sys.exit(INPUT_WRONG)


if __name__ == "__main__":
    main()
