"""Reading campaigns: what is right is read, what is wrong is named with its run and channel."""

import csv
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from catalogs.campaigns import read_campaign
from catalogs.effects import load_effects
from tasks.errors import InputError
from tests.conftest import DATA

TOLERANCES = {
    "pressure_gain": 0.02, "mass": 0.01, "pitch_gain": 0.02, "wheel_radius": 0.005, "suspension_damping": 0.04,
    "suspension_stiffness": 0.02, "grade": 0.0015,
    "run": {"initial_speed_m_s": 0.05, "friction": 0.03, "acceleration_bias_m_s2": 0.03, "pitch_offset_deg": 0.03},
}  # fmt: skip
NAMES = [f"run-{i:02d}" for i in range(1, 7)]


def braking_columns(seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.arange(300) * 0.01
    pressure = np.clip((t - 1.0) / 0.3, 0.0, 1.0) * 1.5
    acceleration = -2.0 * pressure
    speed = 20.0 + np.cumsum(acceleration) * 0.01
    pitch = 0.4 * pressure
    columns = {
        "brake_pressure": pressure, "speed": speed, "longitudinal_acceleration": acceleration,
        "wheel_speed_front": speed / 0.32, "wheel_speed_rear": speed / 0.32, "pitch": pitch,
        "pitch_rate": np.gradient(pitch, 0.01), "vertical_acceleration": np.zeros(300),
    }  # fmt: skip
    return {"time": t, **{name: x + 0.01 * rng.standard_normal(300) for name, x in columns.items()}}


def write_run(folder: Path, name: str, columns: dict[str, np.ndarray]) -> None:
    pq.write_table(pa.table(columns), folder / "runs" / f"{name}.parquet")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "runs").mkdir()
    header = {
        "campaign": "toy", "vehicle": "paper-reference", "sample_rate_hz": 100,
        "split": {"train": NAMES[:3], "held_out": NAMES[3:]}, "tolerances_1sigma": TOLERANCES,
    }  # fmt: skip
    (tmp_path / "campaign.yaml").write_text(yaml.safe_dump(header))
    row = {
        "weather": "dry", "precipitation_mm_h": 0.0, "snow_accumulation_h": 0.0, "direction": 1,
        "disc_temperature_above_ambient_c": 20.0, "hazard_center_m": 0.0, "hazard_length_m": 0.0,
        "hazard_height_m": 0.0,
    }  # fmt: skip
    with open(tmp_path / "runs.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, ["run", *row])
        writer.writeheader()
        writer.writerows({"run": name, **row} for name in NAMES)
    for i, name in enumerate(NAMES):
        write_run(tmp_path, name, braking_columns(i))
    return tmp_path


def problems_of(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_campaign(folder)
    return str(caught.value)


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
    assert "run-05: must be a recording of its own; its file is that of run-02" in problems_of(folder)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("dry,0.0", "rain,0.0", "run-01: weather rain needs precipitation_mm_h above 0"),
        ("dry,0.0", "dry,25.0", "run-01: weather dry has no precipitation"),
        ("dry,0.0", "rain,-2.0", "run-01: precipitation_mm_h must not be negative"),
        ("dry,0.0", "rain,1e9", "run-01: precipitation_mm_h must be at most 1872"),
        ("dry,0.0,0.0", "snow,3.0,0.0", "run-01: weather snow needs an accumulation time"),
    ],
)
def test_a_run_is_driven_in_weather_that_there_is(folder: Path, old: str, new: str, words: str) -> None:
    table = folder / "runs.csv"
    table.write_text(table.read_text().replace(old, new))
    assert words in problems_of(folder)


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
    assert "run-02: channel speed has a gap" in problems_of(folder)


@pytest.mark.parametrize(
    ("channel", "damage", "words"),
    [
        ("pitch", lambda x: np.where(np.arange(300) == 7, np.nan, x), "channel pitch has a gap"),
        ("speed", lambda x: x * 3.6, "channels speed and wheel_speed_front give a rolling radius"),
        ("brake_pressure", lambda x: x * 1e3, "channel brake_pressure reaches"),
        ("time", lambda x: x + 0.5 * (np.arange(300) > 100), "channel time must advance"),
        ("pitch_rate", lambda x: np.full(300, 0.1), "channel pitch_rate is frozen"),
        ("time", lambda x: 1.02 * x, "300 samples take"),
        ("pitch", lambda x: -x, "channel pitch runs against the deceleration"),
        ("longitudinal_acceleration", lambda x: -x, "channel longitudinal_acceleration runs against"),
        ("longitudinal_acceleration", lambda x: x / 9.81, "it looks like g"),
        ("brake_pressure", lambda x: x * 10, "channel brake_pressure gives 0.2"),
        ("brake_pressure", lambda x: np.full(300, 0.7), "channel brake_pressure is frozen: it holds 0.7 MPa"),
        ("brake_pressure", lambda x: np.zeros(300), "channel brake_pressure is 0 over the whole run"),
        ("speed", lambda x: np.where(abs(np.arange(300) - 170) < 20, x[150], x), "channel speed is frozen"),
        ("vertical_acceleration", lambda x: x + 9.81, "must exclude gravity"),
        ("wheel_speed_rear", lambda x: x * 3.6, "channels speed and wheel_speed_rear give"),
        ("wheel_speed_rear", lambda x: x * 0.32 * 3.6, "(one looks like km/h)"),
    ],
)
def test_what_is_wrong_is_named_with_run_and_channel(folder: Path, channel: str, damage, words: str) -> None:  # type: ignore[no-untyped-def]
    columns = braking_columns(1)
    columns[channel] = damage(columns[channel])
    write_run(folder, "run-02", columns)
    text = problems_of(folder)
    assert "run-02" in text and words in text


