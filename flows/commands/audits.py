"""Holding a dataset against its manifest, its laws and another dataset."""

from typing import Annotated

import typer

from flows.commands.console import (
    Json,
    Out,
    Prefect,
    Runner,
    Scheduler,
    Workers,
    call,
    exit_unless,
    show,
    show_lines,
)

app = typer.Typer()


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
    result = call(
        "audit", prefect, dataset, share=share, out=out, runner=runner, workers=workers, scheduler=scheduler
    )
    show_lines(result, as_json, "flows.auditing.audit")
    exit_unless(result["verified"])


@app.command()
def verify(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    key: Annotated[
        str | None, typer.Option(help="File with the signer's Ed25519 public key (PEM): check its signature.")
    ] = None,
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Verify every hash of a dataset, the seal of its manifest and a signature; make nothing."""
    result = call("verify", prefect, dataset, key=key, out=out)
    show(result, as_json)
    exit_unless(result["verified"])


@app.command()
def sign(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    key: Annotated[str, typer.Option(help="File with the Ed25519 private key: PEM, PKCS#8.")],
    as_json: Json = False,
) -> None:
    """Sign a dataset's manifest, and with it every file that it records, with a private key."""
    show(call("sign", False, dataset, key=key), as_json)


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
    result = call("repair", prefect, dataset, out=out, runner=runner, workers=workers, scheduler=scheduler)
    show(result, as_json)
    exit_unless(result["repaired"])


@app.command()
def gc(
    dataset: Annotated[str, typer.Argument(help="A dataset folder, finished or not.")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Name the left-overs and leave them.")] = False,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Remove what killed runs left in a dataset and beside it; committed clips stay."""
    show(call("gc", prefect, dataset, dry_run=dry_run), as_json)


@app.command("audit-physics")
def audit_physics(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Work every telemetry column out again from the others, and name the one that breaks a law."""
    result = call("audit_physics", prefect, dataset, out=out)
    keys = ("label", "passed", "laws", "column", "tightest")
    brief = result | {"clips": [{key: row[key] for key in keys} for row in result["clips"]]}
    show(result if as_json else brief, as_json)
    exit_unless(result["verified"])


@app.command()
def diff(
    a: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    b: Annotated[str, typer.Argument(help="Another, of the same scenarios.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Compare two datasets: which clips differ, how far their labels moved, and which input can be why."""
    result = call("diff", prefect, a, b, out=out)
    show_lines(result, as_json, "flows.auditing.dataset_diff")


@app.command()
def explain(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    clip: Annotated[str, typer.Argument(help="Label or id of a clip.")],
    frame: Annotated[int, typer.Argument(help="Frame number, from 0.")],
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Follow one frame from the weather to the pixel, every number computed again beside the stored one."""
    result = call("explain", False, dataset, clip, frame, out=out)
    show_lines(result, as_json, "flows.auditing.explain")
    exit_unless(result["agrees"])


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
    result = call("replay_audit", prefect, grid, seeds=seeds, frames=frames, out=out)
    brief = {key: value for key, value in result.items() if key != "largest_difference"}
    show(result if as_json else brief, as_json)
    exit_unless(result["verified"])
