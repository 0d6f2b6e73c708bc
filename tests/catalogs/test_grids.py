from pathlib import Path

import pytest

from catalogs.entries import entry_names, load
from catalogs.scenario import Scenario, find_route_problems, find_scenario_problems
from tasks.errors import InputError


def grid_file(tmp_path: Path, body: str) -> Path:
    path = tmp_path / "grid.yaml"
    path.write_text(body)
    return path


@pytest.mark.parametrize("name", entry_names("grid"))
def test_every_grid_that_ships_is_sound(name):
    assert load("grid", name).scenarios


def test_the_demo_covers_two_rates_of_each_weather_on_three_roads():
    scenarios = [scenario for _, scenario in load("grid", "demo").scenarios]
    assert len(scenarios) >= 12
    assert {s.weather for s in scenarios} == {"dry", "rain", "snow"}
    assert len({s.precipitation_mm_h for s in scenarios if s.weather == "rain"}) == 2
    assert len({s.precipitation_mm_h for s in scenarios if s.weather == "snow"}) == 2
    assert {(s.hazard_height_m > 0) - (s.hazard_height_m < 0) for s in scenarios} == {-1, 0, 1}
    assert 0 < sum(s.peak_pressure_mpa > 0 for s in scenarios) < len(scenarios)


def test_axes_multiply_and_later_axes_override_earlier_ones(tmp_path):
    grid = load(
        "grid",
        grid_file(
            tmp_path,
            "{name: t, base: {initial_speed_km_h: 30}, axes: {a: {x: {}, y: {initial_speed_km_h: 50}},"
            " b: {p: {}, q: {initial_speed_km_h: 70}}}}",
        ),
    )
    assert [(label, s.initial_speed_km_h) for label, s in grid.scenarios] == [
        ("x/p", 30), ("x/q", 70), ("y/p", 50), ("y/q", 70),
    ]  # fmt: skip


def test_how_frames_are_compressed_stands_in_the_record_only_where_it_was_asked_for(tmp_path):
    body = "name: g\naxes: {weather: {dry: {weather: dry}}}\n"
    plain = load("grid", str(grid_file(tmp_path, body))).settings
    quick = load("grid", str(grid_file(tmp_path, body + "compression: lz4\n"))).settings
    assert "compression" not in plain.model_dump(mode="json") and plain.compression == "zstd"
    assert quick.model_dump(mode="json")["compression"] == "lz4"
    with pytest.raises(InputError, match="compression"):
        load("grid", str(grid_file(tmp_path, body + "compression: zip\n")))


def test_a_name_that_commands_take_for_an_option_is_refused(tmp_path):
    """It names folders: `rm *` beside one called -rf removes what lies in the others."""
    with pytest.raises(InputError, match="begin with another character than -"):
        load("grid", str(grid_file(tmp_path, "name: -rf\naxes: {weather: {dry: {weather: dry}}}\n")))


def test_all_faults_of_a_file_are_listed_at_once_each_with_its_place(tmp_path):
    path = grid_file(
        tmp_path,
        "{name: t, frames: 0, colour: red, axes: {w: {a: {weather: hail}, b: {precipitaton_mm_h: 3},"
        " c: {precipitation_mm_h: .nan}}}}",
    )
    with pytest.raises(InputError) as caught:
        load("grid", path)
    text = str(caught.value)
    assert len(caught.value.problems) == 5
    for place in (
        "frames",
        "colour",
        "axes.w.a.weather",
        "axes.w.b.precipitaton_mm_h",
        "axes.w.c.precipitation_mm_h",
    ):
        assert f"{path}: {place}:" in text


def test_faults_of_form_do_not_hide_broken_rules_and_make_none_up(tmp_path):
    path = grid_file(
        tmp_path,
        "{name: t, colour: red, axes: {w: {a: {weather: hail, precipitation_mm_h: 3},"
        " b: {weather: rain, precipitation_mm_h: -1}}}}",
    )
    with pytest.raises(InputError) as caught:
        load("grid", path)
    form, rules = caught.value.problems[:2], caught.value.problems[2:]
    assert sorted(sentence.split(": ")[1] for sentence in form) == ["axes.w.a.weather", "colour"]
    assert rules == (f"{path}: scenario b: precipitation_mm_h must not be negative; it is -1",)


def test_a_rule_broken_by_many_scenarios_is_told_once(tmp_path):
    path = grid_file(
        tmp_path,
        "{name: t, axes: {w: {s: {weather: snow, precipitation_mm_h: 1}}, r: {a: {}, b: {}, c: {}}}}",
    )
    with pytest.raises(InputError) as caught:
        load("grid", path)
    assert caught.value.problems == (
        f"{path}: scenario s/a and 2 more: weather snow needs an accumulation time;"
        " snow_accumulation_h is 0: give the hours of snowfall",
    )


@pytest.mark.parametrize(
    ("fields", "rule"),
    [
        ({"weather": "rain", "precipitation_mm_h": -3.0}, "must not be negative; it is -3"),
        ({"weather": "dry", "precipitation_mm_h": 3.0}, "dry has no precipitation"),
        ({"weather": "rain"}, "needs precipitation_mm_h above 0"),
        ({"weather": "rain", "precipitation_mm_h": 1.0, "snow_accumulation_h": 1.0}, "belongs to snow"),
        ({"initial_speed_km_h": 0.0}, "initial_speed_km_h must be at least 0.1 km h-1"),
        ({"peak_pressure_mpa": 2.0}, "exactly one of brake_onset_s and brake_onset_m"),
        ({"peak_pressure_mpa": 2.0, "brake_onset_s": 1.0, "brake_onset_m": 12.0}, "exactly one of"),
        ({"brake_onset_s": -1.0}, "must not be negative"),
        (
            {"peak_pressure_mpa": 2.0, "brake_onset_s": 1.0, "ramp_s": 0.0, "hold_s": 0.0, "release_s": 0.0},
            "the brake never acts",
        ),
        ({"hazard_height_m": 0.1}, "needs hazard_length_m above 0"),
    ],
)
def test_each_rule_of_a_scenario_is_enforced(fields, rule):
    problems = find_scenario_problems(Scenario(**fields))
    assert any(rule in problem for problem in problems), problems


@pytest.mark.parametrize(
    ("center", "length", "fits"), [(50, 3, True), (1, 3, False), (99, 3, False), (50, 200, False)]
)
def test_a_hazard_must_lie_on_the_route(center, length, fits):
    scenario = Scenario(hazard_center_m=center, hazard_length_m=length, hazard_height_m=0.1)
    assert (find_route_problems(scenario, 100.0, "s") == []) == fits
