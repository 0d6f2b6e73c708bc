"""The state of a dataset that is being made, and how long it will take yet, from the files that are there."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from statistics import median
from typing import Any

from flows.scheduled.run_record import RunRecord

PAUSE_S, PAUSE_FACTOR = 60.0, 10.0
"""A pause between two clips, at least [s] and in usual intervals [1]: before it another run made the clips."""
RECENT = 200
"""Clips from which the pace is taken [1]."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """A dataset as it lies in its folder or store.

    Parameters
    ----------
    name : of the dataset
    clips : label of each planned clip by its id; None where there is no plan that can be read
    receipts : time of each committed clip that is not sealed yet by its id [s since 1970]; None where it is not known
    finished : whether there is a manifest
    running : whether a run holds the lock
    since : when the lock was made [s since 1970]; None where it is not known
    record : of the run, where a schedule made it (see `flows.scheduled.run_record`)
    """

    name: str
    clips: Mapping[str, str] | None
    receipts: Mapping[str, float | None]
    finished: bool
    running: bool
    since: float | None
    record: RunRecord | None


def describe_seen(seen: Seen, now: float) -> dict[str, Any]:
    """The state of a dataset as plain values.

    Parameters
    ----------
    seen : the dataset
    now : [s since 1970]

    Returns
    -------
    ``dataset``, ``state`` (``finished``, ``running``, ``sealing``, ``stopped`` or, without a plan, ``begun``),
    ``clips`` and ``done`` [1], ``left_s`` (None where nobody knows) [s], ``failed`` (labels of the last run),
    ``missing`` (labels that a stopped run has left) and ``error`` (what ended the last run)
    """
    planned = seen.clips or {}
    missing = [] if seen.finished else [label for key, label in planned.items() if key not in seen.receipts]
    state = _name_state(seen, missing)
    record = seen.record
    times = [time for time in seen.receipts.values() if time is not None]
    left = None
    if state == "running":
        by_files = estimate_left([*([seen.since] if seen.since else []), *times], now, len(missing))
        left = by_files if by_files is not None else _estimate_by_record(seen.record, now, len(missing))
    return {
        "dataset": seen.name,
        "state": state,
        "clips": None if seen.clips is None else len(planned),
        "done": len(planned) - len(missing),
        "left_s": left,
        "failed": [] if seen.finished or record is None else record.failed,
        "missing": missing if state == "stopped" else [],
        "error": record.error if record is not None and state in {"stopped", "begun"} else None,
    }


def _name_state(seen: Seen, missing: list[str]) -> str:
    if seen.finished:
        return "finished"
    if seen.clips is None:
        return "begun"
    if seen.running:
        return "running" if missing else "sealing"
    return "stopped"


def estimate_left(times: Iterable[float], now: float, missing: int) -> float | None:
    """How long a run will take yet at the pace of its latest clips [s]; None before there is a pace.

    Parameters
    ----------
    times : when the run began and when each clip was committed [s since 1970]; after a pause another run went on
    now : [s since 1970]
    missing : clips that are to be made [1]
    """
    recent = sorted(times)[-RECENT:]
    gaps = [after - before for before, after in pairwise(recent)]
    if not gaps:
        return None
    pause = max(PAUSE_S, PAUSE_FACTOR * median(gaps))
    first = max((index for index, gap in enumerate(gaps, start=1) if gap > pause), default=0)
    paced = len(recent) - 1 - first
    span = recent[-1] - recent[first]
    if paced < 1 or span <= 0.0:
        return None
    return max(0.0, missing * span / paced - (now - recent[-1]))


def _estimate_by_record(record: RunRecord | None, now: float, missing: int) -> float | None:
    """The same by the record of a schedule's run, which knows when it began and how many clips it made."""
    if record is None or record.ended is not None or not record.made:
        return None
    began, updated = (datetime.fromisoformat(time).timestamp() for time in (record.began, record.updated))
    return max(0.0, missing * (updated - began) / record.made - (now - updated))
