"""The clips of a sound dataset follow from the grid that it records, whose keys are sorted; a changed clip does not."""

import json
from dataclasses import replace

import pytest

from catalogs.entries import entry_names
from flows.auditing.grid_again import find_grid_contradictions
from flows.making.plan import Plan, make_plan
from flows.store.layout import encode_json
from flows.store.sealed import recorded_grid
from tests.toy_street import write_toy_grid

BLOCKS = """\
name: blocks
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 2
pictures: false
visual_seeds: 2
base: {{initial_speed_km_h: 40}}
axes:
  road:
    hump: {{hazard_center_m: 4, hazard_length_m: 3.7, hazard_height_m: 0.075, initial_speed_km_h: 30}}
    flat: {{}}
  drive:
    quick: {{initial_speed_km_h: 60}}
    as-it-is: {{}}
zip:
  weather:
    wet: {{weather: rain, precipitation_mm_h: 10}}
    dry: {{weather: dry}}
  brake:
    soft: {{peak_pressure_mpa: 1.2}}
    hard: {{peak_pressure_mpa: 2.3}}
latin_hypercube: {{count: 3, ranges: {{ramp_s: [0.1, 0.5], brake_onset_s: [0.0, 0.05]}}}}
exclude: [{{weather: dry, initial_speed_km_h: 60}}]
splits: {{wet: {{weather: rain}}, all: {{}}}}
"""


def plan_as_recorded(grid: str) -> Plan:
    """A plan whose settings were written and read."""
    plan, _ = make_plan(grid, "cpu")
    written = json.loads(encode_json(plan.settings.model_dump(mode="json")))
    return replace(plan, settings=recorded_grid(written, "plan.json"))


@pytest.mark.parametrize("name", entry_names("grid"))
def test_the_clips_of_every_grid_that_ships_follow_from_its_record(name):
    assert find_grid_contradictions(plan_as_recorded(name), True) == []


def test_clips_follow_whatever_blocks_a_grid_has_and_in_whatever_order_its_axes_overrule_each_other(tmp_path):
    plan = plan_as_recorded(write_toy_grid(tmp_path, BLOCKS))
    assert find_grid_contradictions(plan, True) == []
    first, *others = plan.clips
    faster = replace(first, scenario=replace(first.scenario, initial_speed_km_h=61.0))
    (told,) = find_grid_contradictions(replace(plan, clips=(faster, *others)), True)
    assert (
        told
        == f"manifest.json: initial_speed_km_h of clip {first.label} must be 60.0, by its grid; it is 61.0"
    )
