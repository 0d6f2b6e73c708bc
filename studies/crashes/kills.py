"""Kill -9 a generating run, or one part of it, at random points, then resume: are the bytes those of a run left alone?

A folder is killed again and again until a run gets through, and is then held against the undisturbed run byte for byte;
between kills a reader looks at what is there.
"""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

from flows.auditing.verify import compare_files
from flows.store.layout import STAGED_TABLES, Layout
from flows.store.sealed import read_manifest, read_receipt
from manifests.canonical import sha256_of_file
from studies.crashes.processes import Cluster, Process, kill_group, list_children, start_run

RUN, DRIVER, WORKER = "run", "driver", "worker"
CLUSTER_DRIVER, CLUSTER_WORKER, SCHEDULER = (
    "driver of a cluster",
    "worker of a cluster",
    "scheduler of a cluster",
)
VICTIMS = (RUN, DRIVER, WORKER, CLUSTER_DRIVER, CLUSTER_WORKER, SCHEDULER)
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


def kill_study(
    grid: Path, place: Path, kills: int, seed: int = 9, victims: Sequence[str] = VICTIMS
) -> dict[str, Any]:
    """Kill runs of a grid at random moments of their life.

    Parameters
    ----------
    grid : grid file
    place : empty folder to work in
    kills : how many processes to kill [1]
    seed : of the moments
    victims : what is killed, in turn, of `VICTIMS`

    Returns
    -------
    ``kills``, and of each victim; ``runs_finished``; ``equal``, of these those with the bytes of the undisturbed run;
    ``half_clips``, the committed clips that a reader found incomplete; ``committed_at_kill``, clips already committed
    at each kill.
    """
    draw, turn = random.Random(seed), cycle(victims)
    start_run(grid, place / "whole").wait()
    started = time.monotonic()
    start_run(grid, place / "timed").wait()  # a second run, because the first compiles what later ones find
    life = time.monotonic() - started
    whole = files_of(place / "whole")
    found: dict[str, Any] = {
        "kills": 0, "of": dict.fromkeys(victims, 0), "runs_finished": 0, "equal": 0, "half_clips": 0,
        "committed_at_kill": [],
    }  # fmt: skip
    cluster: Cluster | None = None
    victim = next(turn)
    try:
        while True:
            folder = place / f"killed-{found['runs_finished']}"
            if victim in {CLUSTER_DRIVER, CLUSTER_WORKER, SCHEDULER} and not (cluster and cluster.is_whole):
                if cluster:
                    cluster.stop()
                cluster = Cluster(place / f"cluster-{found['kills']}")
            on_cluster = cluster if victim in {CLUSTER_DRIVER, CLUSTER_WORKER, SCHEDULER} else None
            run = start_run(grid, folder, on_cluster.address if on_cluster else None)
            # the first part of a run's life is imports, in which nothing can break
            if found["kills"] < kills and _kill_after(
                run, life * draw.uniform(0.3, 1.0), victim, on_cluster, draw
            ):
                halves, committed = half_clips(Layout(folder))
                found["kills"] += 1
                found["of"][victim] += 1
                found["half_clips"] += halves
                found["committed_at_kill"].append(committed)
                print(
                    f"kill {found['kills']} of {kills}, {victim}: {committed} clips, {halves} half",
                    file=sys.stderr,
                )
                victim = next(turn)
                if run.poll() != 0:
                    continue
            elif run.wait() != 0:
                raise RuntimeError(
                    f"a run in {folder} ended with exit code {run.returncode}, and nobody killed it"
                )
            found["runs_finished"] += 1
            found["equal"] += files_of(folder) == whole
            if found["kills"] >= kills:
                return found
    finally:
        if cluster:
            cluster.stop()


def _kill_after(
    run: Process, seconds: float, victim: str, cluster: Cluster | None, draw: random.Random
) -> bool:
    """Kill the victim then, and wait for what becomes of the run; False if the run has ended before."""
    try:
        run.wait(seconds)
    except subprocess.TimeoutExpired:
        pass
    else:
        return False
    if victim == RUN:
        kill_group(run)
    elif victim in {DRIVER, CLUSTER_DRIVER}:
        run.kill()  # its workers go on with the clips that they have
        run.wait()
    elif victim == WORKER:
        pids = list_children(run)
        if not pids:
            run.wait()
            return False
        os.kill(draw.choice(pids), signal.SIGKILL)
        run.wait()
    elif cluster is not None:
        kill_group(draw.choice(cluster.workers) if victim == CLUSTER_WORKER else cluster.scheduler)
        run.wait()
    return True


def files_of(folder: Path) -> dict[str, str]:
    """SHA-256 of every file by its relative path."""
    return {
        path.relative_to(folder).as_posix(): sha256_of_file(path)
        for path in folder.rglob("*")
        if path.is_file()
    }


def half_clips(layout: Layout) -> tuple[int, int]:
    """Committed clips that are not whole, and all committed clips."""
    if layout.manifest.is_file():
        clips = len(read_manifest(layout)["clips"])
        return (0 if compare_files(layout)["verified"] else clips), clips
    receipts = [read_receipt(layout, path.stem) for path in layout.staging.glob("*.json")]
    halves = 0
    for receipt in receipts:
        shards = receipt["artifacts"].items()
        whole = all((layout.root / p).is_file() and sha256_of_file(layout.root / p) == d for p, d in shards)
        tables = all(layout.staged(receipt["clip_id"], table).is_file() for table in STAGED_TABLES)
        halves += not (whole and tables)
    return halves, len(receipts)
