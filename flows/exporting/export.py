"""``musync export``: a finished dataset in another format, written whole or not at all."""

import os
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from catalogs.variants import warn_of_variant
from flows.exporting.camera import describe_camera
from flows.exporting.dataset import TICK_COLUMNS, ExportedDataset, describe_columns
from flows.exporting.formats import FORMAT_NAMES, FORMATS, ExportFormat
from flows.making.input_changes import refuse_changed_records
from flows.reading.previews import select_clips
from flows.reading.suggestions import suggest_names
from flows.running.progress import progress_bar
from flows.store.address import is_address, open_for_reading
from flows.store.layout import write_folder, write_json
from flows.store.outputs import find_dataset_problems
from flows.store.sealed import read_manifest, refuse_changed_content
from manifests.manifest import is_quarantined
from tasks.errors import InputError

Writer = Callable[[ExportedDataset, Path], None]
CARD = "musync-export.json"


def export_dataset(
    dataset: str, to: str, *, out: str | None = None, clips: list[str] | None = None
) -> dict[str, Any]:
    """Write a dataset in another format.

    Parameters
    ----------
    dataset : a finished dataset
    to : name of the format
    out : folder, new or empty; None takes ``DATASET-FORMAT`` beside the dataset
    clips : labels or ids; None takes all that are not in quarantine, and all for a format of whole files

    Returns
    -------
    ``folder``, ``format``, ``clips``, ``left_out`` (labels in quarantine), ``files``, ``megabytes``

    Raises
    ------
    InputError
        For an unknown format or clip, a dataset that lacks what the format needs or is not as recorded, a package that
        is not installed, or a folder that holds something.
    """
    chosen = find_format(to)
    writer = import_writer(chosen)
    layout = open_for_reading(dataset)
    manifest = read_manifest(layout)
    rows: Sequence[Mapping[str, Any]] = manifest["clips"]
    kept, left_out = (list(rows), []) if chosen.whole else part_quarantined(rows)
    if clips:
        kept, left_out = select_clips(rows, clips, dataset), []
    folder = choose_folder(dataset, to, out)
    problems = [
        *([] if kept else [f"{dataset}: every clip is in quarantine; name clips with --clip to export them"]),
        *_find_picture_problems(chosen, manifest, dataset),
    ]
    if chosen.whole and len(kept) < len(rows):
        problems.append(
            f"{dataset}: --to {to} copies the dataset's own files and takes all {len(rows)} clips;"
            f" {len(kept)} are asked for: leave --clip out"
        )
    if problems:
        raise InputError(problems)
    refuse_changed_records(layout, manifest)
    refuse_changed_content(layout, manifest, kept)
    with write_folder(folder) as partial, progress_bar("clips", len(kept)) as advance:
        exported = ExportedDataset(layout=layout, manifest=manifest, rows=kept, finish=advance)
        writer(exported, partial)
        write_json(partial / CARD, describe_export(exported, to))
        sizes = [path.stat().st_size for path in partial.rglob("*") if path.is_file()]
    return {
        "folder": str(folder),
        "format": to,
        "clips": len(kept),
        "left_out": left_out,
        "files": len(sizes),
        "megabytes": round(sum(sizes) / 1e6, 1),
    }


def find_format(name: str) -> ExportFormat:
    """Return the format of this name.

    Raises
    ------
    InputError
        If there is none, with the names that come near.
    """
    found = next((row for row in FORMATS if row.name == name), None)
    if found is None:
        raise suggest_names("--to: format", [name], FORMAT_NAMES, "musync export --help")
    return found


def import_writer(chosen: ExportFormat) -> Writer:
    """Return the function that writes a format.

    Raises
    ------
    InputError
        If a package that it needs is not installed.
    """
    if chosen.package and find_spec(chosen.package) is None:
        raise InputError(
            f"--to {chosen.name}: needs the package {chosen.package}, which is not installed:"
            " pip install 'musync-gs[export]'"
        )
    module, _, name = chosen.writer.partition(":")
    writer: Writer = getattr(import_module(f"flows.exporting.{module}"), name)
    return writer


def part_quarantined(rows: Sequence[Mapping[str, Any]]) -> tuple[list[Mapping[str, Any]], list[str]]:
    """Return the clips whose pose check did not fail, and the labels of the others."""
    kept = [row for row in rows if not is_quarantined(row)]
    return kept, [row["label"] for row in rows if is_quarantined(row)]


def choose_folder(dataset: str, to: str, out: str | None) -> Path:
    """Return the folder of an export, outside any dataset and with nothing in it yet.

    Raises
    ------
    InputError
        If it is none of these.
    """
    if out is None and is_address(dataset):
        raise InputError("--out: must name a folder where the dataset lies in an object store")
    root = Path(dataset).resolve()
    folder = root.with_name(f"{root.name}-{to}") if out is None else Path(out)
    if problems := find_dataset_problems(f"--out {folder}", folder):
        raise InputError(problems)
    if os.path.lexists(folder) and (folder.is_symlink() or not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"--out {folder}: must be new or an empty folder; name another one or remove it")
    return folder


def _find_picture_problems(chosen: ExportFormat, manifest: Mapping[str, Any], dataset: str) -> list[str]:
    if not chosen.pictures or manifest["grid"].get("pictures", True):
        return []
    without = ", ".join(row.name for row in FORMATS if not row.pictures)
    return [
        f"{dataset}: --to {chosen.name} needs frames; the dataset was made with --no-frames, which suits {without}"
    ]


def describe_export(dataset: ExportedDataset, to: str) -> dict[str, Any]:
    """Return the content of ``musync-export.json``: run, seal, camera, units, and each clip's scenario and figures.

    Parameters
    ----------
    dataset : that is exported
    to : name of the format
    """
    variant = dataset.plan.settings.variant
    return {
        "format": to,
        "dataset": dataset.name,
        "run_id": dataset.manifest["run_id"],
        "seal": dataset.manifest["seal"],
        "variant": variant,
        **({"warning": warning} if (warning := warn_of_variant(variant)) else {}),
        "frame_rate_hz": dataset.frame_rate_hz,
        "camera": describe_camera(dataset.camera),
        "columns": describe_columns(TICK_COLUMNS),
        "clips": [
            {
                key: row[key]
                for key in ("index", "clip_id", "label", "split", "scenario", "figures", "verdict")
            }
            | ({"camera": describe_camera(dataset.camera_of(row))} if dataset.camera.varies else {})
            for row in dataset.rows
        ],
    }
