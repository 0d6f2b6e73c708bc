"""The paper's studies, calibration, benchmarks."""

from typing import Annotated

import typer

from flows.commands.console import Json, Out, call, exit_unless, show

app = typer.Typer()


@app.command()
def sensitivity(out: Out = None, as_json: Json = False) -> None:
    """Reproduce the paper's bounded surface-parameter study (Appendix E) beside its printed figures."""
    result = call("sensitivity", False, out=out)
    brief = {key: result[key] for key in ("solver_cases", "cpu_s", "beside_print")}
    show(result if as_json else brief, as_json)
    exit_unless(all(row["agrees"] for row in result["beside_print"]))


@app.command()
def ablation(
    out: Annotated[str, typer.Option(help="Folder for ablation.json, .parquet and .svg.")],
    vehicle: Annotated[str, typer.Option(help="Vehicle name or file.")] = "multibody-grown",
    mode: Annotated[
        str | None,
        typer.Option(help="paper or coupled; by default what a frozen vehicle was fitted in, or paper."),
    ] = None,
    traces: Annotated[str | None, typer.Option(help="Reference traces; their pitch is the oracle's.")] = None,
    as_json: Json = False,
) -> None:
    """Cut one coupling at a time (the paper's Section 4.4): stops over the weather, pitch at a hump."""
    result = call("ablation", False, out=out, vehicle=vehicle, mode=mode, traces=traces)
    show(result if as_json else {key: result[key] for key in ("pitch", "reference")}, as_json)


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
    result = call("agreement", False, traces, vehicle=vehicle, mode=mode, out=out)
    shown = [
        {key: value for key, value in row.items() if key not in {"window", "note"}} for row in result["cases"]
    ]
    brief = {"cases": shown, "groups": result["groups"]}
    show(result if as_json else brief, as_json)


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
    result = call(
        "calibrate", False, traces, out=out, vehicle=vehicle, procedure=procedure, split=split, name=name
    )
    brief = {key: result[key] for key in ("vehicle_file", "vehicle_sha256", "stages", "before", "after")}
    show(result if as_json else brief, as_json)


@app.command()
def bench(
    name: Annotated[str | None, typer.Argument(help="One benchmark; by default all.")] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Measure speed and memory beside a peer in the same run."""
    show(call("bench", False, name, out=out), as_json)
