"""Every fault of a recording or a map is named with its run and channel, and then nothing is written."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from flows.measured.importing import import_measurements
from tasks.errors import InputError
from tests.campaign.recorded import MAP, braking_columns, log_signal
from tests.flows.measured.recordings import import_columns, map_beside, problems_of, write_csv, write_map

TOLERANCES = yaml.safe_load(MAP)["tolerances_1sigma"]


@pytest.mark.parametrize(
    ("train", "held_out", "shared"),
    [
        ({}, {}, True),
        ({"to_s": 2.0}, {"from_s": 1.99}, True),
        ({"to_s": 2.0}, {"from_s": 2.0}, False),
        ({"to_s": 2.0}, {"from_s": 2.0, "part": "train"}, False),
        ({}, {"part": "train"}, False),
        ({}, {"file": "other.csv"}, False),
    ],
)
def test_what_judges_a_fit_shares_no_sample_with_what_is_fitted(
    tmp_path: Path, train: dict[str, object], held_out: dict[str, object], shared: bool
) -> None:
    for file in ("log.csv", "other.csv"):
        write_csv(tmp_path / file, log_signal(braking_columns()))
    common = {"file": "log.csv"}
    runs = [
        {"name": "a", **common, **train},
        {"name": "b", "part": "held_out", **common, **held_out},
    ]
    out, channel_map = tmp_path / "campaign", write_map(tmp_path, runs=runs)
    if not shared:
        first, second = import_measurements(str(tmp_path), map=channel_map, out=str(out))["runs"]
        if train and first["file"] == second["file"]:  # windows that touch
            assert first["start_s"] + first["duration_s"] < second["start_s"]
        return
    with pytest.raises(InputError, match="run b is held out and must share no sample with a training run"):
        import_measurements(str(tmp_path), map=channel_map, out=str(out))
    assert not out.exists()


def _held(x: np.ndarray) -> np.ndarray:
    return np.where((np.arange(len(x)) > 200) & (np.arange(len(x)) < 300), x[200], x)


@pytest.mark.parametrize(
    ("signal", "damage", "words"),
    [
        ("v_kmh", lambda x: x / 3.6, "wheel_speed_front give a rolling radius"),
        ("ax_g", lambda x: x * 9.81, "taken as g, it looks like m/s^2"),
        ("ax_g", lambda x: 1.0 + 0.01 * np.sin(np.arange(len(x))), "m/s^2 off on average, which no road"),
        ("p_bar", lambda x: x * 100, "channel brake_pressure reaches"),
        ("pitch_up", lambda x: -x, "of deceleration, which must lie in 0.02 to 2: turn its sign over"),
        ("pitch_rate_up", lambda x: -x, "the slope of pitch: turn its sign over"),
        ("az", lambda x: x - 9.81, "must exclude gravity"),
        ("pitch_up", _held, "pitch: is frozen: it holds"),
        ("p_bar", lambda x: np.where(np.arange(len(x)) < 300, x, np.nan), "brake_pressure: has samples from"),
        ("az", lambda x: np.where(np.arange(len(x)) == 90, np.inf, x), "vertical_acceleration: has 1 samples"),
        ("t_ms", lambda x: x + 700.0 * (np.arange(len(x)) > 100), "gaps or forward jumps of its clock"),
        ("w_fl", lambda x: np.where((np.arange(len(x)) // 80) == 1, np.nan, x), "wheel_speed_front: has gaps"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_run_and_channel(
    tmp_path: Path, signal: str, damage: Callable[[np.ndarray], np.ndarray], words: str
) -> None:
    log = log_signal(braking_columns())
    log[signal] = damage(log[signal])
    text = problems_of(tmp_path, log)
    assert words in text
    assert all(line.startswith("log (log.csv): ") or "braking of log" in line for line in text.splitlines())


def test_all_problems_come_at_once(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["pitch_up"] = -log["pitch_up"]
    log["az"][90] = np.inf
    log["p_bar"] *= 100
    text = problems_of(tmp_path, log)
    assert "pitch gives -" in text and "not numbers" in text and "brake_pressure reaches" in text


def test_a_missing_signal_is_named_with_those_that_come_near(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["v_kmph"] = log.pop("v_kmh")
    assert "signal v_kmh is missing; there are: v_kmph" in problems_of(tmp_path, log)


@pytest.mark.parametrize(
    ("rate", "sound"), [(100, True), (50, True), (120, True), (130, False), (1000, False)]
)
def test_no_campaign_has_more_samples_than_were_measured(tmp_path: Path, rate: float, sound: bool) -> None:
    """At 80 Hz in place of its 20, the log of the tutorial gave a verdict with a fiftieth of the interval."""
    log = log_signal(braking_columns())
    if sound:
        source = write_csv(tmp_path / "log.csv", log)
        assert len(import_columns(tmp_path, source, sample_rate_hz=rate)["speed"]) > 3.9 * rate
    else:
        assert "must not be above the rate of the fastest signal, 100 Hz" in problems_of(
            tmp_path, log, sample_rate_hz=rate
        )


def test_an_acceleration_that_is_the_rate_of_the_speed_is_left_out_and_told(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["ax_g"] = np.gradient(log["v_kmh"] / 3.6, 0.01) / 9.80665
    write_csv(tmp_path / "log.csv", log)
    report = import_measurements(str(tmp_path), map=write_map(tmp_path), out=str(tmp_path / "campaign"))
    assert any("left out, as under not_measured" in warning for warning in report["warnings"])
    assert "longitudinal_acceleration" in report["not_measured"]
    assert "longitudinal_acceleration" not in report["channels"]
    header = yaml.safe_load((tmp_path / "campaign" / "campaign.yaml").read_text())
    assert "longitudinal_acceleration" in header["not_measured"]
    assert "longitudinal_acceleration" not in pd.read_parquet(tmp_path / "campaign" / "runs" / "log.parquet")


def test_a_wheel_that_locks_is_not_called_frozen(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    row = np.arange(len(log["w_r"]))
    log["w_r"] = np.where((row >= 150) & (row < 250), 0.0, log["w_r"])
    told = problems_of(tmp_path, log)
    assert (
        "wheel_speed_rear: stands still, as a locked wheel or a dead sensor does: it holds 0 for 1.00 s"
        in told
    )
    assert "is frozen" not in told


def test_a_standing_car_does_not_freeze_its_sensors(tmp_path: Path) -> None:
    columns = braking_columns()
    for name in columns:
        columns[name][:120] = columns[name][:120] if name == "time" else 0.0
    assert "is frozen" not in problems_of(
        tmp_path, log_signal(columns) | {"az": np.full(len(columns["time"]), 99.0)}
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"channels": {"sped": {"source": "v", "unit": "m/s"}}}, "channel sped: no such channel"),
        ({"not_measured": ["pitch"]}, "channel pitch must stand either in channels or in not_measured"),
        ({"time": {"source": "t", "unit": "bar"}}, "time unit must be one of"),
        ({"runs": [{"name": "a", "file": "log.csv"}] * 2}, "run a stands twice"),
        ({"runs": [{"name": "a", "file": "gone.csv"}]}, "gone.csv: the map's runs name it"),
        (
            {"runs": [{"name": "a", "file": "log.csv", "conditions": {"weather": "hail"}}]},
            "runs.0.conditions.weather: must be",
        ),
        ({"colour": "red"}, "colour: unknown key"),
        (
            {"tolerances_1sigma": TOLERANCES | {"mass": 5}},
            "mass: must be a share of at most 1, not per cent; it is 5",
        ),
        ({"channels": {"speed": {"source": "v", "unit": "m/s", "scale": 0}}}, "speed.scale: must not be 0"),
        (
            {"channels": {"speed": {"source": "v", "unit": "m/s", "delay_s": -20}}},
            "must be a delay in seconds",
        ),
        (
            {
                "channels": {
                    name: {"source": "w", "unit": "rpm"} for name in ("wheel_speed_front", "wheel_speed_rear")
                }
            },
            "signal w must be one measurement; it stands for wheel_speed_front, wheel_speed_rear",
        ),
        (
            {"channels": {"wheel_speed_rear": {"source": "w", "unit": "km/h"}}},
            "give the source's true unit, or a gain, here of the value 1/(3.6 x radius)",
        ),
        ({"conditions": {"weather": "rain"}}, "conditions: weather rain needs precipitation_mm_h above 0"),
        ({"conditions": {"hazard_height_m": 0.1}}, "needs hazard_length_m above 0"),
        ({"runs": [{"name": "../a", "file": "log.csv"}]}, "runs.0.name"),
    ],
)
def test_a_faulty_map_is_named_by_its_key(tmp_path: Path, changes: dict[str, object], words: str) -> None:
    assert words in problems_of(tmp_path, log_signal(braking_columns()), **changes)


@pytest.mark.parametrize("file", ["../log.csv", "/etc/passwd", ""])
def test_a_run_stays_in_the_folder_of_the_measurements(tmp_path: Path, file: str) -> None:
    text = problems_of(tmp_path, log_signal(braking_columns()), runs=[{"name": "a", "file": file}])
    assert "runs.0.file: must be a file in the folder" in text or "runs.0.file: String should have" in text


def test_a_faulty_tolerance_hides_neither_a_wrong_unit_nor_a_missing_signal(tmp_path: Path) -> None:
    content = yaml.safe_load(MAP)
    content["tolerances_1sigma"]["mass"] = -1.0
    content["channels"]["speed"] |= {"unit": "bar"}
    content["channels"]["pitch"] |= {"source": "nick"}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content))
    source = write_csv(tmp_path / "log.csv", log_signal(braking_columns()))
    with pytest.raises(InputError) as caught:
        import_measurements(source, map=str(tmp_path / "map.yaml"), out=str(tmp_path / "campaign"))
    text = str(caught.value)
    assert "tolerances_1sigma.mass: must be greater than 0" in text
    assert "channel speed: unit bar is of pressure" in text
    assert "signal nick is missing" in text


def test_files_that_give_runs_of_one_name_are_told(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", log_signal(braking_columns()))
    pd.DataFrame(log_signal(braking_columns())).to_parquet(tmp_path / "log.parquet")
    with pytest.raises(InputError, match="run log stands twice"):
        import_measurements(str(tmp_path), map=map_beside(tmp_path), out=str(tmp_path / "campaign"))


def test_a_clock_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["t_ms"] = log["t_ms"] * 1e12
    log["v_kmh"] = 50.0 + 0.0 * log["v_kmh"]  # else the fall of the speed tells of the clock
    assert "run log must have at most 20000000 samples; at" in problems_of(tmp_path, log)


def test_text_in_a_number_column_is_named(tmp_path: Path) -> None:
    log: dict[str, object] = dict(log_signal(braking_columns()))
    log["v_kmh"] = ["fast"] * len(braking_columns()["time"])
    pd.DataFrame(log).to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(InputError, match="signal v_kmh must be of numbers"):
        import_measurements(str(tmp_path / "log.csv"), map=write_map(tmp_path), out=str(tmp_path / "out"))


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    source = write_csv(tmp_path / "log.csv", log_signal(braking_columns()))
    with pytest.raises(InputError, match="new or empty folder"):
        import_measurements(source, map=write_map(tmp_path), out=str(tmp_path))
