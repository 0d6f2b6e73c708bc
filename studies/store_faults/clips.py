"""A grid whose clips cost next to nothing, so that the store is what is studied: motion once, pictures at random."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import flows.making.clip
import flows.making.driving
import flows.making.generate
from flows.making.catalogue import Catalogue
from flows.making.gate import nothing_to_judge
from flows.making.plan import Plan, make_plan

GRID = """\
name: store-faults
camera: {camera}
frames: 3
axes:
  weather:
    dry: {{weather: dry}}
    rain-25: {{weather: rain, precipitation_mm_h: 25}}
  speed:
    slow: {{initial_speed_km_h: 30}}
    fast: {{initial_speed_km_h: 60}}
"""
CAMERA = """\
name: tiny
width: {value: 16, unit: px, source: a picture is written and not looked at}
height: {value: 16, unit: px, source: a picture is written and not looked at}
focal_length: {value: 16, unit: px, source: a picture is written and not looked at}
behind_front_axle: {value: 0.6, unit: m, source: as a dashcam}
left_of_centre: {value: 0.0, unit: m, source: as a dashcam}
height_above_road: {value: 1.4, unit: m, source: as a dashcam}
exposure: {value: 0.008, unit: s, source: as a dashcam}
"""


def write_grid(folder: Path) -> str:
    """Write the grid and its camera into a folder; returns the grid's file."""
    (folder / "camera.yaml").write_text(CAMERA)
    (folder / "grid.yaml").write_text(GRID.format(camera=folder / "camera.yaml"))
    return str(folder / "grid.yaml")


@contextmanager
def cheap_clips() -> Iterator[None]:
    """Clips whose motion is worked out once and whose pictures are noise keyed by the clip's seed."""
    with (
        mock.patch.object(flows.making.generate, "make_plan", lru_cache(make_plan)),
        mock.patch.object(
            flows.making.clip, "simulate_drive", _memoise_function(flows.making.driving.simulate_drive)
        ),
        mock.patch.object(flows.making.clip, "render_frames", _draw_noise),
        mock.patch.object(flows.making.clip, "judge_motion", _judge_nothing),
    ):
        yield


def _memoise_function(function: Any) -> Any:
    known: dict[Any, Any] = {}

    def remembered(scenario: Any, *rest: Any) -> Any:
        key = (scenario, rest[-1])
        if key not in known:
            known[key] = function(scenario, *rest)
        return known[key]

    return remembered


def _draw_noise(
    scenario: Any,
    facts: Mapping[str, Any],
    frames: Mapping[str, Any],
    plan: Plan,
    catalogue: Catalogue,
    seed: int,
    rig_at: Any,
    shown: range | None,
) -> dict[str, Any]:
    return _make_noise(seed, plan.settings.frames, catalogue.camera.height, catalogue.camera.width)


@lru_cache
def _make_noise(seed: int, frames: int, height: int, width: int) -> dict[str, Any]:
    draw = np.random.Generator(np.random.Philox(seed))
    shape = (frames, height, width)
    return {
        "rgb": draw.integers(0, 256, (*shape, 3), np.uint8),
        "depth": draw.random(shape, np.float32),
        "class": draw.integers(0, 11, shape, np.uint8),
    }


def _judge_nothing(
    buffers: Any, frames: Mapping[str, Any], film: float, catalogue: Catalogue, camera: Any
) -> dict[str, Any]:
    return nothing_to_judge(len(frames["frame"]), "pictures of noise")
