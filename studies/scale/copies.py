"""Datasets of many short clips at little cost: one clip is made, and the others are copies of it."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import pyarrow as pa

from flows.making.clip import make_clip
from flows.making.plan import ClipPlan, read_plan
from flows.store.layout import STAGED_TABLES, Layout, write_json
from flows.store.telemetry import read_table, write_parquet
from manifests.canonical import sha256_of_file

LEVELS = 10
COST = {"cpu_s": 0.0, "wall_s": 0.0, "peak_memory_mib": 0.0}


def grid_of(clips: int) -> dict[str, Any]:
    """A grid of at least that many clips of a twentieth of a second: ten weathers, ten pressures, and speeds."""
    rain = {f"rain-{r}": {"weather": "rain", "precipitation_mm_h": r} for r in (2, 5, 10, 25, 50)}
    snow = {
        f"snow-{r}": {"weather": "snow", "precipitation_mm_h": r, "snow_accumulation_h": 1}
        for r in (0.5, 1, 2, 3)
    }
    speeds = -(-clips // LEVELS**2)
    return {
        "name": "scale",
        "frames": 2,
        "frame_rate_hz": 20,
        "base": {"brake_onset_s": 0.0},
        "axes": {
            "weather": {"dry": {"weather": "dry"}, **rain, **snow},
            "pressure": {f"p{i}": {"peak_pressure_mpa": 0.5 + 0.2 * i} for i in range(LEVELS)},
            "speed": {f"v{i}": {"initial_speed_km_h": 30 + 60 * i / speeds} for i in range(speeds)},
        },
    }


class CopiedClips:
    """Stands in for the workers that make clips and gather tables; writes what they would, where they would."""

    def __init__(self) -> None:
        self.receipt: dict[str, Any] = {}
        self.tables: dict[str, pa.Table] = {}
        self.clips: dict[str, ClipPlan] = {}

    def make_clip(self, layout: Layout, index: int, scene: str) -> dict[str, Any]:
        """Write a receipt; the first call makes its clip."""
        clip = read_plan(layout.root).clips[index]
        if not self.receipt:
            # elsewhere, as a driver leaves it to its workers
            with ProcessPoolExecutor(1, get_context("spawn")) as worker:
                self.receipt = worker.submit(make_clip, layout, index, scene).result()
            del self.receipt["cost"]
            rows = read_plan(layout.root).settings.rows_per_clip
            self.tables = {
                name: read_table(layout.staged(clip.clip_id, name), most=rows[name]) for name in STAGED_TABLES
            }
        receipt = self.receipt | clip.as_json()
        write_json(layout.receipt(clip.clip_id), receipt)
        return receipt | {"cost": COST}

    def gather_part(self, layout: Layout, table: str, path: str, clip_ids: Sequence[str], rows: int) -> str:
        """Write a file of the first clip's rows once for each clip."""
        if not self.clips:
            self.clips = {clip.clip_id: clip for clip in read_plan(layout.root).clips}
        copies = [_relabel(self.tables[table], self.clips[clip_id]) for clip_id in clip_ids]
        write_parquet(pa.concat_tables(copies).unify_dictionaries().combine_chunks(), layout.root / path)
        return sha256_of_file(layout.root / path)


def _relabel(table: pa.Table, clip: ClipPlan) -> pa.Table:
    """The rows of a table as those of another clip."""
    identity = {"clip_id": clip.clip_id, "label": clip.label, "weather": clip.scenario.weather}
    for name, value in identity.items():
        place = table.schema.get_field_index(name)
        column = pa.repeat(pa.scalar(value), len(table)).dictionary_encode()
        table = table.set_column(place, table.schema.field(place), column)
    return table
