"""The memory of the process that drives a run hardly grows with the number of clips."""

import gc
import json
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
import yaml

import flows.making.generate
from catalogs.scenario import SCENARIO_FIELDS, Scenario
from flows.making.clip import make_clip
from flows.making.generate import generate_dataset
from flows.making.plan import read_plan
from flows.store.layout import Layout

FEW, MANY = 150, 450
LARGEST_GROWTH = 4096
"""Of the peak with every further clip [B]: plan, row of numbers, pairs; 3.1 KB, 5.2 where receipts are kept."""


def write_grid(folder: Path, clips: int) -> str:
    weather = {f"rain-{k}": {"weather": "rain", "precipitation_mm_h": 5 + 5 * k} for k in range(5)}
    speed = {f"speed-{k}": {"initial_speed_km_h": 30 + k} for k in range(6)}
    brake = {
        f"brake-{k}": {"peak_pressure_mpa": 1 + k / clips, "brake_onset_s": 0} for k in range(clips // 30)
    }
    grid = {
        "name": "many",
        "scene": "street",
        "frames": 2,
        "axes": {"weather": weather, "speed": speed, "brake": brake},
    }
    path = folder / f"many-{clips}.yaml"
    path.write_text(yaml.safe_dump(grid, sort_keys=False))
    return str(path)


class CopiedClips:
    """Makes the first clip, and of each other one a receipt of the same size."""

    def __init__(self) -> None:
        self.first: dict[str, Any] = {}
        self.planning = 0

    def __call__(self, layout: Layout, index: int, scene: str) -> dict[str, Any]:
        if index == 0:  # planning, which reads the scene, needs more than a few clips do
            self.planning = tracemalloc.get_traced_memory()[1] if tracemalloc.is_tracing() else 0
            tracemalloc.reset_peak()
        if not self.first:
            self.first = make_clip(layout, index, scene)
        clip = read_plan(layout.root).clips[index]
        receipt = self.first | clip.as_json()
        cost = receipt.pop("cost")
        layout.receipt(clip.clip_id).write_text(json.dumps(receipt))
        # as it comes from a worker: numbers and keys that nobody else holds
        return json.loads(json.dumps(receipt)) | {"cost": dict(cost)}


def write_nothing(layout: Layout, table: str, path: str, clip_ids: list[str]) -> Path:
    """In place of a hundred clips' tables, which are let go of before the next hundred."""
    (layout.root / path).parent.mkdir(parents=True, exist_ok=True)
    (layout.root / path).write_bytes(b"")
    return layout.root / path


def measure_peak(folder: Path, clips: int) -> int:
    folder.mkdir(exist_ok=True)
    grid = write_grid(folder, clips)
    read_plan.cache_clear()
    gc.collect()
    tracemalloc.start()
    try:
        report = generate_dataset(grid, str(folder / str(clips)), workers=1, pictures=False)
        assert report.made == clips
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.minutes
def test_the_peak_of_a_run_hardly_grows_with_its_clips(tmp_path, monkeypatch):
    made = CopiedClips()
    monkeypatch.setattr(flows.making.generate, "make_clip", made)
    monkeypatch.setattr("flows.making.gathering.write_part", write_nothing)
    monkeypatch.setattr("flows.making.seal.BATCH", 50)
    monkeypatch.setattr("flows.running.runner.IN_FLIGHT", 100)
    measure_peak(tmp_path, 30)
    few, planned_few = measure_peak(tmp_path / "few", FEW), made.planning
    # a thread that an earlier test left may allocate meanwhile: it can only add
    readings = [(measure_peak(tmp_path / name, MANY), made.planning) for name in ("many", "again")]
    many, planned_many = map(min, zip(*readings, strict=True))
    for less, more in ((few, many), (planned_few, planned_many)):
        growth = (more - less) / (MANY - FEW)
        assert growth < LARGEST_GROWTH, f"{growth:.0f} B a clip"


def test_a_scenario_keeps_no_dictionary_of_its_own() -> None:
    scenario = Scenario()
    assert list(scenario.as_row()) == list(SCENARIO_FIELDS) and not hasattr(scenario, "__dict__")
