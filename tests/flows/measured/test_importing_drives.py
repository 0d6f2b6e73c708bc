"""A whole drive is cut at its brake applications, and tells the heat with which each run begins."""

from pathlib import Path

import numpy as np
import pytest

from catalogs.campaigns import read_campaign
from flows.measured.importing import import_measurements
from tasks.campaign.channels import MAIN_CHANNELS
from tasks.errors import InputError
from tests.campaign.recorded import braking_columns, log_signal
from tests.flows.measured.recordings import write_csv, write_map


def test_one_run_per_brake_application_every_third_held_out(tmp_path: Path) -> None:
    columns = braking_columns(seconds=12.0)
    t = columns["time"]
    pulses = sum(np.clip((t - s) / 0.1, 0, 1) * np.clip((s + 0.8 - t) / 0.1, 0, 1) for s in (2.0, 5.0, 8.0))
    touch = np.clip((t - 10.5) / 0.05, 0, 1) * np.clip((10.7 - t) / 0.05, 0, 1)
    columns["brake_pressure"] = 0.9 * (pulses + touch) + 0.001 * np.sin(40 * t)
    columns["longitudinal_acceleration"] = -1.5 * columns["brake_pressure"] + 1e-3 * np.cos(50 * t)
    columns["speed"] = 20.0 + np.cumsum(columns["longitudinal_acceleration"]) / 100
    columns["longitudinal_acceleration"] += 0.05 * np.cos(70 * t)  # an accelerometer of its own
    for name in ("wheel_speed_front", "wheel_speed_rear"):
        columns[name] = columns["speed"] / 0.32
    columns["pitch"] = 0.5 * columns["brake_pressure"]
    columns["pitch_rate"] = np.gradient(columns["pitch"], t)
    segment = {
        "above_mpa": 0.12, "merge_gap_s": 0.08, "minimum_s": 0.5, "before_s": 1.0, "after_s": 0.8, "held_out_every": 3,
    }  # fmt: skip
    report = import_measurements(
        write_csv(tmp_path / "log.csv", log_signal(columns)),
        map=write_map(tmp_path, segment=segment), out=str(tmp_path / "campaign"),
    )  # fmt: skip
    assert [(run["run"], run["part"]) for run in report["runs"]] == [
        ("run-01", "train"), ("run-02", "train"), ("run-03", "held_out"),
    ]  # fmt: skip
    assert [run["start_s"] for run in report["runs"]] == pytest.approx([1.02, 4.02, 7.02], abs=0.02)
    heat = [run.braking_heat for run in read_campaign(tmp_path / "campaign").runs]
    at = [float(columns["speed"][np.searchsorted(t, time)]) for time in (1.5, 3.5, 6.5)]
    lost = [0.5 * (at[0] ** 2 - speed**2) for speed in at]
    assert heat == pytest.approx(lost, rel=0.05)


def test_no_heat_is_estimated_for_a_run_whose_disc_temperature_is_declared(tmp_path: Path) -> None:
    columns = braking_columns(14.0)
    columns["speed"] = 20.0 - np.cumsum(columns["brake_pressure"]) / 100
    columns["longitudinal_acceleration"] /= 1.5  # as the speed says
    for name in ("wheel_speed_front", "wheel_speed_rear"):
        columns[name] = columns["speed"] / 0.32
    write_csv(tmp_path / "log.csv", log_signal(columns))
    found = []
    for name, conditions in (
        ("unknown", {}), ("cold", {"disc_temperature_above_ambient_c": 0.0}),
        ("hot", {"disc_temperature_above_ambient_c": 270.0}),
        ("first", {"disc_temperature_above_ambient_c": 90.0}),
    ):  # fmt: skip
        runs = [
            {"name": f"r{i}", "from_s": float(i), "to_s": i + 3.0, "file": "log.csv", "part": part,
             "conditions": conditions if name != "first" or i == 0 else {}}
            for i, part in ((0, "train"), (9, "held_out"))
        ]  # fmt: skip
        out = tmp_path / name
        import_measurements(str(tmp_path / "log.csv"), map=write_map(tmp_path, runs=runs), out=str(out))
        found.append([(run.disc_rise, run.braking_heat > 0.0) for run in read_campaign(out).runs])
    assert found == [
        [(0.0, False), (0.0, True)], [(0.0, False)] * 2, [(270.0, False)] * 2, [(90.0, False), (0.0, True)],
    ]  # fmt: skip


