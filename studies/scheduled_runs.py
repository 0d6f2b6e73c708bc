"""A schedule served for real: a Prefect server on loopback from a clean home, cron fires twice, everything stops.

It is stopped while the third run is going. Takes about four minutes, because cron counts in minutes: ``python -m
studies.scheduled_runs``.
"""

import base64
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from manifests.provenance import SOURCE_ROOT

GRID = """\
name: watched
frames: 2
camera: dashcam-480x320
axes:
  weather:
    dry: {weather: dry}
    snow-3: {weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}
"""
PATIENCE_S = 400
FIRES = 2
ARTIFACTS = {"musync-verdicts", "musync-dataset", "musync-contact-sheet", "musync-progress"}


def main() -> int:
    """Run the schedule and print what was seen; 0 if both runs finished and showed all, and no process is left."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "grid.yaml").write_text(GRID)
        clean = {k: v for k, v in os.environ.items() if not k.startswith("PREFECT")}
        command = [sys.executable, "-m", "flows.cli", "schedule", "grid.yaml", "--every", "* * * * *",
                   "--out", "runs", "--runner", "dask", "--workers", "1"]  # fmt: skip
        started = time.monotonic()
        with (place / "log").open("w") as log:
            serving = subprocess.Popen(
                command,
                cwd=place,
                env=clean | {"HOME": folder, "PYTHONPATH": str(SOURCE_ROOT)},
                start_new_session=True,
                stderr=log,
            )
        finished: list[Path] = []
        shown: set[str] = set()
        begun = 0
        try:
            while begun <= FIRES and time.monotonic() - started < PATIENCE_S and serving.poll() is None:
                time.sleep(0.5)
                finished = sorted(place.glob("runs/watched-*/manifest.json"))
                begun = len(list(place.glob("runs/watched-*")))
                if len(finished) >= FIRES and not shown:
                    shown = _list_artifacts((place / "log").read_text())
        finally:
            serving.send_signal(signal.SIGTERM)
            serving.wait(90)
        time.sleep(2)
        left = _processes_in(place)
        for manifest in finished:
            print(f"finished: {manifest.parent.name}")
        print(f"{len(finished)} of {FIRES} runs finished after {time.monotonic() - started:.0f} s")
        print(f"artifacts: {', '.join(sorted(shown))}")
        print(f"stopped in the middle of another: {begun > len(finished)}; reports: {_count_reports(place)}")
        print(f"processes left: {len(left)} {left}")
        seeming = _runs_that_seem_to_go_on(place)
        print(f"runs that the database takes for under way: {seeming}")
        quiet = "never awaited" not in (place / "log").read_text()
        print(f"stopped without a warning: {quiet}")
        return (
            0 if len(finished) >= FIRES and shown == ARTIFACTS and not left and not seeming and quiet else 1
        )


def _list_artifacts(log: str) -> set[str]:
    """Keys of the artifacts that the schedule's own server shows to who has its password."""
    found = re.search(r"(http://127\.0\.0\.1:\d+) \(their password is in (.*)\)", log)
    assert found is not None
    password = base64.b64encode(Path(found[2]).read_bytes().strip()).decode()
    headers = {"Content-Type": "application/json", "Authorization": f"Basic {password}"}
    request = urllib.request.Request(f"{found[1]}/api/artifacts/latest/filter", b"{}", headers)
    with urllib.request.urlopen(request, timeout=30) as answer:
        return {artifact["key"] for artifact in json.load(answer)}


def _runs_that_seem_to_go_on(place: Path) -> list[str]:
    with sqlite3.connect(place / ".musync" / "prefect" / "prefect.db") as database:
        rows = database.execute("SELECT name || ' ' || state_name FROM flow_run WHERE state_type IN (?, ?, ?)",
                                ("PENDING", "RUNNING", "CANCELLING"))  # fmt: skip
        return [name for (name,) in rows]


def _count_reports(place: Path) -> int:
    return len(list(place.glob("runs/reports/*")))


def _processes_in(place: Path) -> list[str]:
    """Command lines of processes whose working folder is the one of this study."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            if (entry / "cwd").resolve() == place.resolve():
                found.append((entry / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue
    return found


if __name__ == "__main__":
    sys.exit(main())
