"""What the road asks of a car: clips that no tyre keeps on a bend, or no strut on a feature, are refused or named."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenes import write_scene
from flows.making.bends import list_tight_bends
from flows.making.generate import generate_dataset
from flows.making.grid_entries import read_entries
from flows.making.plan import make_plan
from flows.reading.describe import validate_grid
from flows.store.sealed import read_manifest
from tasks.errors import InputError
from tasks.scene.route import route_from_positions
from tests.toy_street import TOY_CAMERA, toy_street

RADIUS = 50.0
GRID = """\
name: bend
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 3
frame_rate_hz: 5
duration_s: 3
pictures: false
scenarios:
  {scenario}
"""


def write_bend(folder: Path, *scenarios: str) -> str:
    """A grid on a route of 40 m that turns left with a radius of 50 m from station 15 on."""
    s = np.linspace(0.0, 40.0, 161)
    turned = np.maximum(s - 15.0, 0.0) / RADIUS
    x, y = np.minimum(s, 15.0) + RADIUS * np.sin(turned), RADIUS * (1 - np.cos(turned))
    write_scene(
        replace(toy_street(), route=route_from_positions(np.stack([x, y, 0 * s], axis=1))),
        folder / "scene",
        {},
    )
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    (folder / "grid.yaml").write_text(GRID.format(folder=folder, scenario="\n  ".join(scenarios)))
    return str(folder / "grid.yaml")


def test_more_than_the_grip_is_refused_with_clip_station_demand_and_what_there_is(tmp_path):
    grid = write_bend(
        tmp_path, "ice: {weather: ice, initial_speed_km_h: 28.8}", "dry: {initial_speed_km_h: 28.8}"
    )
    with pytest.raises(InputError) as caught:
        make_plan(grid, "cpu")
    (problem,) = caught.value.problems
    for words in (
        "scenario ice: the bend at station",
        "asks 1.28 m/s2 at 29 km/h",
        "gives 0.98",
        "drive more slowly",
    ):
        assert words in problem


def test_more_than_half_of_the_grip_is_named_and_stands_in_the_clip(tmp_path):
    grid = write_bend(tmp_path, "fast: {initial_speed_km_h: 60}", "slow: {initial_speed_km_h: 30}")
    warning = validate_grid(grid)["warning"]
    assert "scenario fast asks more than half of the grip" in warning and "slow" not in warning
    layout = generate_dataset(grid, str(tmp_path / "data"), runner="threads", workers=1).layout
    asked = [clip["figures"]["lateral_demand"] for clip in read_manifest(layout)["clips"]]
    np.testing.assert_allclose(asked, [(v / 3.6) ** 2 / RADIUS for v in (60, 30)], rtol=0.01)


def test_a_car_that_stands_before_the_bend_is_not_refused(tmp_path):
    stop = "{weather: snow, precipitation_mm_h: 1, snow_accumulation_h: 1, initial_speed_km_h: 45"
    brake = ", peak_pressure_mpa: 2.3, ramp_s: 0.1, brake_onset_s: 0}"
    grid = write_bend(tmp_path, f"brakes: {stop}{brake}", f"coasts: {stop}}}")
    asked = load("grid", grid)
    assert [bend.label for bend in list_tight_bends(asked, read_entries(asked.settings))] == ["coasts"]


def test_a_grid_without_such_clips_drives_none(tmp_path, monkeypatch):
    monkeypatch.setattr("flows.making.bends.simulate_drive", None)
    make_plan(write_bend(tmp_path, "slow: {initial_speed_km_h: 30}"), "cpu")


def test_a_feature_that_moves_a_strut_beyond_its_stops_is_refused_at_that_speed_alone(tmp_path):
    hump = "hazard_center_m: 20, hazard_length_m: 10, hazard_height_m: 0.6}"
    with pytest.raises(InputError) as caught:
        make_plan(
            write_bend(
                tmp_path, f"slow: {{initial_speed_km_h: 8, {hump}", f"fast: {{initial_speed_km_h: 60, {hump}"
            ),
            "cpu",
        )
    (problem,) = caught.value.problems
    assert (
        "scenario fast: strut travel on the road feature of 10 x 0.6 m at 60 km/h must be at most 0.1 m"
        in problem
    )
