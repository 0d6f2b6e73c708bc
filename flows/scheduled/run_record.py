"""The record of a schedule's run, in ``ROOT/runs/<dataset>.json``: how far it is, what failed, how it ended.

It is rewritten while the run goes on, at most every `EVERY_S`: a file, or an object in a store, like the dataset.
"""

import os
import platform
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from prometheus_client import CollectorRegistry, Gauge, generate_latest
from pydantic import TypeAdapter

from catalogs.documents import parse_json
from flows.running.progress import Progress, watch_progress
from flows.store.objects import Objects, is_address
from flows.store.outputs import Outputs
from manifests.canonical import canonical_bytes
from tasks.errors import InputError

FORMAT = "musync-run/1"
RUNS = "runs"
LOCAL = Path(".musync")
"""Under the working folder: where files lie of a schedule that writes to an object store."""
EVERY_S = 2.0
CLIPS = "clips"
"""Title of the progress that counts clips."""
GAUGES = {
    "to_make": ("musync_run_clips", "clips that the run has to make"),
    "made": ("musync_run_clips_done", "clips that the run has made"),
    "failed": ("musync_run_clips_failed", "clips that could not be made"),
    "quarantined": (
        "musync_dataset_clips_quarantined",
        "clips whose pose check failed, of the finished dataset",
    ),
    "cpu_s": ("musync_run_cpu_seconds", "processor time of the run"),
    "bytes": ("musync_dataset_bytes", "size of the finished dataset"),
    "scheduled": ("musync_run_scheduled_timestamp_seconds", "when the run was due"),
    "began": ("musync_run_began_timestamp_seconds", "when the run began"),
    "updated": ("musync_run_updated_timestamp_seconds", "when the run last made a sign"),
    "ended": ("musync_run_ended_timestamp_seconds", "when the run ended; absent while it goes on"),
}
"""Name and help of each metric by key of the record; one that is not known is absent."""
SUCCEEDED = (
    "musync_run_succeeded",
    "1 for a run that made its dataset, 0 for one that failed; absent before",
)


@dataclass(kw_only=True)
class RunRecord:
    """One run of a schedule.

    Parameters
    ----------
    dataset, grid : name of the dataset in the schedule's folder, and of its grid
    scheduled, began, updated : times (ISO 8601, UTC)
    ended : the same; None while the run goes on
    host, pid : of the process
    to_make, made : clips that the run has to make, and of these those that are done [1]
    failed : labels of clips that could not be made
    error : what ended the run; None while it goes on and after success
    run_id : of the finished dataset
    clips, quarantined : of the finished dataset [1]
    cpu_s : processor time [s] of a run that made its dataset
    bytes : of the finished dataset [B]
    """

    dataset: str
    grid: str
    scheduled: str
    began: str
    updated: str
    ended: str | None = None
    host: str = field(default_factory=platform.node)
    pid: int = field(default_factory=os.getpid)
    to_make: int = 0
    made: int = 0
    failed: list[str] = field(default_factory=list)
    error: str | None = None
    run_id: str | None = None
    clips: int | None = None
    quarantined: int | None = None
    cpu_s: float | None = None
    bytes: int | None = None


class RecordFiles:
    """Where a schedule keeps the record of a run, and its metrics.

    Parameters
    ----------
    root : folder of the schedule, or its address
    record : of the run
    """

    def __init__(self, root: str, record: RunRecord) -> None:
        self._record, self._written = record, 0.0
        self._metrics, self._name = f"{RUNS}/{record.grid}.prom", record_name(record.dataset)
        self._objects = Objects(root) if is_address(root) else None
        names = [self._metrics] if self._objects is not None else [self._name, self._metrics]
        self._files = Outputs((LOCAL if is_address(root) else Path(root)).resolve(), "schedule", *names)

    def write(self) -> None:
        """Write the record as it stands."""
        record, self._written = self._record, time.monotonic()
        record.updated = format_now()
        content = canonical_bytes({"format": FORMAT} | asdict(record))
        # a disk that is full or a store that does not answer ends the run by itself, and says so
        with suppress(InputError, OSError):
            if self._objects is None:
                self._files.write(self._name, content)
            else:
                self._objects.write(self._name, content)
            self._files.write(self._metrics, format_metrics(asdict(record)))

    def note_progress(self, progress: Progress) -> None:
        """Take a finished clip into the record: a watcher for `flows.running.progress.watch_progress`."""
        if progress.title != CLIPS:
            return
        if progress.failed:
            self._record.failed.append(progress.name)
        done, total = progress.done, progress.total
        self._record.to_make, self._record.made = total, done - len(self._record.failed)
        if done in (0, total) or time.monotonic() - self._written >= EVERY_S:
            self.write()


@contextmanager
def keep_record(grid: str, root: str, dataset: str, at: datetime) -> Iterator[RunRecord]:
    """Yield the record of the run that the block makes; it is kept up to date, and says how the block ended.

    Parameters
    ----------
    grid : name of the grid
    root : folder of the schedule, or its address
    dataset : where the run writes
    at : scheduled time
    """
    now = format_now()
    record = RunRecord(
        dataset=PurePosixPath(dataset).name,
        grid=grid,
        scheduled=at.astimezone(UTC).isoformat(timespec="seconds"),
        began=now,
        updated=now,
    )
    files = RecordFiles(root, record)
    files.write()
    try:
        with watch_progress(files.note_progress):
            yield record
    except BaseException as error:
        record.error = f"{type(error).__name__}: {error}".removesuffix(": ")
        raise
    finally:
        record.ended = format_now()
        files.write()


def record_name(dataset: str) -> str:
    """Name of the record of a dataset, below the schedule's folder."""
    return f"{RUNS}/{dataset}.json"


def read_record(content: bytes | None, origin: object) -> RunRecord | None:
    """The record in a file; None where there is none, or something else.

    Parameters
    ----------
    content : of the file
    origin : what messages call it
    """
    if content is None:
        return None
    try:
        value = parse_json(content, origin, "record of a run")
        if not isinstance(value, dict) or value.pop("format", None) != FORMAT:
            return None
        record = TypeAdapter(RunRecord).validate_python(value)
        for time_of in (record.scheduled, record.began, record.updated):
            datetime.fromisoformat(time_of)
    except (InputError, ValueError):  # pydantic's ValidationError is a ValueError
        return None
    return record


def find_run_id(content: bytes, origin: object) -> str | None:
    """The run id in a plan or manifest; None where it is damaged.

    Parameters
    ----------
    content : of the file
    origin : what messages call it
    """
    try:
        value = parse_json(content, origin, "record of a dataset")
    except InputError:
        return None
    run_id = value.get("run_id") if isinstance(value, dict) else None
    return run_id if isinstance(run_id, str) else None


def format_now() -> str:
    """The time now: ISO 8601, UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def format_metrics(record: Mapping[str, Any]) -> bytes:
    """The text of a run's metrics, labelled with the grid's name.

    Parameters
    ----------
    record : fields of `flows.scheduled.run_record.RunRecord`
    """
    registry = CollectorRegistry()
    known = {spec: _number_of(record[key]) for key, spec in GAUGES.items() if record[key] is not None}
    if record["ended"] is not None:
        known[SUCCEEDED] = float(record["error"] is None)
    for (name, text), value in known.items():
        Gauge(name, text, ["grid"], registry=registry).labels(record["grid"]).set(value)
    return generate_latest(registry)


def _number_of(value: Any) -> float:
    if isinstance(value, list):
        return float(len(value))
    return datetime.fromisoformat(value).timestamp() if isinstance(value, str) else float(value)
