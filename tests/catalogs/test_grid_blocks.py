"""The ways to write a grid down, what it leaves out, its splits, and its place in the calibrated range."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator

from catalogs.calibrated_range import calibration_tag
from catalogs.entries import entry_names, find_entry, load
from catalogs.grids import GridFile, expand_grid, warn_of_late_brakes
from catalogs.grids.schema import grid_schema
from catalogs.scenario import Scenario
from tasks.errors import InputError


def grid_of(text: str):
    return expand_grid(GridFile.model_validate(yaml.safe_load(text) | {"name": "t"}), "t")


def write_grid(folder: Path, body: str) -> Path:
    file = folder / "grid.yaml"
    file.write_text(f"{{name: t, {AXES}, {body}}}")
    return file


def speeds(grid) -> list[tuple[str, float]]:
    return [(label, scenario.initial_speed_km_h) for label, scenario in grid.scenarios]


def test_zipped_axes_go_in_step():
    grid = grid_of(
        "{zip: {w: {dry: {}, wet: {weather: rain, precipitation_mm_h: 5}},"
        " v: {fast: {initial_speed_km_h: 80}, slow: {initial_speed_km_h: 30}}}}"
    )
    assert speeds(grid) == [("dry/fast", 80), ("wet/slow", 30)]


def test_a_list_is_made_in_its_order_and_blocks_multiply_later_over_earlier():
    grid = grid_of(
        "{axes: {a: {x: {initial_speed_km_h: 20}, y: {}}}, scenarios: {p: {initial_speed_km_h: 30}, q: {}}}"
    )
    assert speeds(grid) == [("x/p", 30), ("x/q", 20), ("y/p", 30), ("y/q", 60)]


def test_a_grid_of_nothing_is_refused():
    with pytest.raises(ValueError, match="needs one of axes, zip, scenarios and latin_hypercube"):
        grid_of("{}")


CUBE = (
    "{latin_hypercube: {count: 40, seed: %d, ranges:"
    " {initial_speed_km_h: [20, 60], hazard_center_m: [10, 30]}}}"
)


def test_a_latin_hypercube_takes_one_value_from_each_stratum_of_each_range():
    scenarios = [scenario for _, scenario in grid_of(CUBE % 3).scenarios]
    for field, low, high in (("initial_speed_km_h", 20, 60), ("hazard_center_m", 10, 30)):
        values = np.array([getattr(scenario, field) for scenario in scenarios])
        assert sorted(np.floor((values - low) / (high - low) * 40).astype(int)) == list(range(40))


def test_a_latin_hypercube_follows_its_seed():
    assert grid_of(CUBE % 3).scenarios == grid_of(CUBE % 3).scenarios
    assert grid_of(CUBE % 3).scenarios != grid_of(CUBE % 4).scenarios


AXES = (
    "axes: {w: {dry: {}, wet: {weather: rain, precipitation_mm_h: 5}, flood: {weather: rain, precipitation_mm_h: 50}},"
    " v: {slow: {initial_speed_km_h: 40}, fast: {initial_speed_km_h: 60}}}"
)


def test_exclude_leaves_out_what_keeps_all_lines_of_one_condition():
    grid = grid_of(
        f"{{{AXES}, exclude: [{{weather: [rain, snow], initial_speed_km_h: {{min: 50}}}}, {{precipitation_mm_h: 50}}]}}"
    )
    assert [label for label, _ in grid.scenarios] == ["dry/slow", "dry/fast", "wet/slow"]
    assert grid.left_out == 3


def test_a_grid_that_excludes_everything_is_refused():
    with pytest.raises(InputError, match="leaves nothing to make"):
        grid_of(f"{{{AXES}, exclude: [{{initial_speed_km_h: {{min: 0}}}}]}}")


def test_a_clip_belongs_to_the_first_split_that_it_keeps():
    grid = grid_of(
        f"{{{AXES}, splits: {{dev: {{initial_speed_km_h: 60}}, wet: {{weather: rain}}, rest: {{}}}}}}"
    )
    assert [(label, split) for (label, _), (split, _) in zip(grid.scenarios, grid.tags, strict=True)] == [
        ("dry/slow", "rest"), ("dry/fast", "dev"), ("wet/slow", "wet"), ("wet/fast", "dev"),
        ("flood/slow", "wet"), ("flood/fast", "dev"),
    ]  # fmt: skip


def test_a_scenario_without_a_split_is_told():
    with pytest.raises(InputError, match="dry/slow and 2 more: belongs to no split"):
        grid_of(f"{{{AXES}, splits: {{fast: {{initial_speed_km_h: 60}}}}}}")


@pytest.mark.parametrize(
    ("condition", "told"),
    [
        ("weather: rian", "weather: must be dry, rain, snow, ice or fog; it is 'rian'"),
        ("weather: [rain, 3]", "weather: must be dry, rain, snow, ice or fog; it is '3.0'"),
        ("weather: {min: 3}", "weather: an interval is of numbers"),
        ("precipitation_mm_h: '5'", "precipitation_mm_h: must be a number or an interval; it is '5'"),
        ("precipitation_mm_h: true", "precipitation_mm_h: must be a number or an interval; it is True"),
        (
            "precipitation_mm_h: {min: 30, max: 20}",
            "precipitation_mm_h: an interval must ascend; it is 30 to 20",
        ),
        ("hold_speed: 'yes'", "hold_speed: must be true or false; it is 'yes'"),
    ],
)
def test_a_condition_that_no_scenario_can_meet_is_refused(tmp_path, condition, told):
    """It left nothing out, and its clips went to the split that takes the rest."""
    for name, body in (
        ("exclude.0", f"exclude: [{{{condition}}}]"),
        ("splits.a", f"splits: {{a: {{{condition}}}, b: {{}}}}"),
    ):
        with pytest.raises(InputError) as caught:
            load("grid", write_grid(tmp_path, body))
        assert [problem.split(": ", 1)[1] for problem in caught.value.problems if f"{name}.{told}" in problem]


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("exclude: [{precipitation_mm_h: 51}]", r"exclude\.0: leaves nothing out"),
        ("splits: {val: {initial_speed_km_h: {min: 90}}, train: {}}", r"splits\.val: gets no clip"),
        ("splits: {train: {}, test: {weather: rain}}", r"splits\.test: gets no clip"),
    ],
)
def test_a_condition_that_no_clip_of_the_grid_meets_is_refused(tmp_path, body, told):
    with pytest.raises(InputError, match=told):
        load("grid", write_grid(tmp_path, body))


@pytest.mark.parametrize(
    ("duration", "onset", "late"), [(8, 8.0, True), (8, 7.9, False), (10, 9.0, False), (10, 12.0, True)]
)
def test_a_brake_after_the_end_of_the_telemetry_is_warned_of(tmp_path, duration, onset, late):
    braked = f"peak_pressure_mpa: 2, brake_onset_s: {onset}"
    grid = tmp_path / "grid.yaml"
    grid.write_text(
        f"{{name: t, duration_s: {duration}, scenarios: {{a: {{{braked}}}, b: {{brake_onset_s: 60}}}}}}"
    )
    told = warn_of_late_brakes(load("grid", grid))
    assert (told is not None) == late
    if told is not None:
        assert (
            told.startswith(f"scenario a does not brake: brake_onset_s is {onset:g} s")
            and f"{duration} s" in told
        )


def test_the_grid_of_a_frozen_manifest_makes_what_it_made():
    assert grid_of(f"{{{AXES}, exclude: [{{precipitation_mm_h: 51}}]}}").idle == (0,)


def test_a_draw_may_leave_nothing_out(tmp_path):
    cube = "latin_hypercube: {count: 3, ranges: {initial_speed_km_h: [30, 70]}}"
    file = tmp_path / "grid.yaml"
    file.write_text(f"{{name: t, {cube}, exclude: [{{initial_speed_km_h: {{min: 69.999}}}}]}}")
    assert load("grid", file).left_out == 0


def test_the_papers_conditions_have_the_papers_relationship():
    """Appendix C: 19 development cases; held out, five weathers interpolate and seven controls are off the grid."""
    tags = {
        c.name: (c.split, calibration_tag(c.scenario, load("calibrated range")))
        for c in load("list of conditions")
    }
    assert {tag for split, tag in tags.values() if split == "development"} == {"in-grid"}
    held_out = {name: tag for name, (split, tag) in tags.items() if split == "held-out"}
    assert {name for name, tag in held_out.items() if tag == "interpolated"} == {
        "flat-rain5", "flat-rain15", "flat-rain35", "flat-snow0.75", "flat-snow1.5",
    }  # fmt: skip
    assert sorted(held_out.values()).count("off-grid") == 7


@pytest.mark.parametrize(
    ("change", "tag"),
    [
        ({}, "in-grid"),
        ({"initial_speed_km_h": 50.0}, "off-grid"),
        ({"initial_speed_km_h": 61.0}, "beyond-calibration"),
        ({"peak_pressure_mpa": 2.4}, "beyond-calibration"),
        ({"hold_s": 1.0}, "off-grid"),
        ({"brake_onset_s": 3.0}, "off-grid"),
        ({"precipitation_mm_h": 1.0}, "beyond-calibration"),
        ({"precipitation_mm_h": 30.0}, "interpolated"),
        ({"precipitation_mm_h": 51.0}, "beyond-calibration"),
        ({"hazard_height_m": 0.08, "hazard_length_m": 3.7}, "beyond-calibration"),
        ({"hazard_height_m": 0.075, "hazard_length_m": 3.7, "initial_speed_km_h": 40.0}, "in-grid"),
    ],
)
def test_one_changed_control_moves_a_scenario_of_the_grid(change, tag):
    rain = Scenario(weather="rain", precipitation_mm_h=10.0, peak_pressure_mpa=2.3, brake_onset_s=1.0)
    assert calibration_tag(replace(rain, **change), load("calibrated range")) == tag


def test_the_json_schema_takes_every_grid_that_ships_and_refuses_what_the_reader_refuses():
    Draft202012Validator.check_schema(grid_schema())
    validator = Draft202012Validator(grid_schema())
    for path in (find_entry("grid", name) for name in entry_names("grid")):
        assert list(validator.iter_errors(yaml.safe_load(path.read_text()))) == [], path.name
    for wrong in ({"name": "t", "colour": "red"}, {"name": "t", "frames": 1}, {"axes": {}},
                  {"name": "t", "scenarios": {"a": {"weather": "hail"}}}):  # fmt: skip
        assert list(validator.iter_errors(wrong)), wrong


def test_the_schema_says_units():
    fields = grid_schema()["$defs"]["PartialScenario"]["properties"]
    assert fields["precipitation_mm_h"]["description"].endswith("[mm h-1]")
