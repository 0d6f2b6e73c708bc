"""``python -m studies.scale [CLIPS ...] [--folder DIR]``: how time and memory grow with the clips of a dataset.

Each dataset is driven, described, verified and queried by a process of its own, the last three as a user calls them.
Time is of the processor [s], memory the largest of that process [MiB]. Clips are copies (`studies.scale.copies`):
a driver leaves making them to its workers. A folder in memory (``--folder /dev/shm``) leaves the disk out of it.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from studies.scale.copies import grid_of

CLIPS = (2000, 8000, 20_000)
LARGEST_DRIVER_MIB = 500
AGGREGATE = "SELECT weather, avg(longitudinal_acceleration), max(braking_slip_f) FROM ticks GROUP BY weather"
OF_CLIPS = "SELECT weather, avg(peak_pitch), count(*) FROM clips GROUP BY weather"
COMMANDS = {
    "describe": (["lab", "describe"], "--json"),
    "verify": (["verify"], "--json"),
    "sql over clips": (["sql"], OF_CLIPS),
    "sql over ticks": (["sql"], AGGREGATE),
}


def measure_process(words: list[str]) -> tuple[dict[str, float], str]:
    """Run a command to its end: wall and processor time [s], largest memory [MiB]; and what it printed."""
    started = time.perf_counter()
    with tempfile.TemporaryFile("w+") as printed:
        process = subprocess.Popen(words, stdout=printed)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        printed.seek(0)
        text = printed.read()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, words, text)
    figures = {
        "wall_s": time.perf_counter() - started,
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "peak_mib": usage.ru_maxrss / 1024,
    }
    return figures, text


def measure_size(clips: int, place: Path) -> list[dict[str, Any]]:
    """One dataset: a row for each stage of making it, and for each command that reads it."""
    grid, folder = place / f"{clips}.yaml", place / str(clips)
    grid.write_text(yaml.safe_dump(grid_of(clips), sort_keys=False))
    _, printed = measure_process([sys.executable, "-m", "studies.scale.make", str(grid), str(folder)])
    rows = [{"clips": clips} | json.loads(line) for line in printed.splitlines()]
    for name, (words, *rest) in COMMANDS.items():
        figures, _ = measure_process([sys.executable, "-m", "flows.cli", *words, str(folder), *rest])
        rows.append({"clips": clips, "stage": name} | figures)
    return rows


def main() -> int:
    """Measure and print; 1 where the driver takes more memory than it may."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=int, nargs="*", default=CLIPS)
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    driver = 0.0
    for clips in asked.clips:
        with tempfile.TemporaryDirectory(dir=asked.folder) as scratch:
            for row in measure_size(clips, Path(scratch)):
                print(f"{clips:8d} {row['stage']:16} {row['cpu_s']:8.2f} CPU-s {row['wall_s']:8.2f} s"
                      f" {row['peak_mib']:7.0f} MiB", flush=True)  # fmt: skip
                driver = max(driver, row["peak_mib"] if "before_mib" in row else 0.0)
    print(f"driver at most {driver:.0f} MiB, limit {LARGEST_DRIVER_MIB}")
    return 0 if driver <= LARGEST_DRIVER_MIB else 1


if __name__ == "__main__":
    sys.exit(main())
