"""Reading campaigns: what is right is read, what is wrong is named with its run and channel."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from catalogs.campaigns import read_campaign
from tasks.campaign.campaign import CHANNELS, MASKED_SPEED, find_motion
from tests.catalogs.campaign_folder import (
    NAMES,
    braking_columns,
    change_header,
    list_problems,
    write_campaign,
    write_run,
)
from tests.conftest import DATA


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_campaign(tmp_path)


def test_a_sound_campaign_is_read_with_its_split_and_hashes(folder: Path) -> None:
    campaign = read_campaign(folder)
    assert [run.name for run in campaign.train] == NAMES[:3]
    assert [run.name for run in campaign.held_out] == NAMES[3:]
    assert campaign.runs[0].response.shape == (300, 7)
    again = read_campaign(folder)
    assert (campaign.content_hash, campaign.split_hash) == (again.content_hash, again.split_hash)


def test_no_run_stands_in_a_campaign_under_two_names(folder: Path) -> None:
    """A copy of a training run that is held out judges the fit by what was fitted."""
    write_run(folder, NAMES[4], braking_columns(1))
    assert "run-05: must be a recording of its own; its file is that of run-02" in list_problems(folder)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("dry,0.0", "rain,1e9", "run-01: precipitation_mm_h must be at most 1872"),
        ("dry,0.0,0.0", "snow,3.0,0.0", "run-01: weather snow needs an accumulation time"),
    ],
)
def test_a_run_is_driven_in_weather_that_there_is(folder: Path, old: str, new: str, words: str) -> None:
    table = folder / "runs.csv"
    table.write_text(table.read_text().replace(old, new))
    assert words in list_problems(folder)


@pytest.mark.parametrize(
    ("column", "value", "wrong", "words"),
    [
        ("braking_heat_j_kg", 450.0, "-3", "braking_heat_j_kg must not be negative; it is -3"),
        ("felt_slope_rad", -0.02, "4.5", "felt_slope_rad must be within 0.4 of 0; it is 4.5"),
    ],
)
def test_what_an_import_estimates_of_a_run_may_be_there_and_is_then_a_number(
    folder: Path, column: str, value: float, wrong: str, words: str
) -> None:
    def read() -> set[float]:
        runs = read_campaign(folder).runs
        return {run.braking_heat if column.startswith("braking") else run.felt_slope for run in runs}

    assert read() == {0.0}
    table = folder / "runs.csv"
    lines = table.read_text().splitlines()

    def write(text: str) -> None:
        table.write_text("\n".join([f"{lines[0]},{column}", *(f"{line},{text}" for line in lines[1:])]))

    write(str(value))
    assert read() == {value}
    write("hot")
    assert f"run-01: {column} must be a finite number; it is 'hot'" in list_problems(folder)
    write(wrong)
    assert f"run-01: {words}" in list_problems(folder)


def drive_off(folder: Path, standing: int, total: int = 1000) -> None:
    """Let run-01 stand for some samples, gain 20 m/s at 5 m/s2, and then brake as before."""
    braking, rng = braking_columns(0), np.random.default_rng(7)
    acceleration = np.concatenate((np.zeros(standing), np.full(400, 5.0)))
    speed, pitch = 0.01 * np.cumsum(acceleration), -0.2 * acceleration
    first = {
        "brake_pressure": 0.0 * speed, "speed": speed, "longitudinal_acceleration": acceleration,
        "wheel_speed_front": speed / 0.32, "wheel_speed_rear": speed / 0.32, "pitch": pitch,
        "pitch_rate": np.gradient(pitch, 0.01), "vertical_acceleration": 0.0 * speed,
    }  # fmt: skip
    columns = {
        name: np.concatenate((x + 0.01 * rng.standard_normal(len(x)), braking[name]))[:total]
        for name, x in first.items()
    }
    columns["time"] = np.arange(len(columns["speed"])) * 0.01
    write_run(folder, NAMES[0], columns)


def test_a_run_that_begins_at_a_standstill_is_used_from_where_the_car_moves(folder: Path) -> None:
    drive_off(folder, 40)
    run = read_campaign(folder).runs[0]
    assert len(run.pressure) == pytest.approx(740 - 80, abs=2) and run.speed.min() >= MASKED_SPEED
    assert run.pressure[-300:] == pytest.approx(braking_columns(0)["brake_pressure"])


def test_a_run_in_which_the_car_stands_is_refused_with_what_to_do(folder: Path) -> None:
    drive_off(folder, 40, total=92)
    assert (
        "run-01: channel speed must stay at or above 2 m/s for 20 samples, which take 0.2 s at 100 Hz; it does for 12:"
        " leave the run out where the car stands or crawls; where it drives, log faster or take a longer run"
    ) in list_problems(folder)


def test_a_run_over_a_road_feature_begins_moving_because_the_feature_has_a_place(folder: Path) -> None:
    drive_off(folder, 40)
    table = folder / "runs.csv"
    table.write_text(table.read_text().replace("0.0,0.0,0.0\n", "20.0,3.6,0.05\n", 1))
    assert "run-01: channel speed must begin at or above 2 m/s in a run with a road feature" in list_problems(
        folder
    )


@pytest.mark.parametrize(
    ("speed", "used"),
    [
        ((9.0, 8.0, 1.0, 9.0, 9.0, 9.0), (0, 2)),
        ((0.0, 3.0, 1.0, 9.0, 8.0, 7.0), (3, 6)),
        ((0.0, 9.0, 8.0, 0.0), (1, 3)),
        ((0.0, 1.0), (0, 0)),
        ((3.0, 1.0, 9.0, 9.0, 9.0), (2, 5)),
    ],
)
def test_a_run_is_used_until_it_stops_or_if_it_begins_slowly_where_it_drives_longest(
    monkeypatch: pytest.MonkeyPatch, speed: tuple[float, ...], used: tuple[int, int]
) -> None:
    monkeypatch.setattr("tasks.campaign.campaign.LEAST_SAMPLES", 2)
    assert find_motion(np.array(speed)) == used


def test_the_hash_changes_with_any_sample(folder: Path) -> None:
    before = read_campaign(folder).content_hash
    columns = braking_columns(0)
    columns["speed"][5] += 1e-6
    write_run(folder, NAMES[0], columns)
    assert read_campaign(folder).content_hash != before


def test_a_slow_channel_has_samples_where_its_file_has_values(folder: Path) -> None:
    columns = braking_columns(1)
    kept = np.arange(300) % 10 == 4
    columns["speed"] = np.where(kept, columns["speed"], np.nan)
    write_run(folder, "run-02", columns)
    first, second, *_ = read_campaign(folder).runs
    assert first.sampled is None and second.sampled is not None
    np.testing.assert_array_equal(second.sampled[:, 0], kept)
    assert second.sampled[:, 1:].all() and np.isfinite(second.response).all()


def test_a_hole_in_a_slow_channel_is_a_gap(folder: Path) -> None:
    columns = braking_columns(1)
    kept = (np.arange(300) % 10 == 4) & (abs(np.arange(300) - 150) > 40)
    columns["speed"] = np.where(kept, columns["speed"], np.nan)
    write_run(folder, "run-02", columns)
    assert "run-02: channel speed: has gaps" in list_problems(folder)


@pytest.mark.parametrize(
    ("channel", "damage", "words"),
    [
        (
            "pitch",
            lambda x: np.where(np.arange(300) == 7, np.nan, x),
            "channel pitch: has 1 samples that are",
        ),
        ("time", lambda x: x + 0.5 * (np.arange(300) > 100), "channel time must advance"),
        ("time", lambda x: 1.02 * x, "300 samples take"),
        ("brake_pressure", lambda x: x * 10, "channel brake_pressure gives 0.2"),  # a check of all runs
        ("brake_pressure", lambda x: np.full(300, 0.7), "channel brake_pressure is frozen: it holds 0.7 MPa"),
        ("brake_pressure", lambda x: np.zeros(300), "channel brake_pressure is 0 over the whole run"),
        ("wheel_speed_rear", lambda x: x * 0.32 * 3.6, "(one looks like km/h)"),
    ],
)
def test_what_a_check_finds_is_named_with_run_and_channel(
    folder: Path, channel: str, damage, words: str
) -> None:  # type: ignore[no-untyped-def]
    columns = braking_columns(1)
    columns[channel] = damage(columns[channel])
    write_run(folder, "run-02", columns)
    text = list_problems(folder)
    assert "run-02" in text and words in text


def test_what_only_several_channels_tell_is_found(folder: Path) -> None:
    in_radians, torn = braking_columns(1), braking_columns(2)
    for channel in ("pitch", "pitch_rate"):
        in_radians[channel] = np.radians(in_radians[channel])
    kept = np.r_[0:150, 210:300]
    torn = {name: values[: len(kept)] if name == "time" else values[kept] for name, values in torn.items()}
    write_run(folder, "run-02", in_radians)
    write_run(folder, "run-03", torn)
    text = list_problems(folder)
    assert "run-02: channel pitch gives 0.00" in text and "run-03: channel speed must not jump" in text


def test_coarse_sensors_and_locked_wheels_are_no_faults(folder: Path) -> None:
    columns = braking_columns(1)
    for channel, step in (("speed", 0.0625 / 3.6), ("pitch", 0.05), ("wheel_speed_front", 0.1)):
        columns[channel] = np.round(columns[channel] / step) * step
    columns["wheel_speed_rear"][170:210] = 0.0
    write_run(folder, "run-02", columns)
    assert len(read_campaign(folder).runs) == 6


def test_a_gentle_stop_behind_an_engine_that_brakes_is_no_fault_of_the_gauge(folder: Path) -> None:
    columns = braking_columns(1)
    columns["brake_pressure"] *= 0.1
    columns["speed"] = 20.0 - np.cumsum(1.5 * np.clip((columns["time"] - 1.0) / 0.3, 0.0, 1.0)) * 0.01
    columns = {name: columns[name] for name in ("time", "brake_pressure", "speed")}
    others = [name for name in CHANNELS if name != "speed"]
    change_header(folder, lambda h: h.update(not_measured=others))
    write_run(folder, "run-02", columns)
    assert len(read_campaign(folder).runs) == 6


def test_every_measured_campaign_at_hand_is_sound() -> None:
    folders = sorted(path.parent for path in (DATA / "measured" / "campaigns").glob("*/campaign.yaml"))
    if not folders:
        pytest.skip("no campaigns; set MUSYNC_DATA to the folder that holds measured/")
    for path in folders:
        assert len(read_campaign(path).runs) >= 6


def test_what_was_not_measured_is_stated_and_counts_as_nothing(folder: Path) -> None:
    missing = ["pitch", "pitch_rate", "vertical_acceleration", "wheel_speed_rear"]
    change_header(folder, lambda h: h.update(not_measured=missing))
    for seed, name in enumerate(NAMES):
        columns = braking_columns(seed)
        for channel in missing[:-1]:
            del columns[channel]
        write_run(folder, name, columns)
    campaign = read_campaign(folder)
    assert campaign.channels == ("speed", "longitudinal_acceleration", "wheel_speed_front")
    assert not campaign.runs[0].response[:, ~campaign.is_measured].any()


def test_engine_slope_and_throttle_are_read_where_they_were_measured(folder: Path) -> None:
    extra = {"engine_torque": -300.0, "road_slope": 2.0, "throttle": 0.4}
    write_run(
        folder, "run-02", {**braking_columns(1), **{name: np.full(300, v) for name, v in extra.items()}}
    )
    plain, full = read_campaign(folder).runs[:2]
    assert plain.drive_torque is plain.road_slope is plain.throttle is None
    assert full.drive_torque is not None and full.drive_torque[7] == -300.0
    assert full.road_slope is not None and full.road_slope[7] == pytest.approx(np.radians(2.0))
    assert full.throttle is not None and full.throttle[7] == 0.4


def test_one_run_to_learn_from_and_one_to_judge_are_enough(folder: Path) -> None:
    change_header(folder, lambda h: h.update(split={"train": NAMES[:5], "held_out": NAMES[5:]}))
    assert len(read_campaign(folder).held_out) == 1
    change_header(folder, lambda h: h.update(split={"train": NAMES, "held_out": []}))
    text = list_problems(folder)
    assert "split held_out needs at least one run" in text and "`part: held_out` in the channel map" in text


def test_a_run_in_both_parts_of_the_split_is_refused(folder: Path) -> None:
    header = yaml.safe_load((folder / "campaign.yaml").read_text())
    header["split"]["held_out"].append("run-01")
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))
    assert "run-01: is in both parts" in list_problems(folder)
