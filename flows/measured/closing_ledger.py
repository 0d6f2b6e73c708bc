"""The ledger of held-out readings: whoever looks twice at runs that only judge says so."""

import hashlib
import os
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from flows.store.journal import append_line, read_lines
from manifests.provenance import code_version
from tasks.campaign.campaign import Campaign, Run

LEDGER = Path(".musync") / "held-out-readings.jsonl"
"""Under the working folder, unless MUSYNC_LEDGER names another file."""


def record_reading(campaign: Campaign, vehicle_sha256: str) -> int:
    """Write down that the results of a campaign are read, and return `count_readings` as it was before.

    Parameters
    ----------
    campaign : that was read
    vehicle_sha256 : of the vehicle file it was held against

    Raises
    ------
    InputError
        If the ledger is no such file.
    """
    before = count_readings(campaign)
    entry = {
        "campaign": campaign.name,
        "content_sha256": campaign.content_hash,
        "split_sha256": campaign.split_hash,
        "speed_sha256": [hash_speed(run) for run in campaign.runs],
        "vehicle_sha256": vehicle_sha256,
        "source_sha256": code_version()["source_sha256"],
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    append_line(_find_ledger(), entry)
    return before


def count_readings(campaign: Campaign) -> int:
    """Return the number of readings so far that had a held-out run of a campaign among their runs.

    A run is known by the speed that it measured, so that neither another name, comment, tolerance or split of the
    same runs nor another way of writing them makes a reading the first one. What was fitted before is no blind test.

    Parameters
    ----------
    campaign : that is to be read

    Raises
    ------
    InputError
        If the ledger is no such file.
    """
    held_out = {hash_speed(run) for run in campaign.held_out}
    return sum(
        not held_out.isdisjoint(e.get("speed_sha256", ())) or e["content_sha256"] == campaign.content_hash
        for e in read_lines(_find_ledger(), {"content_sha256"})
    )


def _find_ledger() -> Path:
    # a link that the user has named is theirs to follow; one that lies in the working folder is not
    return Path(os.environ["MUSYNC_LEDGER"]).resolve() if "MUSYNC_LEDGER" in os.environ else LEDGER


def hash_speed(run: Run) -> str:
    """SHA-256 of the speed that a run measured: interval and samples as numbers, whatever file held them.

    Parameters
    ----------
    run : of a campaign
    """
    head = f"{run.interval!r} {len(run.speed)}".encode()
    return hashlib.sha256(head + np.ascontiguousarray(run.speed, "<f8").tobytes()).hexdigest()
