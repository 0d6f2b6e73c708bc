"""Frozen runs that ship are not stale, come out hash for hash, and are refused with the difference elsewhere."""

import json

import pytest
from typer.testing import CliRunner

import flows.making.freezing
from catalogs.entries import find_entry, load
from flows.cli import app
from flows.making.freezing import (
    freeze_run,
    frozen_run,
    frozen_settings,
    keep_rules,
    problems_of,
    reproduce_run,
)
from flows.store.sealed import recorded_grid
from manifests.frozen_run import list_frozen, parameters_that_matter, read_frozen, seal_run
from studies.physics_judge.audit_physics import audit_physics
from tasks.errors import InputError

SMALL = "multibody-speed-check"


@pytest.fixture
def small() -> dict:
    return read_frozen(SMALL)


def written(run: dict, tmp_path) -> str:
    """A frozen run as a file, sealed anew."""
    path = tmp_path / "run.json"
    path.write_text(
        json.dumps(seal_run({key: value for key, value in run.items() if key not in {"format", "seal"}}))
    )
    return str(path)


def test_the_runs_that_the_paper_and_the_demo_need_ship():
    counts = {name: len(read_frozen(name)["clips"]) for name in list_frozen()}
    assert counts == {
        "demo": 15, "severity": 9, "hazards": 4, "replay": 27,
        "multibody-development": 19, "multibody-speed-check": 4, "multibody-held-out": 12,
    }  # fmt: skip


@pytest.mark.parametrize("name", list_frozen())
def test_a_frozen_run_that_ships_is_not_stale(name):
    frozen = read_frozen(name)
    stale = problems_of(frozen)
    now = keep_rules(load("grid", name), frozen)
    if frozen["grid"] != frozen_settings(now.settings):
        stale.append(f"catalogs/grids/{name}.yaml is no longer the grid that was frozen")
    assert not stale, (
        f"{name}: if this is meant, run `musync lab freeze {name}` and commit it: {'; '.join(stale[:5])}"
    )


def test_the_multibody_grids_are_the_conditions_of_the_appendix():
    """A condition that brakes holds its speed until then (docs of the reference traces)."""
    ours = {}
    for name in ("multibody-development", "multibody-held-out"):
        ours |= {label: scenario.as_row() for label, scenario in load("grid", name).scenarios}
    theirs = {
        c.name: c.scenario.as_row() | {"hold_speed": c.scenario.peak_pressure_mpa > 0}
        for c in load("list of conditions")
    }
    assert ours == theirs


def test_generate_makes_a_frozen_run_again_hash_for_hash(small, tmp_path):
    command = [
        "generate",
        "--manifest",
        SMALL,
        "--out",
        str(tmp_path / "data"),
        "--runner",
        "threads",
        "--json",
    ]
    answer = CliRunner().invoke(app, command)
    assert answer.exit_code == 0, answer.output
    result = json.loads(answer.stdout)
    assert (result["clips"], result["reproduced"], result["telemetry_differs"]) == (4, 4, [])
    made = json.loads((tmp_path / "data" / "manifest.json").read_text())["clips"]
    assert [clip["content"]["ticks"] for clip in made] == [clip["ticks"] for clip in small["clips"]]
    assert [clip["seed"] for clip in made] == [clip["seed"] for clip in small["clips"]]
    assert audit_physics(str(tmp_path / "data"))["verified"]


def test_another_state_of_the_code_does_not_matter_where_the_outcome_is_the_same(small, tmp_path):
    small["made_with"]["code"]["source_sha256"] = "0" * 64
    small["made_with"]["libraries"]["numpy"] = "1.0"
    assert problems_of(read_frozen(written(small, tmp_path))) == []


def test_another_parameter_is_refused_with_its_value_and_what_to_do_and_nothing_is_written(small, tmp_path):
    small["parameters"]["vehicle.yaml"]["cg_height"]["value"] = 0.6
    with pytest.raises(InputError) as caught:
        reproduce_run(written(small, tmp_path), str(tmp_path / "data"))
    first, last = caught.value.problems[0], caught.value.problems[-1]
    assert "vehicle.yaml.cg_height.value is 0.6 in the manifest and 0.55 here" in first
    assert "what to do" in last and "musync lab freeze" in last
    assert not (tmp_path / "data").exists()


def test_another_outcome_is_refused_with_the_clip_and_the_tools_that_differ(small, tmp_path):
    small["clips"][2]["ticks"] = "0" * 64
    small["made_with"]["libraries"]["numpy"] = "1.0"
    (problem,) = problems_of(read_frozen(written(small, tmp_path)))
    assert "1 of 4 clips" in problem and "depression-35kmh first" in problem
    assert "libraries numpy: 1.0 made it" in problem


def test_a_scenario_that_the_grid_no_longer_makes_is_named(small, tmp_path):
    small["clips"][1]["scenario"]["initial_speed_km_h"] = 46.0
    (problem,) = problems_of(read_frozen(written(small, tmp_path)))
    assert problem == "clips.hump-45kmh.scenario.initial_speed_km_h is 46.0 in the manifest and 45.0 here"


def test_a_run_changed_by_hand_is_refused(small, tmp_path):
    small["clips"][0]["seed"] = "1"
    (tmp_path / "run.json").write_text(json.dumps(small))
    with pytest.raises(InputError, match="changed after it was frozen"):
        read_frozen(tmp_path / "run.json")


