"""Are the files of a dataset those recorded, and what did killed runs leave behind? Hashes only, nothing is made."""

import shutil
from pathlib import Path
from typing import Any

from flows.running.orchestration import stage
from flows.store.address import everything, stored_record, withdraw, working
from flows.store.layout import Layout, clear_partial_files, write_json
from flows.store.lock import sole_writer
from flows.store.sealed import read_manifest
from manifests.manifest import damaged_files, manifest_damage, recorded_files
from tasks.errors import InputError

SCRATCH_PREFIXES = (".audit-", ".repair-")
"""Folders beside a dataset in which clips are made again."""
READ_AS_DATA = ("telemetry/", "frames.zarr/")
"""Where a file that nobody recorded would still be read as data."""


def verify(dataset: str, *, out: str | None = None) -> dict[str, Any]:
    """Compare every file of a dataset with its recorded hash, and the manifest with its own seal.

    Parameters
    ----------
    dataset : a sealed dataset folder
    out : folder for ``verify.json``; None writes none

    Returns
    -------
    ``verified``; ``files`` compared; ``damaged[]`` with ``path``, ``clip_id`` and ``damage``; ``unrecorded[]``,
    files in the folder that the manifest does not know: among the data they are damage, elsewhere they are not.

    Raises
    ------
    InputError
        If the folder is no sealed dataset of this format.
    """
    with working(dataset, everything) as layout:
        result = stage(compare_files)(layout)
    if out is not None:
        write_json(Path(out) / "verify.json", result)
    return result


def compare_files(layout: Layout) -> dict[str, Any]:
    """What `verify` returns."""
    fault = manifest_damage(layout.manifest.read_bytes()) if layout.manifest.is_file() else None
    if fault is not None:
        # nothing that a changed manifest says of the other files can be relied on
        damaged = [{"path": "manifest.json", "clip_id": None, "damage": fault}]
        return {"verified": False, "files": 1, "damaged": damaged, "unrecorded": []}
    manifest = read_manifest(layout)
    recorded = recorded_files(manifest)
    present = {layout.relative(path) for path in layout.root.rglob("*") if path.is_file()}
    unrecorded = sorted(present - recorded.keys() - {"manifest.json"})
    damaged = damaged_files(layout.root, manifest) + [
        {"path": path, "clip_id": None, "damage": "not recorded"}
        for path in unrecorded
        if path.startswith(READ_AS_DATA)
    ]
    return {
        "verified": not damaged,
        "files": len(recorded) + 1,
        "damaged": damaged,
        "unrecorded": unrecorded,
    }


def gc(dataset: str, *, dry_run: bool = False) -> dict[str, Any]:
    """Remove what killed runs left: half-written files, a finished dataset's staging, scratch folders beside it.

    Committed clips of an unfinished dataset stay, and so does a scratch folder that a live run holds.

    Parameters
    ----------
    dataset : dataset folder, finished or not
    dry_run : name the left-overs and leave them

    Returns
    -------
    ``removed[]`` paths, and how many ``bytes`` they hold.

    Raises
    ------
    InputError
        If the folder is no dataset, or another run is writing it.
    """
    with working(dataset, stored_record) as layout:
        return _collect(layout, dry_run)


def _collect(layout: Layout, dry_run: bool) -> dict[str, Any]:
    if not layout.plan.is_file() and not layout.manifest.is_file():
        raise InputError(f"{layout}: must be a muSync dataset; it has neither plan.json nor manifest.json")
    with sole_writer(layout):
        found = [path for path in layout.root.rglob("*.partial*") if layout.staging not in path.parents]
        found += [path for path in layout.staging.glob("*") if _left_in_staging(layout, path)]
        found += [path for path in layout.root.parent.iterdir() if _abandoned(path)]
        size = sum(_bytes(path) for path in found)
        if not dry_run:
            clear_partial_files(layout)
            withdraw(layout, [path for path in found if layout.staging in path.parents])
            for path in found:
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        if layout.manifest.is_file() and not (dry_run and found):
            shutil.rmtree(layout.staging)
    return {"removed": sorted(str(path) for path in found), "bytes": size, "dry_run": dry_run}


def _left_in_staging(layout: Layout, path: Path) -> bool:
    """In a finished dataset nothing is staged any more; in an unfinished one only half-written files are waste."""
    return path.name != "lock" and (layout.manifest.is_file() or ".partial" in path.name)


def _abandoned(path: Path) -> bool:
    """Whether a scratch folder belongs to no live run; one without a lock is just being made, or no scratch."""
    if not (path.is_dir() and path.name.startswith(SCRATCH_PREFIXES)):
        return False
    scratch = Layout(path)
    if not (scratch.staging / "lock").is_file():
        return False
    try:
        with sole_writer(scratch):
            return True
    except InputError:
        return False


def _bytes(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())
