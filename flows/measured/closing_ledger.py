"""The ledger of held-out readings: whoever looks twice at runs that only judge says so."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path

from manifests.provenance import code_version
from tasks.closure.campaign import Campaign

LEDGER = Path(".musync") / "held-out-readings.jsonl"
"""Under the working folder, unless MUSYNC_LEDGER names another file."""


def record_reading(campaign: Campaign, vehicle_sha256: str) -> int:
    """Write down that the held-out runs of a campaign have been read, and count the earlier readings.

    Readings are known by the hash of the held-out split and the data, wherever the verdict was written.

    Parameters
    ----------
    campaign : that was read
    vehicle_sha256 : of the vehicle file it was held against

    Returns
    -------
    Number of readings before this one.
    """
    path = Path(os.environ.get("MUSYNC_LEDGER", LEDGER))
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    known = [json.loads(line) for line in lines if line.strip()]
    entry = {
        "campaign": campaign.name,
        "content_sha256": campaign.content_hash,
        "split_sha256": campaign.split_hash,
        "vehicle_sha256": vehicle_sha256,
        "source_sha256": code_version()["source_sha256"],
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    with open(path, "a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")
    return sum(
        e["content_sha256"] == campaign.content_hash and e["split_sha256"] == campaign.split_hash
        for e in known
    )
