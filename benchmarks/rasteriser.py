"""The CPU rasteriser on the corridor, one thread: CPU time per frame against its NumPy twin, and memory."""

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from benchmarks.corridor import driver_view, make_corridor
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view, splat_back
from tasks.render.rasterise.reference_rasteriser import rasterise_reference

STATION = 5.0
"""Near the corridor's beginning, where nearly all of it is in view [m]."""
VIEWS = (
    (200_000, 480, 320, 72.0),
    (1_000_000, 480, 320, 300.0),
    (200_000, 1280, 720, None),
    (1_000_000, 1280, 720, None),
)
"""Gaussians, width, height, and the CPU time per frame asked for [1, px, px, CPU-ms]."""
FRAMES = 9
CLIP_FRAMES, CLIP_END = 81, 85.0
"""Frames of a clip along the corridor, and where it ends [1, m]: every ninth of them is drawn."""
NUMPY_LIMIT = 200_000
"""Largest cloud drawn by the NumPy twin as well, which takes 20 s for it [1]."""
MEMORY_LIMIT_MIB = 1536.0


def measure_rows() -> list[dict[str, Any]]:
    """Measure rendering, its transpose, preparation and a worker's peak memory.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    result = [row for view in VIEWS for row in _view_rows(*view)]
    command = (sys.executable, "-m", __spec__.name, "memory")
    memory = float(subprocess.run(command, capture_output=True, check=True).stdout)
    name = f"peak memory of a worker, {VIEWS[1][0] // 1000}k Gaussians"
    result.append(_make_row(name, memory, "MiB", f"limit {MEMORY_LIMIT_MIB:g}", MEMORY_LIMIT_MIB))
    return result


def _view_rows(count: int, width: int, height: int, limit_ms: float | None) -> list[dict[str, Any]]:
    """Rows of one view; with its limit also those of what surrounds a frame."""
    gaussians, (viewmat, K) = make_corridor(count), driver_view(STATION, width, height)
    prepared = prepare_gaussians(gaussians)
    label = f"{count // 1000}k Gaussians, {width}x{height}"
    frame_ms = _cpu_ms(lambda: rasterise_view(prepared, viewmat, K, width, height))
    drives = [driver_view(x, width, height)[0] for x in np.linspace(STATION, CLIP_END, CLIP_FRAMES)[::9]]
    drawn_ms = _cpu_ms(
        lambda: [rasterise_view(prepared, view, K, width, height, normals=False) for view in drives],
        repeats=3,
    )
    clip_s = drawn_ms / 1000 * CLIP_FRAMES / len(drives)
    clip = _make_row(f"clip of {CLIP_FRAMES} frames, {label}", clip_s, "CPU-s", None, None)
    if limit_ms is None:
        return [_make_row(f"frame, {label}", frame_ms, "CPU-ms", None, None), clip]
    residual = np.ones((height, width, 3), dtype=np.float32)
    back_ms = _cpu_ms(lambda: splat_back(prepared, viewmat, K, width, height, residual))
    prepare_ms = _cpu_ms(lambda: prepare_gaussians(gaussians), repeats=3)
    result = [
        _make_row(f"frame, {label}", frame_ms, "CPU-ms", f"limit {limit_ms:g}", limit_ms),
        _make_row(f"transpose, {label}", back_ms, "CPU-ms", "frame", frame_ms),
        _make_row(f"preparation, {label}", prepare_ms, "CPU-ms", "frame", frame_ms),
        clip,
    ]
    if count <= NUMPY_LIMIT:
        numpy_ms = _cpu_ms(lambda: rasterise_reference(gaussians, viewmat, K, width, height), repeats=1)
        result.append(_make_row(f"frame, {label}", frame_ms, "CPU-ms", "NumPy twin", numpy_ms))
    return result


def _make_row(
    name: str, value: float, unit: str, peer: str | None, peer_value: float | None
) -> dict[str, Any]:
    ratio = None if peer_value is None else value / peer_value
    return {"name": name, "value": value, "unit": unit, "peer": peer, "ratio": ratio}


def _cpu_ms(work: Callable[[], object], repeats: int = FRAMES) -> float:
    """Median CPU time of one call, after one that compiles or loads what it needs [CPU-ms]."""
    if repeats > 1:
        work()
    times = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        times.append(time.process_time() - started)
    return 1000 * median(times)


def _peak_memory_mib() -> float:
    """Return the peak memory of this process after drawing the largest cloud [MiB]."""
    count, width, height, _ = VIEWS[1]
    viewmat, K = driver_view(STATION, width, height)
    prepared = prepare_gaussians(make_corridor(count))
    for _ in range(3):
        rasterise_view(prepared, viewmat, K, width, height)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    if sys.argv[1:] == ["memory"]:
        print(_peak_memory_mib())
    else:
        for row in measure_rows():
            ratio = "" if row["ratio"] is None else f"{row['ratio']:.4f} of {row['peer']}"
            print(f"{row['name']:48} {row['value']:10.1f} {row['unit']:8} {ratio}")
