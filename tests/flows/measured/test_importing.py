"""Recordings in, a campaign out."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from catalogs.campaigns import read_campaign
from catalogs.channel_maps.tolerances import RunTolerances, Tolerances
from catalogs.entries import load
from flows.commands.measured import shorten_import
from flows.measured.importing import import_measurements
from tasks.campaign.campaign import CHANNELS
from tasks.errors import InputError
from tests.campaign.recorded import MAP, braking_columns, log_signal
from tests.flows.measured.recordings import Columns, import_columns, write_csv, write_map


def assert_same_motion(found: Columns, start: int) -> None:
    truth = braking_columns()
    for name in ("speed", "brake_pressure", "longitudinal_acceleration", "pitch", "wheel_speed_front"):
        n = len(found[name])
        np.testing.assert_allclose(found[name], truth[name][start : start + n], atol=2e-6, err_msg=name)
    n = len(found["pitch_rate"]) - 6
    np.testing.assert_allclose(
        found["pitch_rate"][6 : 6 + n], truth["pitch_rate"][6 + start : 6 + start + n], atol=1e-6
    )


def test_a_csv_becomes_the_motion_in_campaign_units(tmp_path: Path) -> None:
    found = import_columns(tmp_path, write_csv(tmp_path / "log.csv", log_signal(braking_columns())))
    assert_same_motion(found, 0)


def test_parquet_and_mdf4_give_what_the_csv_gives(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="reading MDF4 needs asammdf")
    log = log_signal(braking_columns())
    t = log["t_ms"] / 1e3
    with asammdf.MDF(version="4.10") as recording:
        for name, values in log.items():
            if name != "t_ms":
                # a group per signal, of its own rate: the file's own clocks are used
                step = 2 if name == "az" else 1
                recording.append(asammdf.Signal(values[::step], t[::step], name=name, unit=""))
        recording.save(tmp_path / "log.mf4")
    pd.DataFrame(log).to_parquet(tmp_path / "log.parquet")
    folders = {}
    for kind in ("mf4", "parquet"):
        (tmp_path / kind).mkdir()
        folders[kind] = import_columns(tmp_path / kind, str(tmp_path / f"log.{kind}"))
        assert_same_motion(folders[kind], 0)


def test_a_unit_that_the_mdf4_file_states_must_be_the_maps(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="reading MDF4 needs asammdf")
    log = log_signal(braking_columns())
    with asammdf.MDF(version="4.10") as recording:
        for name, values in log.items():
            unit = "m/s" if name == "v_kmh" else ""
            recording.append(asammdf.Signal(values, log["t_ms"] / 1e3, name=name, unit=unit))
        recording.save(tmp_path / "log.mf4")
    with pytest.raises(InputError, match="speed: is in m/s by its file, in km/h by the map"):
        import_measurements(str(tmp_path / "log.mf4"), map=write_map(tmp_path), out=str(tmp_path / "out"))


def test_without_asammdf_the_reader_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "log.mf4").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(InputError, match=r'pip install "musync-gs\[mdf\]"'):
        import_measurements(str(tmp_path / "log.mf4"), map=write_map(tmp_path), out=str(tmp_path / "out"))


def test_the_campaign_is_the_one_that_closing_the_loop_reads(tmp_path: Path) -> None:
    for file, seconds in (("log.csv", 14.0), ("other.csv", 13.0)):
        write_csv(tmp_path / file, log_signal(braking_columns(seconds)))
    runs = [
        {"name": f"r{i}", "file": "other.csv" if i % 2 else "log.csv", "from_s": 0.2 * i, "to_s": 0.2 * i + 3.0,
         "part": "held_out" if i % 2 else "train", "conditions": {"disc_temperature_above_ambient_c": 10.0 * i}}
        for i in range(6)
    ]  # fmt: skip
    import_measurements(
        str(tmp_path / "log.csv"), map=write_map(tmp_path, runs=runs), out=str(tmp_path / "campaign")
    )
    campaign = read_campaign(tmp_path / "campaign")
    assert [run.name for run in campaign.held_out] == ["r1", "r3", "r5"]
    assert campaign.runs[4].disc_rise == 40.0
    speed = campaign.runs[2].response[:, CHANNELS.index("speed")]
    np.testing.assert_allclose(speed, braking_columns(14.0)["speed"][40 : 40 + len(speed)], atol=1e-9)


@pytest.mark.parametrize("source", ["ground", "wheels"])
def test_a_map_says_whether_the_speed_is_that_of_the_wheels(tmp_path: Path, source: str) -> None:
    for name, seconds in (("train", 14.0), ("held_out", 13.0)):
        write_csv(tmp_path / f"{name}.csv", log_signal(braking_columns(seconds)))
    runs = [
        {"name": f"r{i}", "file": f"{part}.csv", "from_s": 0.2, "to_s": 3.2, "part": part}
        for i, part in enumerate(("train", "held_out"))
    ]
    path = write_map(tmp_path, runs=runs, speed_from=source)
    import_measurements(str(tmp_path / "train.csv"), map=path, out=str(tmp_path / "campaign"))
    assert {run.speed_of_wheels for run in read_campaign(tmp_path / "campaign").runs} == {source == "wheels"}


@pytest.mark.parametrize("other", ["day1/stop.csv", "Lap [3].csv"])
def test_a_run_is_of_the_file_that_its_path_names(tmp_path: Path, other: str) -> None:
    """No pattern: `stop.csv` is not the file of that name in a folder, and brackets are letters."""
    files = {other: 3.0, "stop.csv": 4.0}
    for file, seconds in files.items():
        (tmp_path / "logs" / file).parent.mkdir(parents=True, exist_ok=True)
        write_csv(tmp_path / "logs" / file, log_signal(braking_columns(seconds)))
    runs = [{"name": f"r{number}", "file": file} for number, file in enumerate(files)]
    report = import_measurements(
        str(tmp_path / "logs"), map=write_map(tmp_path, runs=runs), out=str(tmp_path / "campaign")
    )
    assert [run["file"] for run in report["runs"]] == list(files)
    assert [run["duration_s"] for run in report["runs"]] == pytest.approx([3.0, 4.0], abs=0.1)


def test_a_window_of_a_late_channel_is_cut_where_it_was_measured(tmp_path: Path) -> None:
    """A speed that the logger stamps 0.35 s late has its samples behind the window of a run of 3 s."""
    columns = log_signal(braking_columns(14.0))
    columns["v_kmh"] = np.interp(columns["t_ms"] - 350.0, columns["t_ms"], columns["v_kmh"])
    write_csv(tmp_path / "log.csv", columns)
    content = yaml.safe_load(MAP)["channels"]
    content["speed"]["delay_s"] = 0.35
    runs = [
        {"name": name, "from_s": start, "to_s": start + 3.0, "file": "log.csv", "part": part}
        for name, start, part in (("a", 1.0, "train"), ("b", 5.0, "held_out"))
    ]
    report = import_measurements(
        str(tmp_path / "log.csv"),
        map=write_map(tmp_path, runs=runs, channels=content),
        out=str(tmp_path / "out"),
    )
    assert [run["duration_s"] for run in report["runs"]] == pytest.approx([3.0, 3.0], abs=0.02)


def test_the_same_recording_gives_the_same_bytes(tmp_path: Path) -> None:
    source = write_csv(tmp_path / "log.csv", log_signal(braking_columns()))
    for name in ("a", "b"):
        import_measurements(source, map=write_map(tmp_path), out=str(tmp_path / name))
    for file in sorted((tmp_path / "a").rglob("*.*")):
        twin = tmp_path / "b" / file.relative_to(tmp_path / "a")
        if file.name != "import.json":  # it names its own folder
            assert file.read_bytes() == twin.read_bytes(), file.name


def test_conditions_of_a_run_complete_the_common_ones(tmp_path: Path) -> None:
    source = write_csv(tmp_path / "log.csv", log_signal(braking_columns()))
    runs = [{"name": "a", "file": "log.csv", "conditions": {"precipitation_mm_h": 25.0}}]
    channel_map = write_map(tmp_path, conditions={"weather": "rain"}, runs=runs)
    import_measurements(source, map=channel_map, out=str(tmp_path / "campaign"))
    assert "rain,25.0" in (tmp_path / "campaign" / "runs.csv").read_text()


def test_the_measured_sets_come_in_through_their_maps(tmp_path: Path, outside_data: Path) -> None:
    measured = outside_data / "measured"
    if not (measured / "bmw_m8").is_dir():
        pytest.skip(f"no measured sets at {measured}")
    m8 = import_measurements(str(measured / "bmw_m8"), map="bmw-m8", out=str(tmp_path / "m8"))
    assert {run["run"]: run["part"] for run in m8["runs"]}["abs-stop"] == "held_out"
    comma = measured / "comma2k19" / "comma2k19_example1_100hz.parquet"
    report = import_measurements(str(comma), map="comma2k19", out=str(tmp_path / "comma"))
    assert report["not_measured"] == ["brake_pressure", "wheel_speed_front", "wheel_speed_rear"]


@pytest.mark.parametrize(
    ("given", "left", "mass"),
    [
        ({}, 11, 0.05),
        ({"mass": 0.01, "run": {"friction": 0.02}}, 9, 0.01),
    ],
)
def test_tolerances_that_a_map_leaves_open_are_assumed_and_told(
    tmp_path: Path, given: dict[str, object], left: int, mass: float
) -> None:
    source = write_csv(tmp_path / "log.csv", log_signal(braking_columns()))
    report = import_measurements(
        source, map=write_map(tmp_path, tolerances_1sigma=given), out=str(tmp_path / "campaign")
    )
    told = report["assumed_tolerances_1sigma"]
    assert len(told) == left
    assert ("mass" in told) is ("mass" not in given)
    assert told["pressure_gain"] == 0.3
    written = yaml.safe_load((tmp_path / "campaign" / "campaign.yaml").read_text())["tolerances_1sigma"]
    assert written["mass"] == mass
    assert {f"run.{name}" for name in written["run"]} | set(written) - {"run"} >= set(told)


def test_a_tolerance_is_assumed_of_every_number_of_a_session() -> None:
    numbers = {*Tolerances.model_fields, *RunTolerances.model_fields} - {"run"}
    assert set(load("set of assumed tolerances")) == numbers


def test_the_terminal_tells_the_times_of_a_clock_that_counts_from_1970() -> None:
    start = 1554115465.662651
    brief = shorten_import(
        {"assumed_tolerances_1sigma": {}, "runs": [{"run": "run-01", "start_s": start, "duration_s": 5.0}]}
    )
    assert brief["runs"] == [{"run": "run-01", "start_s": "1554115465.663", "duration_s": 5.0}]
    row = {"signal": "v", "unit": "", "samples": 2, "rate_hz": 1.0, "lowest": 0.0, "highest": 1.0, "note": ""}
    listed = {"signals": {"bus.json": [row | {"start_s": start, "end_s": start + 906.25}]}}
    assert shorten_import(listed)["bus.json"][0]["time_s"] == "1554115465.663 to 1554116371.913"
    from_zero = {"signals": {"a.csv": [row | {"start_s": -0.0004, "end_s": 10.0}]}}
    assert shorten_import(from_zero)["a.csv"][0]["time_s"] == "0 to 10"


def test_anti_lock_stops_on_a_wet_road_are_imported_and_read(tmp_path: Path) -> None:
    for number in range(2):
        columns = braking_columns(4.0 + number)
        columns["brake_pressure"] *= 7.0
        write_csv(tmp_path / f"stop-{number}.csv", log_signal(columns))
    runs = [
        {"name": f"r{i}", "file": f"stop-{i}.csv", "part": "held_out" if i else "train"} for i in range(2)
    ]
    with pytest.raises(InputError, match=r"gives 0\.2\d* m/s\^2 per MPa over the braking of r0, r1, which"):
        import_measurements(str(tmp_path), map=write_map(tmp_path, runs=runs), out=str(tmp_path / "dry"))
    wet = write_map(tmp_path, runs=runs, conditions={"weather": "rain", "precipitation_mm_h": 25.0})
    import_measurements(str(tmp_path), map=wet, out=str(tmp_path / "wet"))
    assert [run.weather for run in read_campaign(tmp_path / "wet").runs] == ["rain", "rain"]
