"""A dataset as a page for analysts: films, traces and verdicts, opened without a server."""

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from io import BytesIO
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.grids.form import TICK_RATE_HZ
from catalogs.variants import warn_of_variant
from flows.making.input_changes import refuse_changed_records
from flows.making.plan import Plan
from flows.making.seal import pick_evenly
from flows.pages.figures import STYLE_SHEET, Figure, Panel, as_plotly
from flows.pages.writer import FILES, fill_template, read_plotly
from flows.reading.film import write_film
from flows.reading.frames import Frames, open_frames
from flows.reading.previews import select_clips
from flows.running.progress import progress_bar
from flows.running.runner import open_executor, run_unordered
from flows.store.address import open_for_reading
from flows.store.layout import Layout, list_abandoned
from flows.store.object_tables import read_objects
from flows.store.outputs import MARKER, Outputs, read_marker
from flows.store.sealed import read_manifest, recorded_grid, refuse_changed_clips
from flows.store.telemetry import read_columns
from manifests.manifest import describe_scenes, is_driven, list_scenes
from manifests.siblings import iterate_pairs
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.render.traces import TRACES

COMMAND = "report"
BOX = ("frame", "kind", "box_left", "box_top", "box_right", "box_bottom")
PAGE = Path(__file__).parent / "report_page"
SCRIPTS = {"page.js": FILES, "traces.js": PAGE, "report.js": PAGE}
FILTERS = {
    "weather": "Weather", "hazard": "Road", "verdict": "Pose check", "calibration": "Calibrated range",
    "split": "Split",
}  # fmt: skip
PANEL_PX = 110
OF_A_CLIP = re.compile(r"clips/\w+\.js|media/\w+\.mp4")
"""Files that go when their clip does."""
TRACED_CLIPS = 200
"""Larger datasets list every clip and bring the traces and films of so many, evenly spread, unless some are named."""
DECIMALS = {"km/h": 1, "deg": 2, "kN": 2, "MPa": 2, "": 3}


