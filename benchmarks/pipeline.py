"""Overhead of the pipeline: wall and processor time of a run compared with those of its clips."""

import argparse
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.side_by_side import make_row, print_rows
from flows.cli import run_to_end
from flows.making.generate import generate_dataset

WORKERS = 2
CLIP = """
name: clip-{label}
scene: street
vehicle: paper-reference
surface: dense-asphalt
camera: dashcam-{size}
frames: {frames}
frame_rate_hz: 10
seed: 2025
scenarios:
  {label}: {{{weather}, initial_speed_km_h: 60, peak_pressure_mpa: 2.3, brake_onset_s: 1.0}}
"""
"""One braking stop on the built-in street."""
WEATHERS = {
    "dry": "weather: dry",
    "rain-50": "weather: rain, precipitation_mm_h: 50",
    "snow-3": "weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1",
}
FRAMES = 81
LIMITS = {
    ("480x320", "dry"): 6.3, ("480x320", "rain-50"): 9.0, ("480x320", "snow-3"): 8.5,
    ("1280x720", "dry"): 14.0, ("1280x720", "rain-50"): 28.0, ("1280x720", "snow-3"): 22.0,
}  # fmt: skip
"""Processor time asked for of a clip of each size and weather [CPU-s]."""


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
        make_row("pipeline wall", wall, "s", f"sum of the clips' wall time over {WORKERS} workers", work),
        make_row("pipeline cpu", user + system, "CPU-s", "sum of the clips' processor time", cpu),
        make_row("pipeline cpu beside its clips", user + system - cpu, "CPU-s"),
        make_row("system time", system, "CPU-s", "all processor time", user + system),
        make_row("clip cpu", cpu / report.clips, "CPU-s/clip"),
        make_row("worker peak memory", memory, "MiB", "limit 1536", 1536),
        make_row("finished run called again", resume_wall, "s", "limit 3", 3),
        *(_measure_clip(*clip, limit) for clip, limit in LIMITS.items()),
    ]


def _measure_clip(size: str, label: str, limit_cpu_s: float) -> dict[str, Any]:
    """Row of one clip in one process, after two frames that compile and load what it needs."""
    with tempfile.TemporaryDirectory() as folder:
        for frames in (2, FRAMES):
            grid = Path(folder) / f"{frames}.yaml"
            grid.write_text(CLIP.format(size=size, label=label, weather=WEATHERS[label], frames=frames))
            report = generate_dataset(str(grid), str(Path(folder) / str(frames)), runner="threads", workers=1)
    name = f"{label} clip, {FRAMES} frames, {size}"
    return make_row(name, report.cost.cpu_s, "CPU-s", f"limit {limit_cpu_s:g}", limit_cpu_s)


def _count_processor_time() -> tuple[float, float]:
    """User and system time of this process and of its children that have ended [s]."""
    own, children = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + children.ru_utime, own.ru_stime + children.ru_stime


def run_benchmark() -> None:
    """Measure the grid that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pipeline")
    parser.add_argument("grid", nargs="?", default="demo", help="grid file, or the name of one that ships")
    print_rows(measure_rows(parser.parse_args().grid))


if __name__ == "__main__":
    run_to_end(run_benchmark)