def test_a_segment_that_is_no_run_is_listed_and_the_others_come_in(tmp_path: Path) -> None:
    columns = braking_columns(seconds=12.0)
    t = columns["time"]
    applied = sum(((t >= start) & (t < start + 1.0)).astype(float) for start in (0.2, 5.0, 8.0))
    columns["brake_pressure"] = 0.9 * applied + 0.001 * np.sin(40 * t)
    driven = np.where(t < 2.0, 0.0, np.minimum(10.0 * (t - 2.0), 20.0 + 0.1 * t))
    columns["speed"] = driven - np.cumsum(2.0 * applied * (t > 2.0)) / 100
    command = write_csv(
        tmp_path / "log.csv", log_signal(columns) | {"pedal": columns["brake_pressure"] * 10.0}
    )
    segment = {
        "above_mpa": 0.5, "merge_gap_s": 0.1, "minimum_s": 0.5, "before_s": 2.5, "after_s": 0.8, "held_out_every": 2,
    }  # fmt: skip
    channels = {
        "brake_command": {"source": "pedal", "unit": "%"},
        "speed": {"source": "v_kmh", "unit": "km/h"},
    }
    others = [channel.name for channel in MAIN_CHANNELS if channel.name != "speed"]
    channel_map = write_map(tmp_path, segment=segment, channels=channels, not_measured=others)
    report = import_measurements(command, map=channel_map, out=str(tmp_path / "campaign"))
    (left_out,) = report["left_out"]
    assert left_out.startswith("log.csv from 0.000 to 1.990 s: the car stands")
    assert [(run["run"], run["start_s"]) for run in report["runs"]] == [
        ("run-01", pytest.approx(2.5)), ("run-02", pytest.approx(6.79)),
    ]  # fmt: skip


def test_a_recording_that_never_brakes_is_listed_beside_the_segments(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    (tmp_path / "logs").mkdir()
    write_csv(tmp_path / "logs" / "stop.csv", log)
    write_csv(tmp_path / "logs" / "coast.csv", log | {"p_bar": 0.0 * log["p_bar"]})
    segment = {
        "above_mpa": 0.12, "merge_gap_s": 0.08, "minimum_s": 0.5, "before_s": 1.0, "after_s": 0.8, "held_out_every": 3,
    }  # fmt: skip
    report = import_measurements(
        str(tmp_path / "logs"), map=write_map(tmp_path, segment=segment), out=str(tmp_path / "campaign")
    )
    assert {run["file"] for run in report["runs"]} == {"stop.csv"}
    assert report["left_out"] == [
        "coast.csv: no run, for the brake is never applied above 0.12 MPa for 0.5 s: cut it by runs in place of segment"
        " where it is to be used, as a coast-down is"
    ]


@pytest.mark.parametrize(
    ("above", "words"),
    [
        (0.12, "finds 1 brake application, and none is a run: put right what each is left out for"),
        (20.0, "finds no brake application: lower above_mpa or minimum_s"),
    ],
)
def test_a_segment_without_a_run_says_whether_the_brake_was_found(
    tmp_path: Path, above: float, words: str
) -> None:
    log = log_signal(braking_columns())
    log["t_ms"] += 5000.0 * (np.arange(len(log["t_ms"])) > np.argmax(log["p_bar"] > 1.2) + 20)
    segment = {
        "above_mpa": above, "merge_gap_s": 6.0, "minimum_s": 0.5, "before_s": 1.0, "after_s": 0.8, "held_out_every": 2,
    }  # fmt: skip
    source = write_csv(tmp_path / "log.csv", log)
    with pytest.raises(InputError) as refused:
        import_measurements(source, map=write_map(tmp_path, segment=segment), out=str(tmp_path / "campaign"))
    assert words in refused.value.problems[0]
    assert len(refused.value.problems) == 2
