"""The copy of a vehicle that extends another one is made again from the files that it was made of."""

from pathlib import Path

from flows.auditing.repair import repair_dataset
from flows.making.generate import generate_dataset
from tests.toy_street import write_toy_grid

GRID = """
name: toy
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 4
frame_rate_hz: 10
axes: {{weather: {{dry: {{weather: dry}}}}}}
"""


def test_a_damaged_copy_is_repaired_to_the_recorded_bytes(tmp_path: Path) -> None:
    write_toy_grid(tmp_path, GRID)
    car, out = tmp_path / "car.yaml", tmp_path / "data"
    car.write_text("extends: paper-reference\nsprung_mass: {value: 1500, unit: kg, source: scales}\n")
    generate_dataset(
        str(tmp_path / "grid.yaml"), str(out), runner="threads", workers=1, vehicle=str(car), pictures=False
    )
    kept = out / "inputs" / "vehicle.yaml"
    before = kept.read_bytes()
    kept.write_bytes(before.replace(b"1500", b"1501"))
    assert repair_dataset(str(out), runner="threads", workers=1)["restored"] == ["inputs/vehicle.yaml"]
    assert kept.read_bytes() == before