def test_what_only_several_channels_tell_is_found(folder: Path) -> None:
    in_radians, torn = braking_columns(1), braking_columns(2)
    for channel in ("pitch", "pitch_rate"):
        in_radians[channel] = np.radians(in_radians[channel])
    kept = np.r_[0:150, 210:300]
    torn = {name: values[: len(kept)] if name == "time" else values[kept] for name, values in torn.items()}
    write_run(folder, "run-02", in_radians)
    write_run(folder, "run-03", torn)
    text = problems_of(folder)
    assert "run-02: channel pitch gives 0.00" in text and "run-03: channel speed must not jump" in text


def test_all_faults_of_a_run_are_told_at_once(folder: Path) -> None:
    columns = braking_columns(1)
    columns["pitch"][7] = np.nan
    columns["vertical_acceleration"] += 9.81
    columns["wheel_speed_rear"] *= 3.6
    columns["time"] += 0.4 * (np.arange(300) > 100)
    write_run(folder, "run-02", columns)
    text = problems_of(folder)
    for words in ("pitch has a gap", "exclude gravity", "wheel_speed_rear give", "time must advance"):
        assert words in text


def test_coarse_sensors_and_locked_wheels_are_no_faults(folder: Path) -> None:
    columns = braking_columns(1)
    for channel, step in (("speed", 0.0625 / 3.6), ("pitch", 0.05), ("wheel_speed_front", 0.1)):
        columns[channel] = np.round(columns[channel] / step) * step
    columns["wheel_speed_rear"][170:210] = 0.0
    write_run(folder, "run-02", columns)
    assert len(read_campaign(folder).runs) == 6


def test_every_measured_campaign_at_hand_is_sound() -> None:
    folders = sorted(path.parent for path in (DATA / "measured" / "campaigns").glob("*/campaign.yaml"))
    if not folders:
        pytest.skip("no campaigns; set MUSYNC_DATA to the folder that holds measured/")
    for path in folders:
        assert len(read_campaign(path).runs) >= 6


def test_a_missing_channel_and_a_missing_file_are_both_listed(folder: Path) -> None:
    columns = braking_columns(1)
    del columns["pitch_rate"]
    write_run(folder, "run-02", columns)
    (folder / "runs" / "run-05.parquet").unlink()
    text = problems_of(folder)
    assert "run-02: channel pitch_rate is missing" in text and "run-05" in text


def test_what_was_not_measured_is_stated_and_counts_as_nothing(folder: Path) -> None:
    missing = ["pitch", "pitch_rate", "vertical_acceleration", "wheel_speed_rear"]
    changed(folder, lambda h: h.update(not_measured=missing))
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


def test_without_brake_or_speed_there_is_nothing_to_judge(folder: Path) -> None:
    changed(folder, lambda h: h.update(not_measured=["brake_pressure", "sped"]))
    text = problems_of(folder)
    assert "channel brake_pressure must be measured" in text and "'sped' is no channel" in text


def test_one_run_to_learn_from_and_one_to_judge_are_enough(folder: Path) -> None:
    changed(folder, lambda h: h.update(split={"train": NAMES[:5], "held_out": NAMES[5:]}))
    assert len(read_campaign(folder).held_out) == 1
    changed(folder, lambda h: h.update(split={"train": NAMES, "held_out": []}))
    assert "split held_out needs at least one run" in problems_of(folder)


def test_a_run_in_both_parts_of_the_split_is_refused(folder: Path) -> None:
    header = yaml.safe_load((folder / "campaign.yaml").read_text())
    header["split"]["held_out"].append("run-01")
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))
    assert "run-01: is in both parts" in problems_of(folder)


