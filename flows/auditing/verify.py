"""Are the files of a dataset those recorded, and what did killed runs leave behind? Hashes only, nothing is made."""

from pathlib import Path
from typing import Any

from flows.auditing.signing import signature_findings
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_writing, want_everything, want_record
from flows.store.layout import Layout
from flows.store.links import foreign_entries
from flows.store.lock import sole_writer
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.staging import BEGUN, left_overs, remove_left_overs, remove_staging
from manifests.manifest import damaged_files, manifest_damage, recorded_files
from manifests.signing import ENVELOPE
from tasks.errors import InputError

READ_AS_DATA = ("telemetry/", "frames.zarr/")
"""Where a file that nobody recorded would still be read as data."""


def verify_dataset(dataset: str, *, key: str | None = None, out: str | None = None) -> dict[str, Any]:
    """Compare every file of a dataset with its recorded hash, and the manifest with its seal and a signature.

    Parameters
    ----------
    dataset : a sealed dataset folder
    key : file with the signer's Ed25519 public key in PEM; None checks no signature
    out : folder for ``verify.json``; None writes none

    Returns
    -------
    ``verified``; ``signed`` and ``signature``, as of `signature_findings`; ``files`` compared;
    ``damaged[]`` with ``path``, ``clip_id`` and ``damage``; ``unrecorded[]``,
    files in the folder that the manifest does not know: among the data they are damage, elsewhere they are not.

    Raises
    ------
    InputError
        If the folder is no sealed dataset of this format, or the key is none.
    """
    results = Outputs(out, "verify", "verify.json")
    with open_for_writing(dataset, want_everything) as layout:
        signature = signature_findings(layout, key)
        result = run_as_stage(compare_files)(layout) | signature
    result["verified"] = result["verified"] and result["signed"] is not False
    results.write_json("verify.json", result)
    return result


def compare_files(layout: Layout) -> dict[str, Any]:
    """Return the result of `verify_dataset` for files that are at hand."""
    foreign = foreign_entries(layout.root)
    damaged: list[dict[str, str | None]] = [
        {"path": path, "clip_id": None, "damage": "a link, or no file"} for path in foreign
    ]
    is_there = layout.manifest.is_file() and not layout.manifest.is_symlink()
    fault = manifest_damage(layout.manifest.read_bytes()) if is_there else None
    if fault is not None:
        # nothing that a changed manifest says of the other files can be relied on
        damaged.append({"path": "manifest.json", "clip_id": None, "damage": fault})
        return {"verified": False, "files": 1, "damaged": damaged, "unrecorded": []}
    manifest = read_manifest(layout)
    recorded = recorded_files(manifest)
    present = {layout.relative(path) for path in layout.root.rglob("*") if path.is_file()}
    unrecorded = sorted(present - recorded.keys() - {"manifest.json", ENVELOPE})
    damaged += [row for row in damaged_files(layout.root, manifest) if row["path"] not in foreign]
    damaged += [
        {"path": path, "clip_id": None, "damage": "not recorded"}
        for path in unrecorded
        if path.startswith(READ_AS_DATA) and path not in foreign
    ]
    return {
        "verified": not damaged,
        "files": len(recorded) + 1,
        "damaged": damaged,
        "unrecorded": unrecorded,
    }


def collect_garbage(dataset: str, *, dry_run: bool = False) -> dict[str, Any]:
    """Remove what killed runs left: half-written files, scratch folders, and a finished dataset's staged files.

    Committed clips of an unfinished dataset stay, and so does a scratch folder that a live run holds. Only what muSync
    itself names so is removed, from the dataset's own folder.

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
        If the folder is no dataset or holds links, or another run is writing it.
    """
    with open_for_writing(dataset, want_record) as layout:
        return _remove_from(layout, dry_run)


def _remove_from(layout: Layout, dry_run: bool) -> dict[str, Any]:
    finished, begun = layout.manifest.is_file(), (layout.staging / BEGUN).is_file()
    if not layout.plan.is_file() and not finished:
        raise InputError(
            f"{layout}: must be a muSync dataset; it has neither plan.json nor manifest.json"
            + (": the run that began it goes on with the same musync generate command" if begun else "")
        )
    with sole_writer(layout):
        found = left_overs(layout)
        size = sum(_count_bytes(path) for path in found)
        if not dry_run:
            remove_left_overs(layout)
        elif finished:
            remove_staging(layout)
    return {"removed": sorted(str(path) for path in found), "bytes": size, "dry_run": dry_run}


def _count_bytes(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())
