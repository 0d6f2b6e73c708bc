"""docs/how-to/describe-your-car.md: its file is a car, its commands run as they stand, its sentence is what is said."""

import re
import shlex

from typer.testing import CliRunner

from catalogs.entries import load
from catalogs.vehicles import open_vehicle
from flows.cli import app
from manifests.provenance import SOURCE_ROOT

TEXT = (SOURCE_ROOT / "docs" / "how-to" / "describe-your-car.md").read_text()


def blocks(language: str) -> list[str]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", TEXT, flags=re.M | re.S)
    return [content.strip() for named, content in found if named == language]


def test_the_commands_run_on_the_car_of_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    new, check, use = (shlex.split(block)[1:] for block in blocks(""))
    run = CliRunner().invoke
    assert run(app, new).exit_code == 0
    car, effects = blocks("yaml")
    (tmp_path / "my-car.yaml").write_text(car)
    checked = run(app, check)
    assert checked.exit_code == 1 and "my-car.yaml: road_load must lie within" in checked.output
    assert run(app, use).exit_code == 0
    kept, own = (
        load("vehicle", tmp_path / p) for p in ("datasets/my-car/inputs/vehicle.yaml", "my-car.yaml")
    )
    assert (kept.mass, kept.families) == (own.mass, own.families) == (1285, own.families)
    assert len(open_vehicle(tmp_path / "my-car.yaml").tolerances) == car.count("tolerance:")
    (tmp_path / "my-car.yaml").write_text(f"{car}\n{effects}\n")
    checked = run(app, check)
    assert checked.exit_code == 0 and "my-car.yaml: every figure is plausible" in checked.output
    assert set(load("vehicle", tmp_path / "my-car.yaml").effects) == {
        "drag_area",
        "rolling_coefficient",
        "engine_torque",
    }


def test_the_sentence_is_what_the_command_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    car, _ = blocks("yaml")
    (wrong,) = re.findall(r"`(wheel_radius: \{.*?\})`", TEXT)
    (tmp_path / "my-car.yaml").write_text(re.sub(r"^wheel_radius: .*$", wrong, car, flags=re.M))
    said = CliRunner().invoke(app, ["vehicle", "check", "my-car.yaml"])
    (sentence,) = blocks("text")
    assert said.exit_code == 1 and f"my-car.yaml: {sentence}" in said.output
