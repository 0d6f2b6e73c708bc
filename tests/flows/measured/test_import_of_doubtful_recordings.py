"""An import takes units and clocks that are stated, and leaves a few faulty runs out."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from flows.cli import app
from flows.measured.importing import import_measurements
from tasks.errors import InputError
from tests.campaign.recorded import MAP, braking_columns, log_signal, write_digits
from tests.flows.measured.recordings import import_columns, map_beside, problems_of, write_csv, write_map


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


def test_a_log_of_a_time_of_day_is_imported_by_its_unit_and_told_without_it(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["time"] = write_digits(37438.0 + log.pop("t_ms") / 1e3)
    source = write_csv(tmp_path / "log.csv", log)
    text = problems_of(tmp_path, log, time={"source": "time"})
    assert "give unit: HHMMSS under time in the map" in text
    assert "cut the run there" not in text and "frozen" not in text
    found = import_columns(tmp_path, source, time={"source": "time", "unit": "HHMMSS"})
    assert len(found["speed"]) > 390
    np.testing.assert_allclose(found["speed"], braking_columns()["speed"][: len(found["speed"])], atol=1e-6)