def make_report(dataset: str, *, out: str | None = None, clips: list[str] | None = None) -> dict[str, Any]:
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
        The folder holds no finished dataset, its camera, plan or a table is not as recorded, a clip is not in it, or
        the page's folder holds other files.
    """
    layout = open_for_reading(dataset)
    manifest = read_manifest(layout)
    refuse_changed_records(layout, manifest)
    rows, ticks = manifest["clips"], Plan.of(manifest, layout.manifest).ticks_per_clip
    brought = select_clips(rows, clips, dataset) if clips else pick_evenly(rows, TRACED_CLIPS)
    refuse_changed_clips(layout, manifest, brought, "ticks")
    folder = _choose_folder(layout, out)
    pictures = manifest["grid"].get("pictures", True)
    data = page_data(manifest, {row["clip_id"] for row in brought}, pictures)
    data["horizon"] = locate_horizon(layout) if pictures else None
    scripts = {
        "plotly.min.js": read_plotly(),
        "data.js": f"const REPORT = {_format_script(data)};\n",
        **{name: (source / name).read_text() for name, source in SCRIPTS.items()},
    }
    fixed = scripts | {"index.html": _write_index(manifest, list(scripts))}
    of_clips = [
        name for row in brought for name in (_traces_name(row), *([_film_name(row)] if pictures else []))
    ]
    page = Outputs(folder, COMMAND, *fixed, *of_clips)
    with page.alone():
        made = _write_clips(open_frames(layout, manifest), manifest, brought, page, pictures, ticks)
        for name, content in fixed.items():
            page.write(name, content)
        page.remove_others(OF_A_CLIP.fullmatch)
    return {
        "page": str(folder / "index.html"),
        "clips": len(rows),
        "traced": len(brought),
        "films_made": made,
        "megabytes": round(sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / 1e6, 1),
    }


def _write_index(manifest: Mapping[str, Any], scripts: Sequence[str]) -> str:
    name = manifest["grid"]["name"]
    return fill_template(
        "explorer.html", folder=PAGE, title=f"{name} – muSync report", heading=name, lead=[summarise_run(manifest)],
        above="", tone="", policy="", style=STYLE_SHEET.read_text(), scripts=scripts, filters=FILTERS,
        run=_list_manifest_facts(manifest),
    )  # fmt: skip


def page_data(manifest: Mapping[str, Any], brought: set[str], pictures: bool) -> dict[str, Any]:
    """Return the page's data of all clips; telemetry is loaded clip by clip.

    Parameters
    ----------
    manifest : of the dataset
    brought : ids of the clips whose telemetry lies beside the page
    pictures : whether there are films of these
    """
    grid, rows = manifest["grid"], manifest["clips"]
    settings = recorded_grid(grid, "manifest")
    index = {row["clip_id"]: k for k, row in enumerate(rows)}
    kept = (
        "clip_id", "label", "seed", "split", "calibration", "scenario", "figures", "verdict", "content"
    )  # fmt: skip
    return {
        "frame_rate_hz": grid["frame_rate_hz"],
        "tick_rate_hz": TICK_RATE_HZ,
        "driven": is_driven(manifest["inputs"]),
        "duration_s": settings.telemetry_s,
        "panels": [
            {"column": t.column, "caption": t.caption, "unit": t.unit, "factor": t.factor,
             "decimals": DECIMALS[t.unit]}
            for t in TRACES
        ],
        "clips": [
            {key: row[key] for key in kept}
            | {
                "traced": row["clip_id"] in brought,
                "film": _film_name(row) if pictures and row["clip_id"] in brought else None,
            }
            for row in rows
        ],
        "pairs": [[index[p["clip_id_a"]], index[p["clip_id_b"]], p["control"]] for p in iterate_pairs(rows)],
        "figure": as_plotly(
            Figure(caption="", panels=[Panel(y="", lines=[]) for _ in TRACES], linked=True, panel_px=PANEL_PX)
        ),
    }  # fmt: skip


def locate_horizon(layout: Layout) -> dict[str, float] | None:
    """Return where a level car's horizon stands in the picture, and how far it moves; None without one camera.

    Parameters
    ----------
    layout : of the dataset

    Returns
    -------
    ``level``, from the top in heights of the picture [1], and ``per_slope``: by how many heights it rises per tangent
    of the body's pitch [1], for a camera that looks nearly level; a lens bends neither at the middle of the picture.
    """
    path = layout.inputs / "camera.yaml"
    if not path.is_file():
        return None
    camera = load("camera", path)
    if camera.varies:
        return None
    ahead, _, up = camera.T_rig_camera[:3, 2]
    focal, middle = camera.K[1, 1] / camera.height, camera.K[1, 2] / camera.height
    return {"level": float(middle + focal * up / ahead), "per_slope": float(focal)}


def pack_columns(columns: Mapping[str, NDArray[Any]], names: Sequence[str]) -> dict[str, Any]:
    """Columns as float64, each as eight planes of one byte of every number, deflated, in base64.

    Planes because neighbours in time share their high bytes: less than half of what deflate alone leaves.
    """
    rows = len(columns[names[0]])
    planes = [np.asarray(columns[name], "<f8").view(np.uint8).reshape(rows, 8).T for name in names]
    squeezed = zlib.compress(np.ascontiguousarray(np.stack(planes)).tobytes(), 6)
    return {"rows": rows, "columns": list(names), "packed": base64.b64encode(squeezed).decode()}


def list_boxes(
    layout: Layout, row: Mapping[str, Any], most_frames: int
) -> dict[str, list[list[float | str]]]:
    """Return by frame the kind, left, top, right and bottom [px] of each road user that the picture shows.

    Parameters
    ----------
    layout : of the dataset
    row : of the clip
    most_frames : that a clip has [1]
    """
    table = layout.object_table(row["index"])
    if layout.relative(table) not in row["artifacts"]:
        return {}
    found: dict[str, list[list[float | str]]] = {}
    columns = read_objects(layout, row["index"], most_frames)
    for frame, kind, *edges in zip(*(columns[name].tolist() for name in BOX), strict=True):
        if not isnan(edges[0]):
            found.setdefault(str(frame), []).append([kind, *edges])
    return found


def _write_clips(
    frames: Frames,
    manifest: Mapping[str, Any],
    brought: Sequence[Mapping[str, Any]],
    page: Outputs,
    pictures: bool,
    ticks: int,
) -> int:
    """Write the telemetry and make the missing films of some clips, on all processors; how many films were made."""
    filmed = {row["clip_id"] for row in brought if pictures and not page.path(_film_name(row)).is_file()}
    jobs = (
        (frames, row, ticks, manifest["grid"]["frame_rate_hz"] if row["clip_id"] in filmed else None)
        for row in brought
    )
    with progress_bar("report", len(brought)) as advance, open_executor("threads") as executor:
        for (_, row, *_), future in run_unordered(executor, _make_clip_files, jobs):
            for name, content in future.result().items():
                page.write(name, content)
            advance(row["label"])
    return len(filmed)


def _make_clip_files(
    frames: Frames, row: Mapping[str, Any], rows: int, frame_rate_hz: float | None
) -> dict[str, str | bytes | memoryview]:
    """Return the content of a clip's files by name: its telemetry, and its film where it has a frame rate."""
    clip_id, names = row["clip_id"], [channel.name for channel in TICK_CHANNELS]
    folder = frames.layout.telemetry / "ticks" / f"family={row['scenario']['weather']}"
    ticks = read_columns(folder, clip_id, names, most=rows)
    content = pack_columns(ticks, names) | {"boxes": list_boxes(frames.layout, row, rows)}
    files: dict[str, str | bytes | memoryview] = {
        _traces_name(row): f"clipArrived({_format_script(clip_id)}, {_format_script(content)});\n"
    }
    if frame_rate_hz is not None:
        film = BytesIO()
        write_film(film, list(frames.read(row["index"], "rgb")), frame_rate_hz)
        files[_film_name(row)] = film.getvalue()
    return files


