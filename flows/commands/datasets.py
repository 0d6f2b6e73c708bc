"""Making datasets and looking into them."""

from typing import Annotated

import typer

from flows.commands.console import Json, Prefect, Runner, Scheduler, Workers, call, exit_unless, show
from tasks.errors import InputError

app = typer.Typer()


@app.command()
def generate(
    out: Annotated[
        str, typer.Option(help="Dataset folder: new, empty, or an unfinished run of the same grid.")
    ],
    grid: Annotated[str | None, typer.Argument(help="Grid file, or the name of one that ships.")] = None,
    manifest: Annotated[
        str | None, typer.Option(help="In place of a grid: a frozen run, by name or file, to be made again.")
    ] = None,
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
    if (grid is None) == (manifest is None):
        raise InputError("generate needs either a GRID or --manifest NAME, and not both")
    differing = None
    if manifest is not None:
        if vehicle is not None or not frames:
            raise InputError(
                "--manifest says which vehicle drives and whether there are frames: leave the option out"
            )
        report, differing = call(
            "reproduce", prefect, manifest, out, runner=runner, workers=workers, scheduler=scheduler,
            backend=backend,
        )  # fmt: skip
    else:
        report = call(
            "generate", prefect, grid, out, runner=runner, workers=workers, scheduler=scheduler, backend=backend,
            vehicle=vehicle, pictures=frames,
        )  # fmt: skip
    layout = report.layout
    sheet = layout.previews / "contact_sheet.png"
    facts = {
        "run_id": report.run_id,
        "clips": report.clips,
        "made": report.made,
        "quarantined": report.quarantined,
        "dataset": str(layout),
        "manifest": str(layout.manifest),
        "contact_sheet": str(sheet) if sheet.is_file() else None,
    }
    if differing is not None:
        facts |= {"reproduced": report.clips - len(differing), "telemetry_differs": differing}
    if not as_json and report.quarantined:
        rows = report.quarantined.items()
        facts["quarantined"] = [{"clip": label, "why": "; ".join(reasons)} for label, reasons in rows]
    show(facts, as_json)
    exit_unless(not differing)


@app.command()
def freeze(
    grid: Annotated[
        str | None, typer.Argument(help="Grid file or name; without one, every frozen run that ships.")
    ] = None,
    out: Annotated[
        str | None, typer.Option(help="File to write; by default where the project keeps its own.")
    ] = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Freeze a run: scenarios, seeds, parameters and the hash of each clip's telemetry, for generate --manifest."""
    show(call("freeze", prefect, grid, out=out), as_json)


@app.command()
def schedule(
    grid: Annotated[str, typer.Argument(help="Grid file, or the name of one that ships.")],
    every: Annotated[str, typer.Option(help='Cron expression, UTC: "0 3 * * *" is every night at three.')],
    out: Annotated[
        str, typer.Option(help="Folder or s3:// address in which each run makes its dated dataset.")
    ],
    runner: Runner = "dask",
    workers: Workers = None,
    scheduler: Scheduler = None,
    notify: Annotated[
        str | None, typer.Option(help="Command or http(s) address that is told of a failed run.")
    ] = None,
) -> None:
    """Make a dataset of a grid again and again, as a Prefect deployment served from this process."""
    call("schedule", False, grid, every=every, out=out, runner=runner, workers=workers,
        scheduler=scheduler, notify=notify)  # fmt: skip


@app.command()
def validate(grid: Annotated[str, typer.Argument()], as_json: Json = False) -> None:
    """Check a grid without making anything."""
    show(call("validate", False, grid), as_json)


@app.command()
def describe(dataset: Annotated[str, typer.Argument()], as_json: Json = False) -> None:
    """Say what is in a dataset."""
    show(call("describe", False, dataset), as_json)


@app.command()
def sql(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    query: Annotated[str, typer.Argument(help="DuckDB SQL over clips, ticks, frames, verdicts and pairs.")],
    allow_files: Annotated[
        bool,
        typer.Option(
            "--allow-files",
            help="Let the query read and write files of this machine and load extensions; else it reaches the"
            " dataset alone.",
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Answer an SQL query over a dataset's views."""
    result = call("sql", False, dataset, query, allow_files=allow_files)
    show(result if as_json else {"rows": result["rows"]}, as_json)


@app.command()
def schema(
    as_json: Json = False,
    grid: Annotated[
        bool, typer.Option("--grid", help="The JSON Schema of a grid file, for editors.")
    ] = False,
) -> None:
    """List every column of every view: unit, paper symbol, CF standard name and meaning."""
    show(call("schema", False, of="grid" if grid else "views"), as_json or grid)


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
    show(call("preview", False, dataset, out, clips=clip, traces=traces), as_json)


@app.command()
def report(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Annotated[
        str | None, typer.Option(help="Folder for the page; by default beside the dataset, DIR-report.")
    ] = None,
    clip: Annotated[
        list[str] | None, typer.Option(help="Label or id of a clip whose traces and film to bring.")
    ] = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Make a page that opens without a server: clips to filter, films beside traces, siblings, the manifest."""
    show(call("report", prefect, dataset, out=out, clips=clip), as_json)


@app.command()
def sheets(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Annotated[str, typer.Option(help="Folder for weather.png and hazards.png.")],
    station: Annotated[float, typer.Option(help="Where the weathers are shown [m].")] = 12.0,
    as_json: Json = False,
) -> None:
    """Draw one place in every weather, and each road feature before, at and after contact."""
    show(call("sheets", False, dataset, out, station=station), as_json)
