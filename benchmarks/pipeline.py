"""Overhead of the pipeline: wall and processor time of a run compared with those of its clips."""

import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from flows.making.generate import generate_dataset

WORKERS = 2


def measure_rows(grid: str = "demo") -> list[dict[str, Any]]:
    """Generate a grid into a temporary folder and split its time into work and overhead.

    The wall time says how well the workers are kept busy, on a machine that does nothing else. Processor time, of the
    driver and of all its workers from their start to their end, says the same on a busy machine.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    with tempfile.TemporaryDirectory() as folder:
        started, before = time.perf_counter(), _count_processor_time()
        report = generate_dataset(grid, str(Path(folder) / "dataset"), workers=WORKERS)
        wall, after = time.perf_counter() - started, _count_processor_time()
        resumed = time.perf_counter()
        generate_dataset(grid, str(Path(folder) / "dataset"), workers=WORKERS)
        resume_wall = time.perf_counter() - resumed
    work, cpu, memory = report.cost.wall_s / WORKERS, report.cost.cpu_s, report.cost.peak_memory_mib
    user, system = after[0] - before[0], after[1] - before[1]
    return [
        _make_row("pipeline wall", wall, "s", f"sum of the clips' wall time over {WORKERS} workers", work),
        _make_row("pipeline cpu", user + system, "CPU-s", "sum of the clips' processor time", cpu),
        _make_row("pipeline cpu beside its clips", user + system - cpu, "CPU-s"),
        _make_row("system time", system, "CPU-s", "all processor time", user + system),
        _make_row("clip cpu", cpu / report.clips, "CPU-s/clip"),
        _make_row("worker peak memory", memory, "MiB", "limit 1536", 1536),
        _make_row("finished run called again", resume_wall, "s", "limit 3", 3),
    ]


def _make_row(
    name: str, value: float, unit: str, peer: str | None = None, held_against: float | None = None
) -> dict[str, Any]:
    ratio = None if held_against is None else value / held_against
    return {"name": name, "value": value, "unit": unit, "peer": peer, "ratio": ratio}


def _count_processor_time() -> tuple[float, float]:
    """User and system time of this process and of its children that have ended [s]."""
    own, children = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + children.ru_utime, own.ru_stime + children.ru_stime


if __name__ == "__main__":
    for row in measure_rows(*sys.argv[1:2]):
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.3f} of {row['peer']}"
        print(f"{row['name']:32} {row['value']:10.3f} {row['unit']:12} {ratio}")