def test_workers_that_compute_otherwise_are_found_after_the_run(small, tmp_path, monkeypatch):
    small["clips"][3]["ticks"] = "0" * 64
    monkeypatch.setattr(flows.making.freezing, "problems_of", lambda _: [])
    _, differing = reproduce_run(
        written(small, tmp_path), str(tmp_path / "data"), runner="threads", workers=1
    )
    assert differing == ["depression-45kmh"]


def test_telemetry_alone_does_not_ask_for_what_only_pictures_need():
    names = ("vehicle.yaml", "surface.yaml", "camera.yaml", "gates.yaml", "weather/rain.yaml")
    inputs: dict = {name: {} for name in names}
    assert set(parameters_that_matter(inputs, pictures=False)) == {"vehicle.yaml", "surface.yaml"}
    assert parameters_that_matter(inputs, pictures=True) == inputs


def test_a_source_reworded_is_no_other_parameter():
    entry = {"cg_height": {"value": 0.55, "unit": "m", "source": "a book"}}
    kept = parameters_that_matter({"vehicle.yaml": entry}, pictures=False)
    assert kept == {"vehicle.yaml": {"cg_height": {"value": 0.55, "unit": "m"}}}


def test_a_grid_of_one_s_own_is_frozen_into_a_file_and_made_again_from_it(tmp_path):
    grid = tmp_path / "mine.yaml"
    grid.write_text("{name: mine, frames: 11, pictures: false, scenarios: {a: {initial_speed_km_h: 30}}}")
    file = tmp_path / "mine.json"
    with pytest.raises(InputError, match="say with --out FILE"):
        freeze_run(str(grid))
    assert freeze_run(str(grid), out=str(file))["frozen"][0]["clips"] == 1
    report, differing = reproduce_run(str(file), str(tmp_path / "data"), runner="threads", workers=1)
    assert (report.made, differing) == (1, [])


def test_freezing_again_changes_nothing():
    before = read_frozen(SMALL)
    run = frozen_run(keep_rules(load("grid", SMALL), before))
    assert all(before[key] == run[key] for key in ("grid", "parameters", "clips"))
    assert freeze_run(SMALL)["frozen"][0]["changed"] is False


def test_a_record_without_the_rule_means_the_literal_one_and_frames_to_the_end(small):
    assert not {"low_speed", "duration_s"} & small["grid"].keys()
    settings = recorded_grid(small["grid"], "manifest")
    assert (settings.low_speed, settings.duration_s, settings.telemetry_s) == ("literal", None, 12.0)


def test_a_steady_run_says_so_and_is_made_again_steady(small, tmp_path):
    run = frozen_run(load("grid", SMALL))
    assert run["grid"]["low_speed"] == "steady"
    assert set(run["parameters"]["low_speed.yaml"]) == {"held_share", "explicit_limit"}
    assert [clip["seed"] for clip in run["clips"]] == [clip["seed"] for clip in small["clips"]]
    assert all(a["ticks"] != b["ticks"] for a, b in zip(run["clips"], small["clips"], strict=True))
    assert problems_of(read_frozen(written(run, tmp_path))) == []


@pytest.mark.parametrize(
    "arguments", [[], ["demo", "--manifest", "demo"], ["--manifest", "demo", "--no-frames"]]
)
def test_generate_takes_a_grid_or_a_manifest(arguments, tmp_path):
    answer = CliRunner().invoke(app, ["generate", *arguments, "--out", str(tmp_path / "data")])
    assert isinstance(answer.exception, InputError)


def test_a_users_file_that_is_no_frozen_run_is_not_written_over(tmp_path):
    precious = tmp_path / "notes.json"
    precious.write_text('{"mine": 1}')
    link = tmp_path / "link.json"
    link.symlink_to(precious)
    for out, sentence in (
        (precious, "is no frozen run"),
        (link, "no link"),
        (tmp_path / "run.txt", "end in .json"),
    ):
        with pytest.raises(InputError, match=sentence):
            freeze_run(SMALL, out=str(out))
    assert precious.read_text() == '{"mine": 1}'
    assert freeze_run(SMALL, out=str(tmp_path / "run.json"))["frozen"][0]["changed"]
    assert not freeze_run(SMALL, out=str(tmp_path / "run.json"))["frozen"][0]["changed"]


def test_a_catalogue_file_that_nobody_would_find_again_is_refused_before_it_is_frozen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "car.yaml").write_text(find_entry("vehicle", "paper-reference").read_text())
    grid = "name: own\nvehicle: {}\nframes: 11\npictures: false\nscenarios: {{dry: {{initial_speed_km_h: 30}}}}\n"
    for place in (tmp_path / "car.yaml", "../car.yaml"):
        (tmp_path / "grid.yaml").write_text(grid.format(place))
        with pytest.raises(InputError, match=r"vehicle must be .* path below the working folder"):
            freeze_run("grid.yaml", out="run.json")
    assert not (tmp_path / "run.json").exists()
    (tmp_path / "grid.yaml").write_text(grid.format("car.yaml"))
    freeze_run("grid.yaml", out="run.json")
    assert problems_of(read_frozen("run.json")) == []
