"""Take away the oldest datasets of a schedule: only finished ones that it made itself, and that nobody is using."""

import re
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil

from flows.scheduled.run_record import RunRecord, find_run_id, read_record, record_name
from flows.store.layout import Layout
from flows.store.lease import LOCK, hold_lease
from flows.store.lock import sole_writer
from flows.store.objects import Objects, is_address
from tasks.errors import InputError

REMOVED = ".removed-"
"""Before the name of a dataset that is being taken away."""


def dated(grid: str) -> re.Pattern[str]:
    """Names of a grid's datasets in a schedule's folder."""
    return re.compile(rf"{re.escape(grid)}-\d{{8}}T\d{{6}}Z")


def remove_oldest(grid: str, root: str, keep: int) -> tuple[list[str], list[str]]:
    """Remove the oldest of a schedule's datasets; returns the names of the removed and of those that are in use.

    A dataset counts, and may go, where its manifest is there and carries the run id in the record that the schedule
    wrote when it made it. One that is being written, audited or repaired (its lock), or of which a process of this
    machine that we may look into has a file open, stays until the next time.

    Parameters
    ----------
    grid : name of the grid
    root : folder of the schedule, or its address
    keep : how many stay [1]
    """
    find, remove = (
        (_made_in_store, _remove_objects) if is_address(root) else (_made_in_folder, _remove_folder)
    )
    removed: list[str] = []
    used: list[str] = []
    oldest = sorted(find(root, grid))[:-keep]
    open_now = list_open_paths() if oldest and not is_address(root) else set()
    for name in oldest:
        inside = f"{Path(root).resolve() / name}/"
        is_read = any(path.startswith(inside) for path in open_now)
        (removed if not is_read and remove(root, name) else used).append(name)
    return removed, used


def _made_in_folder(root: str, grid: str) -> Iterator[str]:
    for left in Path(root).glob(f"{REMOVED}*"):  # of a run that was killed while it removed them
        name = left.name.removeprefix(REMOVED)
        if dated(grid).fullmatch(name) and left.is_dir() and not left.is_symlink():
            _end_removal(root, name)
    for folder in Path(root).iterdir():
        if not dated(grid).fullmatch(folder.name) or folder.is_symlink() or not folder.is_dir():
            continue
        with suppress(InputError, OSError):
            path = Path(root) / record_name(folder.name)
            manifest = Layout(folder).manifest
            if _is_of_record(read_record(path.read_bytes(), path), manifest.read_bytes()):
                yield folder.name


def _made_in_store(root: str, grid: str) -> Iterator[str]:
    objects = Objects(root)
    for name in filter(dated(grid).fullmatch, objects.folders()):
        if _is_of_record(
            read_record(objects.read(record_name(name)), name), objects.read(f"{name}/manifest.json")
        ):
            yield name


def _is_of_record(record: RunRecord | None, manifest: bytes | None) -> bool:
    """Whether a dataset is finished, and the one that the record names."""
    if record is None or manifest is None:
        return False
    run_id = find_run_id(manifest, "manifest")
    return run_id is not None and run_id == record.run_id


def _remove_folder(root: str, name: str) -> bool:
    folder = Path(root) / name
    gone = folder.with_name(f"{REMOVED}{name}")
    try:
        with sole_writer(Layout(folder)):
            folder.rename(gone)  # at once, so that nobody meets a half of it
    except (InputError, OSError):
        return False
    _end_removal(root, name)
    return True


def _end_removal(root: str, name: str) -> None:
    """Remove what is left of a dataset that has its other name; the folder last, from which the next run goes on."""
    (Path(root) / record_name(name)).unlink(missing_ok=True)
    shutil.rmtree(Path(root) / f"{REMOVED}{name}", ignore_errors=True)


def _remove_objects(root: str, name: str) -> bool:
    objects = Objects(f"{root}/{name}")
    try:
        with hold_lease(objects):
            # without its plan nothing takes it for a run to go on with; with its manifest the next time ends this
            objects.remove(["plan.json"])
            objects.remove(objects.sizes().keys() - {"manifest.json", LOCK})
            objects.remove(["manifest.json"])
    except InputError:
        return False
    Objects(root).remove([record_name(name)])
    return True


def list_open_paths() -> set[str]:
    """Files that processes of this machine have open, and folders in which they work, as far as we may look."""
    found: set[str] = set()
    for process in psutil.process_iter():
        with suppress(psutil.Error, OSError):
            found |= {f"{process.cwd()}/", *(entry.path for entry in process.open_files())}
    return found
