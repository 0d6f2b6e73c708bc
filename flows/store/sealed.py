"""Reading what a dataset records of itself: the one door for its plan, receipts and manifest."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from catalogs.documents import LARGEST_JSON, parse_json, read_content
from catalogs.grids import GridFile
from catalogs.grids.form import BEFORE
from catalogs.sentences import cap_problems, describe_rules, shorten_value
from flows.store.arrays import EVERY_ARRAY
from flows.store.layout import OBJECTS, RECORD, STAGED_TABLES, Layout, read_json
from flows.store.telemetry import content_hash, labelled_field, read_table, table_columns
from manifests.canonical import sha256_of_file
from manifests.manifest import MANIFEST_FORMAT, head_of_sealed, is_sealed
from manifests.records import Manifest, ManifestHead, PlanRecord, Receipt, check_record
from tasks.conventions import FRAME_CHANNELS, TICK_CHANNELS
from tasks.errors import InputError

PLAN_FORMAT = "musync-plan/2"


def read_manifest(layout: Layout, *, sealed: bool = True) -> Manifest:
    """The manifest of a sealed dataset.

    Parameters
    ----------
    layout : of the dataset
    sealed : refuse one that was changed after it was sealed; False for who reports that itself

    Raises
    ------
    InputError
        If the run is unfinished, or the manifest is missing, of another format, breaks a rule, or was changed.
    """
    _refuse_without_manifest(layout)
    content = read_content(layout.manifest, RECORD, LARGEST_JSON)
    return _check_content(content, layout.manifest, sealed=sealed)


def read_manifest_head(layout: Layout) -> ManifestHead:
    """The manifest of a sealed dataset without its clips, which are neither parsed nor checked.

    That is what a reader of the tables needs. The rest has the same form as with `read_manifest`.

    Raises
    ------
    InputError
        As `read_manifest` raises it.
    """
    _refuse_without_manifest(layout)
    content = read_content(layout.manifest, RECORD, LARGEST_JSON)
    head = head_of_sealed(content)
    if head is None:
        return _check_content(content, layout.manifest, sealed=True)
    parsed = parse_json(head, layout.manifest, RECORD)
    record = check_record(ManifestHead, _of_format(parsed, MANIFEST_FORMAT, layout.manifest), layout.manifest)
    recorded_grid(record["grid"], layout.manifest)
    return record


def require_frames(manifest: Mapping[str, Any], origin: object, *, stored: bool = False) -> None:
    """Raise `InputError` for a dataset of telemetry alone.

    Parameters
    ----------
    manifest : of the dataset
    origin : what messages call it
    stored : refuse one whose frames are made when they are read, too
    """
    if stored and manifest["grid"].get("pictures", True) == "later":
        raise InputError(
            f"{origin}: the dataset makes its frames when they are read (--frames later), and this needs them stored:"
            " generate its grid with stored frames into another folder"
        )
    if not manifest["grid"].get("pictures", True):
        raise InputError(
            f"{origin}: the dataset was made without frames (--no-frames), which this needs:"
            " generate its grid with them into another folder"
        )


def refuse_changed_files(layout: Layout, recorded: Mapping[str, str]) -> None:
    """Hold files of a finished dataset against their recorded hashes, 1.7 GB a second.

    Parameters
    ----------
    layout : of the dataset
    recorded : path in the dataset to SHA-256

    Raises
    ------
    InputError
        Listing every file that is missing or changed.
    """
    changed = {
        name: "changed" if (layout.root / name).is_file() else "missing"
        for name, digest in recorded.items()
        if not (layout.root / name).is_file() or sha256_of_file(layout.root / name) != digest
    }
    if changed:
        raise InputError(
            cap_problems(
                [
                    f"{layout}/{name}: must be as recorded; it is {how}: musync lab repair makes it again"
                    for name, how in changed.items()
                ]
            )
        )


def refuse_changed_clips(
    layout: Layout, manifest: Mapping[str, Any], clips: Sequence[Mapping[str, Any]], table: str
) -> None:
    """Hold pictures and road users of clips, and the files of a table with their rows, against the recorded hashes.

    Parameters
    ----------
    layout, manifest : of the dataset
    clips : records of those that are shown
    table : ticks or frames

    Raises
    ------
    InputError
        Listing every file that is missing or changed.
    """
    families = tuple({f"telemetry/{table}/family={clip['scenario']['weather']}/" for clip in clips})
    tables = {name: digest for name, digest in manifest["artifacts"].items() if name.startswith(families)}
    pictures = {
        name: digest
        for clip in clips
        for name, digest in clip["artifacts"].items()
        if name.startswith(("frames.zarr/rgb/", "telemetry/objects/"))
    }
    refuse_changed_files(layout, tables | pictures)


def refuse_changed_content(
    layout: Layout, manifest: Mapping[str, Any], clips: Sequence[Mapping[str, Any]]
) -> None:
    """Hold all that a dataset has of some clips, and its tables, against the recorded hashes.

    Parameters
    ----------
    layout, manifest : of the dataset
    clips : records of those that are judged or handed on

    Raises
    ------
    InputError
        Listing every file that is missing or changed.
    """
    own = {name: digest for clip in clips for name, digest in clip["artifacts"].items()}
    refuse_changed_files(layout, manifest["artifacts"] | own)


def _refuse_without_manifest(layout: Layout) -> None:
    if layout.manifest.exists():
        return
    if layout.plan.is_file():
        clips = read_plan_record(layout)["clips"]
        done = sum(layout.receipt(clip["clip_id"]).is_file() for clip in clips)
        raise InputError(
            f"{layout}: the dataset must be finished; {done} of {len(clips)} clips are made:"
            " run its musync generate command again"
        )
    raise InputError(
        f"{layout}: must be a finished dataset; it has no {layout.manifest.name}: name another folder, or make"
        " a dataset with musync generate"
    )


def check_manifest(content: Any, origin: object) -> Manifest:
    """A parsed manifest, typed.

    Parameters
    ----------
    content : parsed JSON
    origin : what messages call it

    Raises
    ------
    InputError
        If it is of another format, or breaks a rule.
    """
    manifest = check_record(Manifest, _of_format(content, MANIFEST_FORMAT, origin), origin)
    recorded_grid(manifest["grid"], origin)
    return manifest


def _check_content(content: bytes, origin: Path, *, sealed: bool) -> Manifest:
    manifest = check_manifest(parse_json(content, origin, RECORD), origin)
    if sealed and not is_sealed(content):
        raise InputError(
            f"{origin}: must be as it was sealed; it was changed, so that nothing it records can be relied on:"
            " put back a copy of it, or generate the grid again into another folder"
        )
    return manifest


def read_plan_record(layout: Layout) -> PlanRecord:
    """The plan of a dataset, finished or not.

    Raises
    ------
    InputError
        If it is missing, of another format, or breaks a rule.
    """
    return check_record(PlanRecord, _of_format(read_json(layout.plan), PLAN_FORMAT, layout.plan), layout.plan)


def read_receipt(layout: Layout, clip_id: str) -> Receipt:
    """The receipt of a clip that is made and not yet sealed.

    Raises
    ------
    InputError
        If it is missing, breaks a rule, or is that of another clip.
    """
    path = layout.receipt(clip_id)
    receipt = check_record(Receipt, read_json(path), path)
    arrays = EVERY_ARRAY.keys() & receipt["content"].keys()
    files = [layout.frame_shard(name, receipt["index"]) for name in arrays]
    files += [layout.object_table(receipt["index"])] if OBJECTS in receipt["content"] else []
    if receipt["clip_id"] != clip_id or receipt["artifacts"].keys() != set(map(layout.relative, files)):
        raise InputError(
            f"{path}: must be the receipt of clip {clip_id} and name its files; it is another: remove it"
        )
    return receipt


def is_committed(layout: Layout, planned: Mapping[str, Any], rows: Mapping[str, int]) -> bool:
    """Whether a clip need not be made again: its receipt is sound and of the plan, and its files are of the receipt.

    Held against it are the hashes of its pictures, and rows, values and labels of its tables. In an object store
    the receipt is sent last and stands for the rest. That the values follow from the inputs is seen by an audit alone.

    Parameters
    ----------
    layout : the dataset
    planned : the clip as the plan records it
    rows : of a clip by table [1]
    """
    clip_id = planned["clip_id"]
    if not layout.receipt(clip_id).is_file():
        return False
    try:
        receipt = read_receipt(layout, clip_id)
        if {**receipt, **planned} != receipt:
            return False
        if layout.origin is None:
            for table in STAGED_TABLES:
                if not _is_table_of(layout.staged(clip_id, table), table, receipt, rows[table]):
                    return False
            refuse_changed_files(layout, receipt["artifacts"])
    except (InputError, OSError):
        return False
    return True


def _is_table_of(path: Path, table: str, receipt: Receipt, rows: int) -> bool:
    """Whether a staged table has the values and labels of a receipt; raises `InputError` if it cannot be read."""
    held = read_table(path, most=rows)
    columns = table_columns(held)
    if len(held) != rows or content_hash(table, columns) != receipt["content"][table]:
        return False
    names = {
        "clip_id": receipt["clip_id"],
        "label": receipt["label"],
        "weather": receipt["scenario"]["weather"],
    }
    repeated = names | receipt["figures"]
    hashed = {channel.name for channel in (*FRAME_CHANNELS, *TICK_CHANNELS)}
    return all(
        labelled_field(field.name, field.type).equals(field, check_metadata=True)
        and (
            field.name in hashed
            or (field.name in repeated and held[field.name].unique().to_pylist() == [repeated[field.name]])
        )
        for field in held.schema
    )


def recorded_grid(content: Mapping[str, Any], origin: object) -> GridFile:
    """The settings that a plan, manifest or frozen run records; a setting that it does not know is as it was before.

    Raises
    ------
    InputError
        Listing every key that breaks a rule.
    """
    try:
        return GridFile.model_validate({**BEFORE, **content})
    except ValidationError as error:
        raise InputError(cap_problems(describe_rules(error, f"{origin}: grid"))) from None


def _of_format(content: Any, wanted: str, origin: object) -> Any:
    found = content.get("format") if isinstance(content, dict) else None
    if found != wanted:
        raise InputError(
            f"{origin}: must be of format {wanted}; it is {shorten_value(found)}:"
            " read the dataset with the version of muSync that wrote it, or make it again"
        )
    return content