def _traces_name(row: Mapping[str, Any]) -> str:
    return f"clips/{row['clip_id']}.js"


def _film_name(row: Mapping[str, Any]) -> str:
    return f"media/{row['clip_id']}.mp4"


def _choose_folder(layout: Layout, out: str | None) -> Path:
    if out is None and layout.origin is not None:
        raise InputError(f"{layout}: --out must name a folder for the page of a dataset in an object store")
    beside = layout.root.with_name(f"{layout.root.name}-report")
    if out is None and beside.is_symlink():
        raise InputError(f"{beside}: is a link; name the page's folder with --out")
    folder = Path(out).resolve() if out else beside
    halves = list_abandoned(folder, {MARKER})  # a report that was killed at its very beginning
    if folder.is_dir() and {*folder.iterdir()} - {*halves} and COMMAND not in read_marker(folder).values():
        raise InputError(
            f"{folder}: must be new, empty or an earlier report; it holds other files, or a report of an earlier"
            " version, which kept no list of its files: move it away or name another folder"
        )
    return folder


def summarise_run(manifest: Mapping[str, Any]) -> str:
    """Return the first line of the page: clips, frames, scene, vehicle, and a warning where a coupling is cut.

    Parameters
    ----------
    manifest : of the dataset
    """
    grid = manifest["grid"]
    warning = warn_of_variant(recorded_grid(grid, "manifest").variant)
    return (
        f"{len(manifest['clips'])} clips of {grid['frames']} frames on {describe_scenes(manifest)}, vehicle"
        f" {grid['vehicle']} in {grid['vehicle_mode']} mode; run {manifest['run_id']}"
        f"{f'. {warning}' if warning else ''}"
    )


def _list_manifest_facts(manifest: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return facts of the run by what they are about."""
    grid, made_with = manifest["grid"], manifest["made_with"]
    return {
        "Run": {key: manifest[key] for key in ("run_id", "seal", "format", "backend")},
        "Grid": {key: str(value) for key, value in grid.items() if not isinstance(value, dict | list)},
        "Source": {key: made_with["code"][key] for key in ("version", "source_sha256")},
        "Inputs": {f"scene {one['name']}": one["sha256"] for one in list_scenes(manifest)}
        | manifest["inputs"],
        "Tools": made_with["libraries"] | manifest["processor"],
        "Files": manifest["artifacts"],
    }


def _format_script(value: Any) -> str:
    """A value as JavaScript: in ASCII, and without what could end a script element."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
