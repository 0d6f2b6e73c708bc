"""Kill -9 a generating run and its workers at random points, then resume: are the bytes those of a run left alone?

``make study-crash`` kills 50 times and says after each what it found; ``python -m benchmarks.crashes KILLS SEED`` takes
a part of it. A folder is killed again and again until a run gets through, and is then held against the uninterrupted
run byte for byte; between kills a reader looks at what is there.
"""

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flows.auditing.verify import compare_files
from flows.store.layout import Layout
from manifests.canonical import sha256_of_file

KILLS = 50
SEED = 9
GRID = """\
name: crashes
frames: 5
axes:
  weather:
    dry: {weather: dry}
    rain-25: {weather: rain, precipitation_mm_h: 25}
    snow-3: {weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}
  road:
    flat: {}
    hump: {hazard_center_m: 8, hazard_length_m: 3.7, hazard_height_m: 0.075}
"""


def crash_study(grid: Path, place: Path, kills: int, seed: int = SEED) -> dict[str, Any]:
    """Kill runs of a grid at random moments of their life.

    Parameters
    ----------
    grid : grid file
    place : empty folder to work in
    kills : how many runs to kill [1]
    seed : of the moments

    Returns
    -------
    ``kills``; ``runs_finished``; ``equal``, of these those with the bytes of the undisturbed run; ``half_clips``, the
    committed clips that a reader found incomplete; ``committed_at_kill``, clips already committed at each kill.
    """
    draw = random.Random(seed)
    _start(grid, place / "whole").wait()
    started = time.monotonic()
    _start(grid, place / "timed").wait()  # a second run, because the first compiles what later ones find
    life = time.monotonic() - started
    whole = _files(place / "whole")
    result: dict[str, Any] = {
        "kills": 0,
        "runs_finished": 0,
        "equal": 0,
        "half_clips": 0,
        "committed_at_kill": [],
    }
    while True:
        folder = place / f"killed-{result['runs_finished']}"
        run = _start(grid, folder)
        # the first part of a run's life is imports, in which nothing can break
        if result["kills"] < kills and _killed_after(run, life * draw.uniform(0.3, 1.0)):
            halves, committed = _half_clips(Layout(folder))
            result["kills"] += 1
            result["half_clips"] += halves
            result["committed_at_kill"].append(committed)
            print(f"kill {result['kills']} of {kills}: {committed} clips, {halves} half", file=sys.stderr)
        elif run.wait() != 0:
            raise RuntimeError(
                f"a run in {folder} ended with exit code {run.returncode}, and nobody killed it"
            )
        else:
            result["runs_finished"] += 1
            result["equal"] += _files(folder) == whole
            if result["kills"] == kills:
                return result


def _killed_after(run: "subprocess.Popen[bytes]", seconds: float) -> bool:
    """Kill a run and its workers then; False if it has ended before."""
    try:
        run.wait(seconds)
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        return True
    return False


def _start(grid: Path, folder: Path) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-m", "flows.cli", "generate", str(grid), "--out", str(folder),
               "--runner", "processes", "--workers", "2"]  # fmt: skip
    clean = {k: v for k, v in os.environ.items() if k != "PREFECT_API_URL"}
    return subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=clean
    )


def _files(folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): sha256_of_file(path) for path in _all_files(folder)}


def _all_files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_file())


def _half_clips(layout: Layout) -> tuple[int, int]:
    """Committed clips that are not whole, and all committed clips."""
    if layout.manifest.is_file():
        clips = len(json.loads(layout.manifest.read_bytes())["clips"])
        return (0 if compare_files(layout)["verified"] else clips), clips
    receipts = [json.loads(path.read_bytes()) for path in layout.staging.glob("*.json")]
    halves = 0
    for receipt in receipts:
        shards = receipt["artifacts"].items()
        whole = all((layout.root / p).is_file() and sha256_of_file(layout.root / p) == d for p, d in shards)
        tables = all(layout.staged(receipt["clip_id"], table).is_file() for table in ("ticks", "frames"))
        halves += not (whole and tables)
    return halves, len(receipts)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        (Path(scratch) / "grid.yaml").write_text(GRID)
        found = crash_study(Path(scratch) / "grid.yaml", Path(scratch), *map(int, sys.argv[1:] or [KILLS]))
    print(json.dumps(found))
    sys.exit(0 if found["equal"] == found["runs_finished"] > 0 and found["half_clips"] == 0 else 1)
