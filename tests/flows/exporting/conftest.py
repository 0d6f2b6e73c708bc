"""Two clips of the small dataset, exported; and what the dataset itself says of them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import musync
from flows.exporting.export import export_dataset

BRAKING, HUMP = "dry/flat", "snow-3/hump"


@dataclass(frozen=True)
class Stored:
    """A clip as the dataset holds it, read by the analysts' door and not by the exporters'."""

    label: str
    clip_id: str
    ticks: Any
    frames: Any
    pixels: dict[str, np.ndarray]
    T_world_rig: np.ndarray


@pytest.fixture(scope="session")
def stored(toy_dataset) -> dict[str, Stored]:
    data = musync.open(toy_dataset.root)
    return {
        label: Stored(
            label=label,
            clip_id=data[label].clip_id,
            ticks=data[label].pandas("ticks"),
            frames=data[label].pandas("frames"),
            pixels={name: np.asarray(data.frames[name][data[label].record["index"]]) for name in data.frames},
            T_world_rig=np.stack(data[label].pandas("frames")["T_world_rig"]).reshape(-1, 4, 4),
        )
        for label in (BRAKING, HUMP)
    }


@pytest.fixture(scope="session")
def export(toy_dataset, tmp_path_factory) -> Callable[[str], Path]:
    """Return a function that exports the two clips once and returns the folder."""
    made: dict[str, Path] = {}

    def to(name: str) -> Path:
        if name not in made:
            folder = tmp_path_factory.mktemp("exported") / name
            export_dataset(str(toy_dataset.root), name, out=str(folder), clips=[BRAKING, HUMP])
            made[name] = folder
        return made[name]

    return to
