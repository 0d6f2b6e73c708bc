"""How far datasets are: from their plans, the clips that are committed, their locks, and the records of their runs.

No server is asked and nothing is written.
"""

import fcntl
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Any

from catalogs.documents import parse_json
from flows.running.terminal import escape_controls
from flows.scheduled.failure_report import REPORTS
from flows.scheduled.progress_of_clips import Seen, describe_seen
from flows.scheduled.run_record import read_record, record_name
from flows.store.layout import Layout
from flows.store.lease import LOCK, RENEW_S, WATCH_S
from flows.store.objects import Objects, is_address
from flows.store.staging import BEGUN
from manifests.records import PlanRecord, check_record
from tasks.errors import InputError

SHOWN = 5
"""Reports of failures, the latest."""
NAMED = 8
"""Clips that a sentence names."""


def report_status(out: str) -> dict[str, Any]:
    """The state of a dataset, or of every dataset in a schedule's folder.

    Parameters
    ----------
    out : dataset or folder of a schedule, or its address in an object store

    Returns
    -------
    ``place``, ``datasets[]`` (``dataset``, ``state``, ``clips``, ``done``, ``left_s``, ``failed``, ``missing`` and
    ``error``; see `flows.scheduled.progress_of_clips.describe_seen`) and ``failures[]``, the latest reports of runs
    that failed.

    Raises
    ------
    InputError
        If there is neither a dataset nor a report.
    """
    datasets, failures = _look_in_store(out) if is_address(out) else _look_in_folder(Path(out).resolve())
    if not datasets and not failures:
        raise InputError(
            f"{out}: there is no muSync dataset, neither begun nor finished, and no schedule has written here; give the"
            " --out of musync generate or musync schedule"
        )
    now = time.time()
    return {
        "place": out,
        "datasets": [describe_seen(seen, now) for seen in datasets],
        "failures": failures,
    }


def _look_in_folder(out: Path) -> tuple[list[Seen], list[dict[str, str]]]:
    if _is_dataset(out):
        return [_see_folder(out, out.parent)], []
    inside = (path for path in out.iterdir() if not path.is_symlink()) if out.is_dir() else iter(())
    datasets = [_see_folder(path, out) for path in sorted(inside) if path.is_dir() and _is_dataset(path)]
    reports = sorted((path for path in (out / REPORTS).glob("*Z.txt") if path.is_file()), reverse=True)
    return datasets, [_read_report(path.read_bytes()) for path in reports[:SHOWN]]


def _is_dataset(folder: Path) -> bool:
    layout = Layout(folder)
    return any(path.is_file() for path in (layout.plan, layout.manifest, layout.staging / BEGUN))


def _see_folder(folder: Path, root: Path) -> Seen:
    layout, lock = Layout(folder), Layout(folder).staging / "lock"
    receipts = {}
    for path in layout.staging.glob("*.json") if layout.staging.is_dir() else ():
        with suppress(OSError):  # the dataset is finished in this moment
            receipts[path.stem] = path.stat().st_mtime
    running = _is_locked(lock)
    record = root / record_name(folder.name)
    return Seen(
        name=folder.name,
        clips=_read_plan(layout.plan.read_bytes() if layout.plan.is_file() else None, layout.plan),
        receipts=receipts,
        finished=layout.manifest.is_file(),
        running=running,
        since=lock.stat().st_mtime if running and lock.is_file() else None,
        record=read_record(record.read_bytes() if record.is_file() else None, record),
    )


def _is_locked(lock: Path) -> bool:
    """Whether a writer holds a lock file; asking takes a shared lock for some microseconds."""
    try:
        descriptor = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without such locks
        return False
    finally:
        os.close(descriptor)
    return False


