"""Overhead of the pipeline: wall time compared with the clips' own wall time over the workers."""

import tempfile
import time
from pathlib import Path
from typing import Any

from flows.making.generate import generate_dataset

WORKERS = 2


def measure_rows(grid: str = "demo") -> list[dict[str, Any]]:
    """Generate a grid into a temporary folder and split its wall time into work and overhead.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        report = generate_dataset(grid, str(Path(folder) / "dataset"), workers=WORKERS)
        wall = time.perf_counter() - started
        resumed = time.perf_counter()
        generate_dataset(grid, str(Path(folder) / "dataset"), workers=WORKERS)
        resume_wall = time.perf_counter() - resumed
    work, cpu, memory = report.cost.wall_s / WORKERS, report.cost.cpu_s, report.cost.peak_memory_mib
    peer = f"sum of the clips' wall time over {WORKERS} workers"
    return [
        {"name": "pipeline wall", "value": wall, "unit": "s", "peer": peer, "ratio": wall / work},
        {"name": "clip cpu", "value": cpu / report.clips, "unit": "CPU-s/clip", "peer": None, "ratio": None},
        {
            "name": "worker peak memory",
            "value": memory,
            "unit": "MiB",
            "peer": "limit 1536",
            "ratio": memory / 1536,
        },
        {
            "name": "finished run called again",
            "value": resume_wall,
            "unit": "s",
            "peer": "limit 3",
            "ratio": resume_wall / 3,
        },
    ]


if __name__ == "__main__":
    for row in measure_rows():
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.3f} of {row['peer']}"
        print(f"{row['name']:32} {row['value']:10.3f} {row['unit']:12} {ratio}")
