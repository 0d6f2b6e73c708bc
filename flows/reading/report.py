"""A dataset as a page for analysts: films, traces and verdicts, opened without a server."""

import base64
import json
import shutil
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.making.clip import TICK_RATE_HZ
from flows.making.seal import spread
from flows.reading.film import write_film
from flows.reading.previews import named_clips
from flows.running.progress import progress_bar
from flows.store.address import reading
from flows.store.frames import read_clip
from flows.store.layout import Layout, write_atomically
from flows.store.sealed import read_manifest
from flows.store.telemetry import read_columns
from manifests.siblings import sibling_pairs
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.render.traces import TRACES

PAGE = Path(__file__).parent / "report_page"
TRACED_CLIPS = 200
"""Larger datasets list every clip and bring the traces and films of so many, evenly spread, unless some are named."""
DECIMALS = {"km/h": 1, "deg": 2, "kN": 2, "MPa": 2, "": 3}


def report(dataset: str, *, out: str | None = None, clips: list[str] | None = None) -> dict[str, Any]:
    """Write a folder with a page that opens from the disk: ``index.html``, its data, and a film a clip.

    Several files rather than one: a browser reads from the disk only what is looked at, so that the page of a large
    dataset opens as fast as that of a small one, and films can be sought in. Films that are there are kept.

    Parameters
    ----------
    dataset : a finished dataset, with frames or without
    out : folder of the page; None takes one beside the dataset, named after it
    clips : labels or ids of the clips whose traces and films to bring; None takes all, up to `TRACED_CLIPS`

    Returns
    -------
    ``page``, ``clips``, ``traced``, ``films_made``, ``megabytes``

    Raises
    ------
    InputError
        The folder holds no finished dataset, a clip is not in it, or the page's folder holds other files.
    """
    layout = reading(dataset)
    manifest = read_manifest(layout)
    rows: list[dict[str, Any]] = manifest["clips"]
    brought = named_clips(rows, clips, dataset) if clips else spread(rows, TRACED_CLIPS)
    folder = _folder(layout, out)
    pictures = manifest["grid"].get("pictures", True)
    made = _bring(layout, manifest, brought, folder, pictures)
    data = page_data(manifest, {row["clip_id"] for row in brought}, pictures)
    write_atomically(folder / "data.js", f"const REPORT = {_script(data)};\n".encode())
    for source in sorted(PAGE.iterdir()):
        shutil.copyfile(source, folder / source.name)
    (folder / "plotly.min.js").write_text(_plotly(), encoding="utf-8")
    return {
        "page": str(folder / "index.html"),
        "clips": len(rows),
        "traced": len(brought),
        "films_made": made,
        "megabytes": round(sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / 1e6, 1),
    }


def page_data(manifest: Mapping[str, Any], brought: set[str], pictures: bool) -> dict[str, Any]:
    """What the page shows of all clips; telemetry comes clip by clip.

    Parameters
    ----------
    manifest : of the dataset
    brought : ids of the clips whose telemetry lies beside the page
    pictures : whether there are films of these
    """
    grid, rows = manifest["grid"], manifest["clips"]
    place = {row["clip_id"]: k for k, row in enumerate(rows)}
    kept = (
        "clip_id", "label", "seed", "split", "calibration", "scenario", "figures", "verdict", "content"
    )  # fmt: skip
    return {
        "name": grid["name"],
        "summary": f"{len(rows)} clips of {grid['frames']} frames on {grid['scene']}, vehicle {grid['vehicle']}"
        f" in {grid['vehicle_mode']} mode; run {manifest['run_id']}",
        "frame_rate_hz": grid["frame_rate_hz"],
        "tick_rate_hz": TICK_RATE_HZ,
        "duration_s": (grid["frames"] - 1) / grid["frame_rate_hz"],
        "panels": [
            {"column": t.column, "caption": t.caption, "unit": t.unit, "factor": t.factor,
             "decimals": DECIMALS[t.unit]}
            for t in TRACES
        ],
        "clips": [
            {key: row[key] for key in kept}
            | {
                "traced": row["clip_id"] in brought,
                "film": f"media/{row['clip_id']}.mp4" if pictures and row["clip_id"] in brought else None,
            }
            for row in rows
        ],
        "pairs": [[place[p["clip_id_a"]], place[p["clip_id_b"]], p["control"]] for p in sibling_pairs(rows)],
        "manifest": _manifest_facts(manifest),
    }  # fmt: skip


