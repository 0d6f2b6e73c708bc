"""What is in a dataset, and what a grid would make: for people, without making anything."""

from pathlib import Path
from typing import Any

from flows.audit import read_manifest
from flows.clip import TICK_RATE_HZ
from flows.plan import make_plan
from flows.store.layout import Layout

CPU_SECONDS_PER_FRAME = 0.2
"""Measured on the built-in street at 480 x 320 with its pose check; the estimate's only constant."""


def describe(dataset: str) -> dict[str, Any]:
    """Counts, sizes, settings and one line per clip of a sealed dataset.

    Raises
    ------
    InputError
        If the folder is no sealed dataset.
    """
    layout = Layout(Path(dataset).resolve())
    manifest = read_manifest(layout)
    settings = manifest["grid"]
    return {
        "run_id": manifest["run_id"],
        "grid": settings["name"],
        "scene": settings["scene"],
        "vehicle": settings["vehicle"],
        "vehicle_mode": settings["vehicle_mode"],
        "camera": settings["camera"],
        "frames_per_clip": settings["frames"],
        "frame_rate_hz": settings["frame_rate_hz"],
        "megabytes": round(sum(f.stat().st_size for f in layout.root.rglob("*") if f.is_file()) / 1e6, 1),
        "clips": [
            {"clip_id": clip["clip_id"], "label": clip["label"]}
            | {
                k: clip["figures"][k]
                for k in ("surface_friction", "tyre_peak", "stopping_distance", "peak_pitch")
            }
            | {"passed": clip["verdict"]["passed"]}
            for clip in manifest["clips"]
        ],
    }


def validate(grid: str) -> dict[str, Any]:
    """Check a grid without making anything; counts and estimates.

    Raises
    ------
    InputError
        Listing every problem of the grid.
    """
    plan, _ = make_plan(grid, "cpu")
    settings = plan.settings
    frames = len(plan.clips) * settings.frames
    return {
        "grid": settings.name,
        "run_id": plan.run_id,
        "clips": len(plan.clips),
        "frames": frames,
        "ticks": len(plan.clips) * (int(plan.duration_s * TICK_RATE_HZ) + 1),
        "cpu_minutes_estimate": round(frames * CPU_SECONDS_PER_FRAME / 60, 1),
        "labels": [clip.label for clip in plan.clips],
    }
