"""Are the files of a dataset those recorded, and what did killed runs leave behind? Hashes only, nothing is made."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flows.auditing.signing import signature_findings
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_writing, want_everything, want_record
from flows.store.layout import Layout
from flows.store.links import foreign_entries
from flows.store.lock import sole_writer
from flows.store.outputs import Outputs
from flows.store.sealed import is_committed, read_manifest, read_manifest_head
from flows.store.staging import BEGUN, left_overs, remove_left_overs, remove_staging
from manifests.manifest import damaged_files, manifest_damage, recorded_files
from manifests.signing import ENVELOPE
from tasks.errors import InputError

READ_AS_DATA = ("telemetry/", "frames.zarr/", "inputs/")
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
    ``verdict``, a sentence; ``verified``; ``files``, ``intact``, ``damaged[]`` and ``unrecorded[]`` as of
    `compare_files`; ``recipes`` as of `check_recipes`; ``signed``, ``signature``, ``signers``, ``key_id`` and
    ``key_sha256`` as of `signature_findings`.

    Raises
    ------
    InputError
        If the folder is no sealed dataset of this format, or the key is none.
    """
    results = Outputs(out, "verify", "verify.json")
    with open_for_writing(dataset, want_everything) as layout:
        signature = signature_findings(layout, key)
        compared = run_as_stage(compare_files)(layout)
        recipes = check_recipes(layout) if compared["verified"] else None
    verified = (
        compared["verified"] and signature["signed"] is not False and not (recipes and recipes["damaged"])
    )
    made = [describe_recipes(recipes)] if recipes else []
    sentence = "; ".join([describe_files(compared), *made, describe_signature(signature)])
    result = {
        "verdict": f"{'verified' if verified else 'not verified'}: {sentence}",
        **compared,
        "recipes": recipes,
        **signature,
        "verified": verified,
    }
    results.write_json("verify.json", result)
    return result


def describe_files(compared: Mapping[str, Any]) -> str:
    """Return how many files are those recorded, as a clause.

    Parameters
    ----------
    compared : result of `compare_files`
    """
    files, intact, damaged = compared["files"], compared["intact"], compared["damaged"]
    of_manifest = next((row["damage"] for row in damaged if row["path"] == "manifest.json"), None)
    if of_manifest is not None:
        return f"manifest.json is {of_manifest}, so that nothing it records can be relied on"
    lost, strange = files - intact, len(damaged) - (files - intact)
    clause = (
        f"{intact} of {files} files are those recorded, {lost} {'is' if lost == 1 else 'are'} not"
        if lost
        else f"all {files} files are those recorded"
    )
    if strange:
        clause += f", and {strange} more {'lies' if strange == 1 else 'lie'} there that nobody recorded"
    return clause


def check_recipes(layout: Layout) -> dict[str, Any] | None:
    """Return what is known of frames that are made when they are read; None of a dataset without such.

    Parameters
    ----------
    layout : of a dataset whose files are those recorded

    Returns
    -------
    ``clips``, whose frames are recipes; how many of them are ``made``, in the cache of this machine's code and
    libraries; ``damaged[]``, labels of those among them whose files are not as made, or do not show the recorded motion
    """
    if read_manifest_head(layout)["grid"].get("pictures") != "later":
        return None
    # it imports what makes clips, which files alone need not wait for
    from flows.reading.recipes import open_recipes

    recipes = open_recipes(layout, read_manifest(layout))
    plan, damaged = recipes.plan, []
    made = [clip for clip in plan.clips if recipes.receipt(clip.index).is_file()]
    for clip in made:
        sound = is_committed(recipes.cache, clip.as_json(), plan.settings.rows_per_clip)
        if not sound or recipes.read_motion(clip.index) != recipes.ticks[clip.index]:
            damaged.append(clip.label)
    return {"clips": len(plan.clips), "made": len(made), "damaged": damaged}


def describe_recipes(recipes: Mapping[str, Any]) -> str:
    """Return what is known of frames that are made when they are read, as a clause.

    Parameters
    ----------
    recipes : of `check_recipes`
    """
    clause = f"the frames of {recipes['clips']} clips are recipes, {recipes['made']} of them made here"
    damaged = recipes["damaged"]
    return clause + (f", {len(damaged)} not as made: musync materialise makes them again" if damaged else "")


def describe_signature(signature: Mapping[str, Any]) -> str:
    """Return what is known of the signature, as a clause.

    Parameters
    ----------
    signature : of `signature_findings`
    """
    if signature["signed"] is None:
        return "no signature was checked"
    known = f"key {signature['key_id'][:16]}"
    return f"signed by {known}" if signature["signed"] else f"no valid signature of {known}"


def compare_files(layout: Layout) -> dict[str, Any]:
    """Compare the files at hand with the manifest, and the manifest with its seal: the one count of both commands.

    Parameters
    ----------
    layout : of a dataset

    Returns
    -------
    ``verified``; ``files`` that the record names, the manifest among them; how many of these are ``intact``;
    ``damaged[]`` with ``path``, ``clip_id`` and ``damage``; ``unrecorded[]``, files in the folder that the manifest
    does not know: among the data they are damage, elsewhere they are not.
    """
    if not layout.manifest.exists():
        read_manifest(layout)  # says what is missing, before a folder that is no dataset is walked
    foreign = foreign_entries(layout.root)
    damaged: list[dict[str, str | None]] = [
        {"path": path, "clip_id": None, "damage": "a link, or no file"} for path in foreign
    ]
    is_there = layout.manifest.is_file() and not layout.manifest.is_symlink()
    fault = manifest_damage(layout.manifest.read_bytes()) if is_there else None
    if fault is not None:
        # nothing that a changed manifest says of the other files can be relied on
        damaged.append({"path": "manifest.json", "clip_id": None, "damage": fault})
        return {"verified": False, "files": 1, "intact": 0, "damaged": damaged, "unrecorded": []}
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
    lost = {row["path"] for row in damaged} & {*recorded, "manifest.json"}
    return {
        "verified": not damaged,
        "files": len(recorded) + 1,
        "intact": len(recorded) + 1 - len(lost),
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
