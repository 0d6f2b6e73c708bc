"""Summaries of a dataset and of the clips that a grid would make; nothing is made."""

from collections import Counter
from dataclasses import replace
from typing import Any, Literal

from catalogs.entries import load
from catalogs.grids import GridFile, warn_of_late_brakes
from catalogs.variants import warn_of_variant
from flows.making.bends import warn_of_bends
from flows.making.grid_entries import read_entries
from flows.making.plan import make_plan
from flows.store.address import open_for_reading, stored_bytes, want_manifest
from flows.store.sealed import read_manifest, recorded_grid
from manifests.manifest import describe_scenes
from tasks.render.camera import Camera

CPU_SECONDS_PER_FRAME, CPU_SECONDS_PER_MEGAPIXEL = 0.1, 0.24
"""Of a finished frame with its pose check, on the built-in street: the demo, and a dry clip at 1280 x 720."""
CPU_SECONDS_PER_CLIP = 0.1
"""Of a clip without frames, its label ranges included: 0.07 on a flat road, 0.2 over a road feature."""
BYTES_PER_PIXEL, BYTES_OF_LABELS_PER_PIXEL, BYTES_PER_TICK = 2.4, 3.8, 76
"""On the disk, compressed: measured on the built-in street; noise and another scene's texture cost more."""


def describe_dataset(dataset: str) -> dict[str, Any]:
    """Counts, sizes, settings and one line per clip of a sealed dataset.

    Raises
    ------
    InputError
        If the folder is no sealed dataset.
    """
    layout = open_for_reading(dataset, want_manifest)
    manifest = read_manifest(layout)
    settings = manifest["grid"]
    variant = recorded_grid(settings, layout.manifest).variant
    return {
        "run_id": manifest["run_id"],
        "grid": settings["name"],
        "scene": describe_scenes(manifest),
        "vehicle": settings["vehicle"],
        "vehicle_mode": settings["vehicle_mode"],
        "variant": variant,
        **({"warning": warning} if (warning := warn_of_variant(variant)) else {}),
        "camera": settings["camera"],
        "frames_per_clip": settings["frames"],
        "frame_rate_hz": settings["frame_rate_hz"],
        "megabytes": round(stored_bytes(layout) / 1e6, 1),
        "clips": [
            {"clip_id": clip["clip_id"], "label": clip["label"]}
            | {
                k: clip["figures"].get(k)
                for k in ("surface_friction", "tyre_peak", "stopping_distance", "peak_pitch")
            }
            | {"passed": clip["verdict"]["passed"]}
            for clip in manifest["clips"]
        ],
    }


def estimate_cost(settings: GridFile, camera: Camera, clips: int, *, pictures: bool) -> dict[str, float]:
    """Return what clips take by experience: ``cpu_minutes`` [min] and ``megabytes`` [MB].

    Parameters
    ----------
    settings : of the grid
    camera : that sees them
    clips : number of them [1]
    pictures : whether frames are made and stored; else telemetry alone
    """
    frames = clips * settings.frames if pictures else 0
    pixels = frames * camera.width * camera.height
    per_pixel = BYTES_PER_PIXEL + (BYTES_OF_LABELS_PER_PIXEL if settings.labels else 0)
    seconds = CPU_SECONDS_PER_CLIP * clips + CPU_SECONDS_PER_FRAME * frames
    seconds += CPU_SECONDS_PER_MEGAPIXEL * pixels / 1e6
    stored = per_pixel * pixels + BYTES_PER_TICK * clips * settings.rows_per_clip["ticks"]
    return {"cpu_minutes": round(seconds / 60, 1), "megabytes": round(stored / 1e6, 1)}


def validate_grid(
    grid: str, *, vehicle: str | None = None, pictures: bool | Literal["later"] = True
) -> dict[str, Any]:
    """Check a grid without making anything; counts and estimates, of frames stored and of frames made when read.

    Parameters
    ----------
    grid : grid file, or the name of one that ships
    vehicle, pictures : as of `flows.making.generate.generate_dataset`

    Raises
    ------
    InputError
        Listing every problem of the grid.
    """
    plan, _ = make_plan(grid, "cpu", vehicle, pictures=pictures)
    settings = plan.settings
    read = load("grid", grid)
    # the plan records the name of a file, without its folder
    driven = {"vehicle": vehicle or read.settings.vehicle, "vehicle_mode": settings.vehicle_mode}
    read = replace(read, settings=read.settings.model_copy(update=driven))
    entries = read_entries(read.settings)
    warnings = [
        w
        for w in (warn_of_variant(settings.variant), warn_of_late_brakes(read), warn_of_bends(read, entries))
        if w
    ]
    count = len(plan.clips)
    stored, telemetry = (
        estimate_cost(settings, entries.camera, count, pictures=pictures) for pictures in (True, False)
    )
    asked = stored if settings.stores_frames else telemetry
    return {
        "grid": settings.name,
        "run_id": plan.run_id,
        **({"warning": "; ".join(warnings)} if warnings else {}),
        "clips": count,
        "frames": count * settings.frames if settings.pictures else 0,
        "ticks": count * plan.ticks_per_clip,
        "cpu_minutes_estimate": asked["cpu_minutes"],
        "megabytes_estimate": asked["megabytes"],
        **(
            {
                "frames_estimates": [
                    {"frames": "stored", **stored, "cpu_minutes_when_read": 0.0},
                    {"frames": "later", **telemetry, "cpu_minutes_when_read": stored["cpu_minutes"]},
                ]
            }
            if settings.pictures
            else {}
        ),
        "calibration": dict(Counter(clip.calibration for clip in plan.clips)),
        "splits": dict(Counter(clip.split for clip in plan.clips if clip.split)),
        "labels": [clip.label for clip in plan.clips],
    }
