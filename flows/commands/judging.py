"""Judging pixels."""

from typing import Annotated

import typer

from flows.commands.console import Json, Out, Prefect, call, exit_unless, show

app = typer.Typer()


@app.command()
def evaluate(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Annotated[str, typer.Option(help="Folder for evaluation.json, .parquet and .html.")],
    trajectories: Annotated[
        str | None, typer.Option(help="Folder with METHOD/CLIP_ID.txt (TUM format) to score as well.")
    ] = None,
    metric: Annotated[bool, typer.Option(help="The trajectories' lengths are metres.")] = False,
    learned: Annotated[
        str | None,
        typer.Option(help="YAML of local checkpoints of learned judges (CLIP, DOVER, FAST-VQA, LPIPS)."),
    ] = None,
    crf: Annotated[
        int | None, typer.Option(min=0, max=51, help="Judge what is left after H.264 of this rate factor.")
    ] = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Judge a dataset from its pixels: poses, motion, road edits and weather, beside the paper's figures."""
    result = call(
        "evaluate",
        prefect,
        dataset,
        out=out,
        trajectories=trajectories,
        metric=metric,
        learned=learned,
        crf=crf,
    )
    keys = ("metric", "method", "condition", "value", "unit", "paper", "floor", "note")
    rows = [{key: row[key] for key in keys} for row in result["rows"] if not row["window"]]
    show(result if as_json else {**result, "rows": rows}, as_json)


@app.command()
def controls(
    dataset: Annotated[str, typer.Argument(help="A finished dataset folder.")],
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Desynchronise a dataset's claims in seven ways and say which metric sees which fault."""
    result = call("controls", prefect, dataset, out=out)
    rows = [{key: value for key, value in row.items() if key != "roc"} for row in result["rows"]]
    show(result if as_json else {**result, "rows": rows}, as_json)
    exit_unless(result["all_detected"])


@app.command()
def judge(
    video: Annotated[str, typer.Argument(help="Any video file, or a trajectory (TUM format, .txt or .tum).")],
    claim: Annotated[str, typer.Option(help="Telemetry Parquet with t_ns or time, pitch and station.")],
    camera: Annotated[str, typer.Option(help="Camera YAML: a catalogue entry, or fx, fy, cx, cy.")],
    metric: Annotated[bool, typer.Option(help="The trajectory's lengths are metres.")] = False,
    out: Out = None,
    prefect: Prefect = False,
    as_json: Json = False,
) -> None:
    """Judge any video's motion against the telemetry claimed for it, from its pixels and intrinsics alone."""
    result = call("judge", prefect, video, claim=claim, camera=camera, out=out, metric=metric)
    show(result, as_json)
    exit_unless(result["passed"])


@app.command()
def retention(
    source: Annotated[str, typer.Argument(help="The editor's input: the drive over the road feature.")],
    source_braking: Annotated[str, typer.Argument(help="Its input of the flat-road braking drive.")],
    edited: Annotated[str, typer.Argument(help="What the editor made of the first.")],
    edited_braking: Annotated[str, typer.Argument(help="What it made of the second.")],
    camera: Annotated[str, typer.Option(help="Camera YAML: a catalogue entry, or fx, fy, cx, cy.")],
    event: Annotated[tuple[int, int], typer.Option(help="First and last frame of the event.")] = (16, 42),
    out: Out = None,
    as_json: Json = False,
) -> None:
    """How much of a road event's pitch a video editor kept (the paper's source-motion retention)."""
    result = call(
        "retention",
        False,
        source,
        source_braking,
        edited,
        edited_braking,
        camera=camera,
        event=event,
        out=out,
    )
    show(result, as_json)
