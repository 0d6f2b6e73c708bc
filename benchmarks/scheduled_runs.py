"""A schedule served for real: a Prefect server on loopback from a clean home, cron fires twice, everything stops.

Takes about three minutes, because cron counts in minutes: ``python -m benchmarks.scheduled_runs``.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

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


def main() -> int:
    """Run the schedule and print what was seen; 0 if both runs finished and no process is left."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "grid.yaml").write_text(GRID)
        clean = {k: v for k, v in os.environ.items() if not k.startswith("PREFECT")}
        command = [sys.executable, "-m", "flows.cli", "schedule", "grid.yaml", "--every", "* * * * *",
                   "--out", "runs", "--runner", "dask", "--workers", "1"]  # fmt: skip
        started = time.monotonic()
        serving = subprocess.Popen(
            command,
            cwd=place,
            env=clean | {"HOME": folder},
            start_new_session=True,
            stderr=subprocess.DEVNULL,
        )
        finished: list[Path] = []
        try:
            while (
                len(finished) < FIRES and time.monotonic() - started < PATIENCE_S and serving.poll() is None
            ):
                time.sleep(1)
                finished = sorted(place.glob("runs/watched-*/manifest.json"))
        finally:
            serving.send_signal(signal.SIGTERM)
            serving.wait(60)
        time.sleep(2)
        left = _processes_in(place)
        for manifest in finished:
            print(f"finished: {manifest.parent.name}")
        print(f"{len(finished)} of {FIRES} runs finished after {time.monotonic() - started:.0f} s")
        print(f"processes left: {len(left)} {left}")
        return 0 if len(finished) >= FIRES and not left else 1


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