def changed(folder: Path, change) -> None:  # type: ignore[no-untyped-def]
    header = yaml.safe_load((folder / "campaign.yaml").read_text())
    change(header)
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda h: h.update(split=3), "campaign.yaml: split: must be a table"),
        (lambda h: h.update(split={"train": "run-01"}), "campaign.yaml: split.held_out is missing"),
        (lambda h: h["split"].update(train=[["run-01"]]), "split.train.0: must be a valid string"),
        (lambda h: h.update(tolerances_1sigma=None), "campaign.yaml: tolerances_1sigma: must be a table"),
        (lambda h: h["tolerances_1sigma"].update(run=[1]), "tolerances_1sigma.run: must be a table"),
        (lambda h: h["tolerances_1sigma"].update(mass=float("nan")), "tolerances_1sigma.mass: must be a finite number"),
        (lambda h: h["tolerances_1sigma"].update(mass=True), "mass: must be a valid number; it is True"),
        (lambda h: h["tolerances_1sigma"].update(mass=0), "tolerances_1sigma.mass: must be greater than 0"),
        (lambda h: h.update(sample_rate_hz=float("inf")), "sample_rate_hz: must be"),
        (lambda h: h.update(sample_rate_hz=True), "sample_rate_hz: must be a valid number"),
        (lambda h: h.update(sample_rate_hz=1e300), "sample_rate_hz: must be less than or equal to 1000000"),
        (lambda h: h.update(vehicle=7), "vehicle: must be a valid string; it is 7"),
        (lambda h: h.pop("campaign"), "campaign is missing"),
    ],
)  # fmt: skip
def test_a_faulty_header_is_named_by_its_key_beside_faulty_runs(folder: Path, change, words: str) -> None:  # type: ignore[no-untyped-def]
    changed(folder, change)
    table = (folder / "runs.csv").read_text()
    (folder / "runs.csv").write_text(table.replace("run-02,dry", "run-02,hail"))
    text = problems_of(folder)
    assert words in text and "run-02: weather must be dry, rain" in text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("run-02", "run-0é".encode("latin-1"), "runs.csv must be UTF-8 text; line 3 is not"),
        ("run-02", b"run\x0002", "a run's name must be printable characters"),
        ("run-02", b"x" * 200_000, "runs.csv must be CSV; field larger than field limit"),
        ("run-02", b"x" * 5000, "a run's name must have 1 to 100 characters; it has 5000"),
        ("run-02", b"run-01", "run-01: stands twice in runs.csv"),
        ("run-02", b"../run-02", "a run's name must be no path"),
        ("run-02", b"/etc/passwd", "a run's name must be no path"),
        ("run-02", b"..", "a run's name must be no path"),
        ("run-02", b"", "a run's name must have 1 to 100 characters; it has 0"),
        ("run-02,", b"run-02,dry,", "run 2: must have as many fields as there are columns"),
        ("run-02,dry,", b"run-02,", "run 2: must have as many fields as there are columns"),
        ("weather", b"run", "must have distinct columns; 'run' stands there twice"),
        ("run-02,dry,0.0", b"run-02,dry,nan", "run-02: precipitation_mm_h must be a finite number; it is 'nan'"),
        ("run-02,dry,0.0,0.0,1,", b"run-02,dry,0.0,0.0,0,", "run-02: direction must be 1 or -1; it is 0"),
        ("run-02", b'"run-02', "runs.csv must be CSV"),
    ],
)  # fmt: skip
def test_a_faulty_line_of_runs_is_named(folder: Path, old: str, new: bytes, words: str) -> None:
    content = (folder / "runs.csv").read_bytes()
    (folder / "runs.csv").write_bytes(content.replace(old.encode(), new, 1))
    text = problems_of(folder)
    assert words in text and len(text) < 1500


def test_faulty_parquet_files_are_all_named(folder: Path) -> None:
    columns = braking_columns(1)
    whole = (folder / "runs" / "run-01.parquet").read_bytes()
    (folder / "runs" / "run-01.parquet").write_bytes(whole[: len(whole) // 2])
    write_run(folder, "run-02", columns | {"pitch": np.array(["x"] * 300)})
    write_run(folder, "run-03", columns | {"speed": np.array(columns["speed"], dtype="datetime64[s]")})
    twice = pa.Table.from_arrays([pa.array([1.0])] * 2, names=["speed", "speed"])
    pq.write_table(twice, folder / "runs" / "run-04.parquet")
    odd = pa.schema([pa.field("pitch", pa.float64(), metadata={"units": b"\xff\xfe"})])
    pq.write_table(pa.table({"pitch": columns["pitch"]}, schema=odd), folder / "runs" / "run-05.parquet")
    (folder / "runs" / "run-06.parquet").write_bytes(b"")
    text = problems_of(folder)
    for words in (
        "run-01: run-01.parquet must be a Parquet file of numbers",
        "run-02: channel pitch must be of numbers; run-02.parquet has it as string",
        "run-03: channel speed must be of numbers",
        "run-04: run-04.parquet must have distinct columns; speed stands there twice",
        "run-05: channel pitch must be in deg; its metadata says",
        "run-06: run-06.parquet must be a Parquet file",
    ):
        assert words in text


def test_a_run_of_more_samples_than_memory_holds_is_refused_unread(folder: Path) -> None:
    many = pa.table({"speed": pa.chunked_array([pa.nulls(1_000_000, pa.float32())] * 21)})
    pq.write_table(many, folder / "runs" / "run-02.parquet")
    assert "run-02.parquet must have at most 20000000 samples; it has 21000000" in problems_of(folder)


def test_the_library_has_at_least_24_effects() -> None:
    effects = load_effects()
    assert sum(e.effect_class == "effect" for e in effects) >= 24
    assert {e.effect_class for e in effects} == {"effect", "retune", "sensor"}
