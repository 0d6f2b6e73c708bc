"""The law of wet friction of a grid: by film and speed in coupled mode, the paper's in paper mode and older records."""

import pytest

from catalogs.entries import load
from flows.auditing.explain import explain_frame
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan
from flows.store.sealed import read_manifest, recorded_grid
from studies.physics_judge.audit_physics import audit_physics
from tests.toy_street import write_toy_grid

GRID = """
name: wet
pictures: false
frames: 8
frame_rate_hz: 10
duration_s: 2.5
vehicle_mode: coupled
base: {initial_speed_km_h: 100, peak_pressure_mpa: 6, ramp_s: 0.2, brake_onset_s: 0.1}
scenarios:
  dry: {weather: dry}
  storm: {weather: rain, precipitation_mm_h: 50}
"""


@pytest.fixture(scope="module")
def storm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wet")
    grid = write_toy_grid(folder, GRID.replace("{", "{{").replace("}", "}}") + "scene: {folder}/scene\n")
    return generate_dataset(grid, str(folder / "data"), runner="threads", workers=1).layout


def test_a_coupled_dataset_grips_by_speed_and_every_stored_number_follows(storm):
    manifest = read_manifest(storm)
    assert manifest["grid"]["wet_friction"] == "by-speed" and "wet_friction.yaml" in manifest["inputs"]
    for frame in (0, 7):
        told = explain_frame(str(storm.root), "storm", frame)
        assert told["agrees"], [step for step in told["steps"] if not step["agrees"]]
    assert audit_physics(str(storm.root), out=str(storm.root.parent))["verified"]


def test_the_law_decides_the_ids_and_a_record_without_it_means_the_papers(tmp_path):
    grid = load("grid", write_toy_grid(tmp_path, GRID.replace("{", "{{").replace("}", "}}")))

    def plan_with(**changes):
        changed = grid.settings.model_copy(update={"scene": "street", **changes})
        return make_plan(type(grid)(settings=changed, scenarios=grid.scenarios, tags=grid.tags), "cpu")[0]

    new, old = plan_with(), plan_with(wet_friction="paper")
    assert new.clips[1].clip_id != old.clips[1].clip_id
    record = old.settings.model_dump(mode="json")
    assert "wet_friction" not in record and recorded_grid(record, "plan.json") == old.settings
    paper, same = plan_with(vehicle_mode="paper"), plan_with(vehicle_mode="paper", wet_friction="paper")
    assert (paper.run_id, paper.settings) == (same.run_id, same.settings)
