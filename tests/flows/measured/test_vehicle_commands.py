"""``musync vehicle``: the template is the car that it extends, and the check ends as a script expects it."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from catalogs.entries import entry_names, load
from catalogs.vehicles import open_vehicle
from flows.measured.vehicle_check import DATA_SHEET
from tests.flows.shell import run_command


@pytest.fixture
def musync(tmp_path, monkeypatch, capsys):
    """Run a command in the test's folder; returns its exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> SimpleNamespace:
        code = run_command(monkeypatch, *words)
        return SimpleNamespace(code=code, **capsys.readouterr()._asdict())

    return run


@pytest.mark.parametrize("base", entry_names("vehicle"))
def test_the_template_is_the_car_that_it_extends_with_usual_tolerances(musync, base):
    assert musync("vehicle", "new", "--from", base, "--out", "cars/my-car.yaml").code == 0
    assert load("vehicle", "cars/my-car.yaml") == replace(load("vehicle", base), name="my-car")
    usual = {name: n.value for name, n in load("table of plausible figures").usual_tolerances.items()}
    assert open_vehicle("cars/my-car.yaml").tolerances == pytest.approx(usual, rel=0.05)
    assert usual.keys() == DATA_SHEET.keys()


def test_a_template_over_a_file_of_ones_own_keeps_its_tolerances_and_its_name(musync, tmp_path):
    number = "{value: 0.00001, unit: m, source: TO FILL IN; a, tolerance: 0.0000015}"
    (tmp_path / "a b.yaml").write_text(f"extends: paper-reference\ncg_height: {number}\n")
    done = musync(
        "vehicle", "new", "--from", "a b.yaml", "--out", "mine.yaml", "--name", "Anna's car", "--json"
    )
    assert json.loads(done.out)["extends"] == "a b.yaml"
    written = (tmp_path / "mine.yaml").read_text()
    assert written.startswith("# Anna's car: ") and 'source: "TO FILL IN; a"' in written
    assert load("vehicle", "mine.yaml") == replace(load("vehicle", "a b.yaml"), name="mine")
    assert open_vehicle("mine.yaml").tolerances["cg_height"] == pytest.approx(0.15)


def test_nothing_is_overwritten_and_all_that_is_wrong_is_told_at_once(musync, tmp_path):
    (tmp_path / "base.yaml").write_text("extends: paper-reference\n")
    (tmp_path / "mine.yaml").write_text("my work")
    (tmp_path / "link.yaml").symlink_to("nowhere")
    for out in ("mine.yaml", "link.yaml"):
        done = musync("vehicle", "new", "--out", out)
        assert done.code == 2 and f"--out {out}: must be a new file" in done.err
    assert (tmp_path / "mine.yaml").read_text() == "my work" and not (tmp_path / "nowhere").exists()
    done = musync("vehicle", "new", "--from", "base.yaml", "--out", "other/mine.json")
    assert done.code == 2 and "Traceback" not in done.err
    assert "must end in .yaml" in done.err and "a file in the folder of --out; copy it there" in done.err
    assert (
        "tractor: no such vehicle" in musync("vehicle", "new", "--from", "tractor", "--out", "new.yaml").err
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["base.yaml", "link.yaml", "mine.yaml"]


def test_a_template_checks_with_0_and_says_which_sources_are_missing(musync):
    musync("vehicle", "new", "--out", "mine.yaml")
    done = musync("vehicle", "check", "mine.yaml")
    assert done.code == 0 and "mine.yaml: every figure is plausible" in done.out
    assert f"say where these come from, or delete their lines: {next(iter(DATA_SHEET))}" in done.out
    assert "TO FILL IN" not in done.out and "heave_frequency" in done.out


def test_an_implausible_car_checks_with_1_and_a_sentence_each(musync, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "extends: paper-reference\n"
        "wheel_radius: {value: 0.64, unit: m, source: tape, tolerance: 5}\n"
        "cg_height: {value: 5.5, unit: m, source: guess}\n"
    )
    done = musync("vehicle", "check", "mine.yaml", "--json")
    result = json.loads(done.out)
    assert (done.code, result["plausible"], result["without_source"]) == (1, False, [])
    assert [problem.split(" must")[0] for problem in result["problems"]] == [
        "cg_height_over_wheelbase", "wheel_radius", "road_load", "dive_gradient",
        "tolerance of wheel_radius over its value",
    ]  # fmt: skip
    assert result["tolerances"] == {"wheel_radius": 5 / 0.64}
    rows = {row["figure"]: row for row in result["figures"]}
    assert (rows["wheel_radius"]["value"], rows["wheel_radius"]["high"]) == (0.64, 0.45)
    said = musync("vehicle", "check", "mine.yaml").out.splitlines()
    assert said[: len(result["problems"])] == [f"mine.yaml: {problem}" for problem in result["problems"]]


def test_a_car_beyond_what_floats_hold_is_implausible_and_no_defect(musync, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "extends: paper-reference\ncg_to_front_axle: {value: 1.0e+300, unit: m, source: slip}\n"
    )
    done = musync("vehicle", "check", "mine.yaml", "--json")
    assert done.code == 1 and "NaN" not in done.out and "Infinity" not in done.out
    assert musync("vehicle", "check", "mine.yaml").code == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("extends: tractor", "tractor: no such vehicle"),
        ("extends: paper-reference\nmass: 3", "mass: unknown key"),
    ],
)
def test_a_bad_file_checks_with_2_and_a_sentence(musync, tmp_path, text, words):
    (tmp_path / "mine.yaml").write_text(text)
    done = musync("vehicle", "check", "mine.yaml")
    assert done.code == 2 and words in done.err and "Traceback" not in done.err
