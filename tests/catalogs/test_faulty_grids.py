"""Faulty grids: form, rules and limits are told together, nothing is made up, and nothing is expanded without bound."""

import time
from pathlib import Path

import pytest

from catalogs.entries import load
from catalogs.grids import FaultyGrid
from catalogs.grids.form import MOST_CLIPS
from catalogs.sentences import MOST_PROBLEMS
from tasks.errors import InputError


def problems_of(tmp_path: Path, body: str) -> list[str]:
    path = tmp_path / "grid.yaml"
    path.write_text(body)
    with pytest.raises(InputError) as caught:
        load("grid", path)
    assert all(problem.startswith(f"{path}: ") for problem in caught.value.problems[:MOST_PROBLEMS])
    return [problem.removeprefix(f"{path}: ") for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("body", "starts"),
    [
        ("{name: t, axes: {null: {a: {}}}}", ["a grid must have text as keys; one is null"]),
        ("{name: t, axes: {w: {a: null}}}", ["axes.w.a: must be a table of keys and values"]),
        ("{name: t, axes: {w: {a: [1]}, v: {}}}", ["axes.w.a: must be", "axes.v: "]),
        ("{name: t, zip: {w: 3}, scenarios: {a: 4}}", ["zip.w: must be", "scenarios.a: must be"]),
        ("{name: t, scenarios: {a: {}}, exclude: [{tint: 3}]}", ["exclude.0: tint: no such field"]),
        ("{scenarios: {a: {}}}", ["name is missing"]),
        ("{name: t}", ["a grid needs one of axes, zip, scenarios and latin_hypercube"]),
        (
            "{name: t, colour: red, scenarios: {a: {weather: rain}}}",
            ["colour: unknown key", "scenario a: weather rain needs precipitation_mm_h"],
        ),
        (
            "{name: t, scenarios: {a: {weather: rain, tint: 3}}}",
            ["scenarios.a.tint: unknown key", "scenario a: weather rain needs precipitation_mm_h"],
        ),
        (
            "{name: t, frames: 0, axes: {w: {a: {weather: rain, ramp_s: x}, b: {weather: snow, hold_s: -1}}}}",
            [
                "axes.w.a.ramp_s: must be a valid number",
                "frames: must be greater than or equal to 2",
                "scenario a: weather rain needs precipitation_mm_h",
                "scenario b: weather snow needs precipitation_mm_h",
                "scenario b: weather snow needs an accumulation time",
                "scenario b: hold_s must not be negative",
            ],
        ),
        (
            "{name: t, zip: {a: {x: {}, y: {weather: hail}}, b: {z: {}}}}",
            ["zip.a.y.weather: must be", "zip: its axes must have as many levels each; a has 2, b has 1"],
        ),
        ("{name: t, scenarios: {a: {ramp_s: true}}}", ["scenarios.a.ramp_s: must be a number; it is True"]),
        (
            "{name: t, frames: 81, frame_rate_hz: 1.0e-300, scenarios: {a: {}}}",
            ["frame_rate_hz: (frames - 1) / frame_rate_hz must be at most 600 s"],
        ),
        (
            "{name: t, base: {peak_pressure_mpa: 23}, scenarios: {a: {peak_pressure_mpa: 0}}}",
            ["scenario base: peak_pressure_mpa must be at most 20 MPa"],
        ),
        (
            "{name: t, base: {precipitation_mm_h: -1}, scenarios: {a: {precipitation_mm_h: 0}}}",
            ["scenario base: precipitation_mm_h must not be negative; it is -1"],
        ),
    ],
)  # fmt: skip
def test_each_fault_is_told_and_none_is_made_up(tmp_path, body, starts):
    problems = problems_of(tmp_path, body)
    assert len(problems) == len(starts), problems
    assert all(any(problem.startswith(start) for problem in problems) for start in starts), problems


def test_what_can_be_read_of_a_faulty_grid_goes_on_to_the_catalogue(tmp_path):
    path = tmp_path / "grid.yaml"
    path.write_text("{name: t, vehicle: tank, colour: red, axes: {w: 3}}")
    with pytest.raises(FaultyGrid) as caught:
        load("grid", path)
    assert caught.value.grid is not None and caught.value.grid.settings.vehicle == "tank"


def levels(count: int) -> str:
    return "{" + ", ".join(f"l{number}: {{}}" for number in range(count)) + "}"


@pytest.mark.parametrize(
    ("body", "count"),
    [
        ("axes: {" + ", ".join(f"a{number}: {levels(10)}" for number in range(9)) + "}", "1,000,000,000"),
        (
            f"axes: {{a: {levels(10)}}}, latin_hypercube: {{count: 1000000, ranges: {{ramp_s: [0, 1]}}}}",
            "10,000,000",
        ),
        (
            f"visual_seeds: 1000, zip: {{a: {levels(20)}, b: {levels(20)}}}, scenarios: {levels(10)}",
            "200,000",
        ),
    ],
)
def test_a_grid_of_too_many_clips_is_refused_before_it_is_made(tmp_path, body, count):
    begun = time.process_time()
    (problem,) = problems_of(tmp_path, f"{{name: t, {body}}}")
    assert problem.startswith(f"a grid must ask for at most {MOST_CLIPS:,} clips")
    assert f"multiply to {count}:" in problem
    assert time.process_time() - begun < 1


def test_a_level_that_stands_twice_is_refused(tmp_path):
    (problem,) = problems_of(
        tmp_path, "{name: t, axes: {speed: {a: {initial_speed_km_h: 40}, a: {initial_speed_km_h: 60}}}}"
    )
    assert "distinct keys in a table; 'a' stands there twice (line 1)" in problem


def test_many_problems_are_counted_not_listed(tmp_path):
    slow = ", ".join(f"s{speed}: {{initial_speed_km_h: -{speed}}}" for speed in range(1, 101))
    problems = problems_of(tmp_path, f"{{name: t, scenarios: {{{slow}}}}}")
    assert len(problems) == MOST_PROBLEMS + 1
    assert problems[-1] == "... and 80 more problems"


@pytest.mark.parametrize("name", ["../x", "/x", "a//b", "..", "a\\b", " a", "a\tb", "\u202ea", "", "a" * 101])
def test_a_level_has_a_name_that_is_safe_as_text_and_file(tmp_path, name):
    quoted = '"' + name.replace("\\", "\\\\").replace("\t", "\\t") + '"'
    (problem,) = problems_of(tmp_path, f"{{name: t, scenarios: {{{quoted}: {{}}}}}}")
    assert "a label must" in problem


def test_labels_of_many_long_names_and_labels_that_meet_are_refused(tmp_path):
    long = ", ".join(f"a{number}: {{{'x' * 90}: {{}}}}" for number in range(3))
    assert (
        "label must have at most 200 bytes; it has 272"
        in problems_of(tmp_path, f"{{name: t, axes: {{{long}}}}}")[0]
    )
    (problem,) = problems_of(
        tmp_path, "{name: t, axes: {a: {x: {ramp_s: 1}, x/y: {}}, b: {y/z: {hold_s: 1}, z: {hold_s: 2}}}}"
    )
    assert "scenario x/y/z: its label must be its own" in problem


def test_a_label_of_any_script_with_marks_is_fine(tmp_path):
    path = tmp_path / "grid.yaml"
    path.write_text("{name: Größe & <b>, axes: {w: {'雨/25 mm [1]': {}}}}")
    assert [label for label, _ in load("grid", path).scenarios] == ["雨/25 mm [1]"]