def packed(columns: Mapping[str, NDArray[Any]], names: Sequence[str]) -> dict[str, Any]:
    """Columns as float64, each as eight planes of one byte of every number, deflated, in base64.

    Planes because neighbours in time share their high bytes: less than half of what deflate alone leaves.
    """
    rows = len(columns[names[0]])
    planes = [np.asarray(columns[name], "<f8").view(np.uint8).reshape(rows, 8).T for name in names]
    squeezed = zlib.compress(np.ascontiguousarray(np.stack(planes)).tobytes(), 6)
    return {"rows": rows, "columns": list(names), "packed": base64.b64encode(squeezed).decode()}


def _bring(
    layout: Layout,
    manifest: Mapping[str, Any],
    brought: Sequence[Mapping[str, Any]],
    folder: Path,
    pictures: bool,
) -> int:
    """Write the telemetry and make the missing films of some clips; how many films were made."""
    names = [channel.name for channel in TICK_CHANNELS]
    wanted, made = set(), 0
    with progress_bar("report", len(brought)) as advance:
        for row in brought:
            clip_id = row["clip_id"]
            ticks = read_columns(layout.telemetry / "ticks" / f"family={row['scenario']['weather']}", clip_id)
            content = f'clipArrived("{clip_id}", {_script(packed(ticks, names))});\n'
            write_atomically(folder / "clips" / f"{clip_id}.js", content.encode())
            wanted |= {f"{clip_id}.js", f"{clip_id}.mp4"}
            film = folder / "media" / f"{clip_id}.mp4"
            if pictures and not film.is_file():
                film.parent.mkdir(exist_ok=True)
                half = film.with_suffix(".half.mp4")
                write_film(
                    half,
                    list(read_clip(layout.frames, row["index"], "rgb")),
                    manifest["grid"]["frame_rate_hz"],
                )
                half.replace(film)
                made += 1
            advance(row["label"])
    for left_over in (*folder.glob("clips/*"), *folder.glob("media/*")):
        if left_over.name not in wanted:
            left_over.unlink()
    return made


def _folder(layout: Layout, out: str | None) -> Path:
    if out is None and layout.origin is not None:
        raise InputError(f"{layout}: --out must name a folder for the page of a dataset in an object store")
    folder = Path(out).resolve() if out else layout.root.with_name(f"{layout.root.name}-report")
    if folder.is_relative_to(layout.root):
        raise InputError(
            f"--out {out}: must lie outside the dataset, whose files are all recorded; name another folder"
        )
    if folder.exists() and (
        not folder.is_dir() or (any(folder.iterdir()) and not (folder / "clips").is_dir())
    ):
        raise InputError(f"{folder}: must be new, empty or an earlier report; it holds other files")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _manifest_facts(manifest: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Titled rows of name, value, and whether the value is a hash."""
    grid, made_with = manifest["grid"], manifest["made_with"]
    settings = [[key, str(value), False] for key, value in grid.items() if not isinstance(value, dict | list)]
    return [
        {"title": "Run", "rows": [
            ["run_id", manifest["run_id"], True], ["seal", manifest["seal"], True],
            ["format", manifest["format"], False], ["backend", manifest["backend"], False],
        ]},
        {"title": "Grid", "rows": settings},
        {"title": "Source", "rows": [
            ["version", made_with["code"]["version"], False],
            ["source_sha256", made_with["code"]["source_sha256"], True],
        ]},
        {"title": "Inputs", "rows": [
            ["scene", manifest["scene"]["sha256"], True], *([k, v, True] for k, v in manifest["inputs"].items()),
        ]},
        {"title": "Tools", "rows": [
            [k, v, False] for k, v in (made_with["libraries"] | manifest["processor"]).items()
        ]},
        {"title": "Files", "rows": [[k, v, True] for k, v in manifest["artifacts"].items()]},
    ]  # fmt: skip


def _script(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _plotly() -> str:
    # its import takes a second, which no other command should pay
    from plotly.offline import get_plotlyjs

    source: str = get_plotlyjs()
    return source
