"""The memory that a clip is estimated to need, held against what it takes."""

import gc
import tracemalloc
from pathlib import Path

import pytest

from catalogs.scenes import write_scene
from flows.making.catalogue import catalogue_of
from flows.making.generate import generate_dataset
from flows.making.memory import clip_memory
from flows.making.plan import read_plan
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """\
name: clip-{frames}
scene: flat
camera: camera.yaml
frames: {frames}
frame_rate_hz: 100
scenarios:
  one: {{weather: dry, initial_speed_km_h: 30, hold_speed: true}}
"""
LENS = "".join(
    f'{name}: {{value: {value}, unit: "1", source: test}}\n' for name, value in (("k1", -0.3), ("k2", 0.1))
)
ROLLING = "line_delay: {value: 1.0e-4, unit: s, source: test}\n"
FEW, MANY = 3, 13


def measure_clip(folder: Path, frames: int) -> tuple[int, int]:
    """The peak of what Python and NumPy hold while a clip is made, and the estimate [B]."""
    grid, root = write_grid(folder, frames), folder / str(frames)
    gc.collect()
    tracemalloc.start()
    try:
        generate_dataset(grid, str(root), runner="threads", workers=1)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    settings = read_plan(root).settings
    ticks = round(settings.telemetry_s * 2000) + 1
    return peak, clip_memory(settings, catalogue_of(root).camera, ticks)


def write_grid(folder: Path, frames: int) -> str:
    grid = folder / f"{frames}.yaml"
    grid.write_text(GRID.format(frames=frames))
    return str(grid)


@pytest.mark.parametrize("lens", ["", LENS + ROLLING])
def test_a_clip_grows_with_its_frames_as_estimated(lens: str, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_scene(toy_street(1), tmp_path / "flat", {})
    camera = TOY_CAMERA.replace("value: 96", "value: 192").replace("value: 64", "value: 128")
    Path("camera.yaml").write_text(camera.replace("value: 80", "value: 160") + lens)
    # what is loaded and compiled once belongs to no clip
    generate_dataset(write_grid(tmp_path, FEW), str(tmp_path / "untraced"), runner="threads", workers=1)
    (few, least), (many, most) = (measure_clip(tmp_path, n) for n in (FEW, MANY))
    assert many - few == pytest.approx(most - least, rel=0.25)