def _look_in_store(out: str) -> tuple[list[Seen], list[dict[str, str]]]:
    address = out.rstrip("/")
    objects = Objects(address)
    names = sorted(objects.sizes())
    folders: dict[str, list[str]] = {}
    for name in names:
        first, _, rest = name.partition("/")
        folders.setdefault(first, []).append(rest)
    if _is_stored_dataset(names):
        parent, _, name = address.rpartition("/")
        root = Objects(parent) if "/" in parent.partition("://")[2] else None
        return [_see_objects(objects, "", name, names, root, _find_renewed(objects, names))], []
    found = {name: held for name, held in folders.items() if _is_stored_dataset(held)}
    renewed = _find_renewed(objects, names)
    datasets = [
        _see_objects(objects, f"{name}/", name, held, objects, renewed) for name, held in found.items()
    ]
    reports = sorted(
        (name for name in folders.get(REPORTS, []) if PurePosixPath(name).match("*Z.txt")), reverse=True
    )
    return datasets, [_read_report(objects.read(f"{REPORTS}/{name}") or b"") for name in reports[:SHOWN]]


def _is_stored_dataset(names: list[str]) -> bool:
    return bool({"plan.json", "manifest.json", f".staging/{BEGUN}"}.intersection(names))


def _see_objects(
    objects: Objects, prefix: str, name: str, names: list[str], root: Objects | None, renewed: set[str]
) -> Seen:
    staged = (
        PurePosixPath(path) for path in names if path.startswith(".staging/") and path.endswith(".json")
    )
    return Seen(
        name=name,
        clips=_read_plan(objects.read(f"{prefix}plan.json"), f"{objects.address}/{prefix}plan.json"),
        receipts={path.stem: None for path in staged},
        finished="manifest.json" in names,
        running=f"{prefix}{LOCK}" in renewed,
        since=None,
        record=None if root is None else read_record(root.read(record_name(name)), name),
    )


def _find_renewed(objects: Objects, names: list[str]) -> set[str]:
    """Locks that their owners renew while we watch: for two renewals at most."""
    locks = {name for name in names if name == LOCK or name.endswith(f"/{LOCK}")}
    before = {name: objects.tag(name) for name in locks}
    renewed: set[str] = set()
    until = time.monotonic() + 2 * RENEW_S
    while renewed != locks and time.monotonic() < until:
        time.sleep(WATCH_S)
        for name in locks - renewed:
            now = objects.tag(name)
            if now is None:  # its run has ended
                locks.discard(name)
            elif now != before[name]:
                renewed.add(name)
    return renewed


def _read_plan(content: bytes | None, origin: object) -> dict[str, str] | None:
    """Label of each planned clip by its id; None where there is no plan, or a damaged one."""
    if content is None:
        return None
    try:
        plan = check_record(PlanRecord, parse_json(content, origin, "plan"), origin)
    except InputError:
        return None
    return {clip["clip_id"]: clip["label"] for clip in plan["clips"]}


def _read_report(content: bytes) -> dict[str, str]:
    lines = (line.partition(": ") for line in content.decode(errors="replace").splitlines())
    values = {key: value for key, found, value in lines if found}
    return {key: values.get(key, "") for key in ("scheduled", "error")}


def format_text(result: Mapping[str, Any]) -> str:
    """A line for each dataset, and for each run that failed."""
    lines = [line for row in result["datasets"] for line in _describe_row(row)]
    lines += [f"failed run of {row['scheduled']}: {row['error']}" for row in result["failures"]]
    return "\n".join(map(escape_controls, lines)) + "\n"


def _describe_row(row: Mapping[str, Any]) -> Iterator[str]:
    clips = "" if row["clips"] is None else f", {row['done']} of {row['clips']} clips"
    left = "" if row["left_s"] is None else f", about {format_duration(row['left_s'])} left"
    yield f"{row['dataset']}: {row['state']}{clips}{left}"
    for key in ("failed", "missing"):
        if row[key]:
            rest = len(row[key]) - NAMED
            yield f"  {key}: {', '.join(row[key][:NAMED])}" + (f" and {rest} more" if rest > 0 else "")
    if row["error"]:
        yield f"  ended by: {row['error']}"


def format_duration(duration_s: float) -> str:
    """A time in the largest unit that gives a number above one; ``duration_s`` in [s]."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if duration_s >= 1.5 * size:
            return f"{duration_s / size:.0f} {unit}"
    return f"{duration_s:.0f} s"
