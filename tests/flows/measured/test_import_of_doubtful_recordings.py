"""An import holds speeds against every pair of units, takes units that are stated, and leaves a few faulty runs out."""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from flows.cli import app
from flows.measured.importing import import_measurements
from tasks.campaign.channel_validation import find_plausibility_problems
from tasks.campaign.channels import SPEED_UNITS, UNITS
from tasks.campaign.deceleration import find_deceleration_problems
from tasks.errors import InputError
from tests.campaign.recorded import MAP, braking_columns, log_signal
from tests.flows.measured.recordings import map_beside, problems_of, write_csv, write_map


@pytest.mark.parametrize(("true", "taken"), list(permutations(SPEED_UNITS, 2)))
def test_a_speed_in_another_unit_is_told_by_an_accelerometer(true: str, taken: str) -> None:
    columns = braking_columns()
    wrong = columns["speed"] * UNITS[taken][1] / UNITS[true][1]
    felt = columns["longitudinal_acceleration"]
    units = {"speed": taken, "longitudinal_acceleration": "g"}
    channels = {"speed": wrong, "longitudinal_acceleration": felt}
    (told,) = find_plausibility_problems(channels, 0.01, units)
    assert f"taken as {taken}, it looks like {true}" in told
    sound = channels | {"speed": columns["speed"]}
    assert find_plausibility_problems(sound, 0.01, units) == []


def test_a_stop_harder_than_tyres_give_is_told_without_an_accelerometer() -> None:
    speed = braking_columns()["speed"]
    assert find_deceleration_problems({"a": {"speed": speed}}, 0.01, 15.0) == []
    hard = 20.0 - 5.0 * np.clip(0.01 * np.arange(400) - 1.0, 0.0, 3.0)
    assert find_deceleration_problems({"a": {"speed": hard}}, 0.01, 15.0) == []
    (told,) = find_deceleration_problems({"a": {"speed": 3.6 * hard}}, 0.01, 15.0)
    assert "falls by 18 m/s^2 in a" in told and "taken as m/s, it looks like km/h" in told


def test_a_unit_in_a_name_is_held_against_the_maps_and_taken_where_there_is_none(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    channels = yaml.safe_load(MAP)["channels"]
    wrong = channels | {"speed": {"source": "v_kmh", "unit": "mph"}}
    assert "channel speed: is in km/h by its file, in mph by the map" in problems_of(
        tmp_path, log, channels=wrong
    )
    log["wheel"] = log.pop("w_r")
    asked = channels | {"wheel_speed_rear": {"source": "wheel"}, "speed": {"source": "v_kmh"}}
    assert "the map gives no unit, and the file states none for wheel" in problems_of(
        tmp_path, log, channels=asked
    )
    stated = asked | {"wheel_speed_rear": {"source": "wheel", "unit": "rad/s"}}
    made = import_measurements(
        write_csv(tmp_path / "log.csv", log),
        map=write_map(tmp_path, channels=stated),
        out=str(tmp_path / "made"),
    )
    assert made["runs"]


def write_runs(folder: Path, count: int, faulty: int, sign: float = 1.0) -> None:
    for k in range(count):
        log = log_signal(braking_columns(seconds=4.0 + 0.1 * k))
        if k < faulty:
            log["az"][90:93] = 65535.0
        log["ax_g"] *= sign if k < faulty else 1.0
        write_csv(folder / f"run-{k}.csv", log)


def test_a_faulty_run_among_many_is_left_out_with_its_sentence(tmp_path: Path) -> None:
    source, channel_map = tmp_path / "logs", map_beside(tmp_path)
    source.mkdir()
    write_runs(source, count=4, faulty=1)
    command = ["import-measurements", str(source), "--map", channel_map, "--out", str(tmp_path / "out")]
    shown = CliRunner().invoke(app, [*command, "--json"])
    report = yaml.safe_load((tmp_path / "out" / "import.json").read_text())
    assert shown.exit_code == 1 and report["faulty"] == ["run-0"]
    assert [run["run"] for run in report["runs"]] == ["run-1", "run-2", "run-3"]
    assert (
        'of 65535: cut the run there; where the logger writes it for no value, give values: {"65535": null}'
        in (report["left_out"][0])
    )


@pytest.mark.parametrize(("faulty", "sign"), [(2, 1.0), (1, -1.0)])
def test_faults_of_many_runs_and_of_the_map_leave_nothing_out(
    tmp_path: Path, faulty: int, sign: float
) -> None:
    source, channel_map = tmp_path / "logs", map_beside(tmp_path)
    source.mkdir()
    write_runs(source, count=4, faulty=faulty, sign=sign)
    with pytest.raises(InputError):
        import_measurements(str(source), map=channel_map, out=str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_a_file_that_cannot_be_read_among_many_is_left_out(tmp_path: Path) -> None:
    source, channel_map = tmp_path / "logs", map_beside(tmp_path)
    source.mkdir()
    write_runs(source, count=4, faulty=0)
    (source / "run-3.csv").write_text("nothing\n")
    report = import_measurements(str(source), map=channel_map, out=str(tmp_path / "out"))
    assert report["faulty"] == ["run-3.csv"] and len(report["runs"]) == 3
    assert "run-3.csv: signal t_ms is missing" in report["left_out"][0]
