"""One per cent put into any column of a dataset's telemetry is caught, and the verdict names the column."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flows.making.generate import generate_dataset
from flows.making.plan import read_plan
from flows.store.layout import Layout
from studies.physics_judge.audit_physics import audit_physics, clip_columns, clip_facts, find_route
from studies.physics_judge.frozen_constants import read_constants
from studies.physics_judge.laws.audit import audit_clip
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.vehicle.paper.low_speed import BrakedStop, compute_brake_pitch_input
from tests.toy_street import write_toy_grid

Fault = Callable[[np.ndarray, int, float], None]
"""Changes the brake's pitch input, given the sample of the stop and the step [s]."""

GRID = """
name: laws
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 16
frame_rate_hz: 5
axes:
  weather:
    dry: {{weather: dry}}
    rain-50: {{weather: rain, precipitation_mm_h: 50}}
    snow-1: {{weather: snow, precipitation_mm_h: 1, snow_accumulation_h: 1}}
  drive:
    stop: {{initial_speed_km_h: 25, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
    hump: {{initial_speed_km_h: 30, peak_pressure_mpa: 2.3, brake_onset_m: 6.0,
            hazard_center_m: 8.0, hazard_length_m: 3.7, hazard_height_m: 0.075}}
"""
JUMPS = """
name: jumps
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 8
frame_rate_hz: 5
base: {{initial_speed_km_h: 25, peak_pressure_mpa: 2.3, ramp_s: 0, release_s: 0, hold_s: 0.3}}
scenarios:
  early: {{brake_onset_s: 0.2}}
  late: {{brake_onset_s: 0.7}}
"""
STOP = """
name: stop
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 16
frame_rate_hz: 5
low_speed: {low_speed}
base: {{initial_speed_km_h: 25, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
scenarios:
  stop: {{weather: dry}}
"""
HELD = """
name: held
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 16
frame_rate_hz: 5
vehicle_mode: coupled
vehicle: {car}
base: {{initial_speed_km_h: 25, peak_pressure_mpa: 2.3, brake_onset_s: 0.4, hold_speed: true}}
scenarios:
  stop: {{weather: dry}}
"""
TRIALS = 60


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Telemetry alone: what the pose check adds to the tables is in the toy dataset."""
    folder = tmp_path_factory.mktemp("laws")
    generate_dataset(
        write_toy_grid(folder, GRID), str(folder / "made"), runner="threads", workers=1, pictures=False
    )
    return folder / "made"


def test_sound_telemetry_keeps_every_law(dataset: Path, tmp_path: Path) -> None:
    result = audit_physics(str(dataset), out=str(tmp_path))
    assert result["verified"], [(row["label"], row["broken"]) for row in result["clips"]]
    assert result["laws_checked"] > 80 * result["clips_checked"]
    assert (tmp_path / "physics.json").is_file()


def test_a_brake_that_jumps_keeps_every_law_and_one_that_acts_a_tick_late_does_not(tmp_path: Path) -> None:
    grid = write_toy_grid(tmp_path, JUMPS)
    made = tmp_path / "made"
    generate_dataset(grid, str(made), runner="threads", workers=1, pictures=False)
    result = audit_physics(str(made), out=str(tmp_path))
    assert result["verified"], [(row["label"], row["broken"]) for row in result["clips"]]
    facts = clip_facts(made)[0]
    ticks, frames = (clip_columns(made, table, facts) for table in ("ticks", "frames"))
    late = {**ticks, "brake_pressure_mpa": np.roll(ticks["brake_pressure_mpa"], 1)}
    verdict = audit_clip(late, frames, facts, read_constants(made))
    assert "brake pressure as commanded" in [law.name for law in verdict.laws if law.broken]


def keep_nose_down(d: np.ndarray, stop: int, step: float) -> None:
    d[stop:] = d[stop - 1]


def rock(d: np.ndarray, stop: int, step: float) -> None:
    d[stop:] = 4 * np.sin(2 * np.pi * step * np.arange(len(d) - stop))


def hold_half_more(d: np.ndarray, stop: int, step: float) -> None:
    d[stop - round(0.2 / step) : stop] *= 1.5


def release_at_once(d: np.ndarray, stop: int, step: float) -> None:
    d[stop:] = 0


@pytest.mark.parametrize("low_speed", ["steady", "literal"])
@pytest.mark.parametrize("fault", [keep_nose_down, rock, hold_half_more, release_at_once])
def test_a_body_that_the_brake_pitches_wrongly_in_the_hold_or_after_it_breaks_its_pitch_equation_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Fault, low_speed: str
) -> None:
    def pitch_wrongly(acceleration: np.ndarray, step: float, braked: BrakedStop, **rule: float) -> np.ndarray:
        d = compute_brake_pitch_input(acceleration, step, braked, **rule)
        assert braked.sample > 0
        fault(d, braked.sample, step)
        return d

    monkeypatch.setattr("tasks.vehicle.paper.paper_mode.compute_brake_pitch_input", pitch_wrongly)
    grid = write_toy_grid(tmp_path, STOP.replace("{low_speed}", low_speed))
    generate_dataset(grid, str(tmp_path / "made"), runner="threads", workers=1, pictures=False)
    (clip,) = audit_physics(str(tmp_path / "made"), out=str(tmp_path))["clips"]
    assert [law["law"] for law in clip["broken"]] == ["body's pitch equation"]
    assert clip["broken"][0]["excess"] > 10


def test_a_dataset_with_pictures_keeps_the_laws_of_its_pose_check_too(
    dataset: Path, toy_dataset: Layout, tmp_path: Path
) -> None:
    result = audit_physics(str(toy_dataset.root), out=str(tmp_path))
    assert result["verified"], [(row["label"], row["broken"]) for row in result["clips"]]
    bare = {row["label"]: row["laws"] for row in audit_physics(str(dataset), out=str(tmp_path))["clips"]}
    assert {row["label"]: row["laws"] for row in result["clips"]}["dry/hump"] > bare["dry/hump"]


def test_one_per_cent_in_any_column_is_caught_and_the_column_named(
    dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    constants = read_constants(dataset)
    clips = [
        (clip_columns(dataset, "ticks", facts), clip_columns(dataset, "frames", facts), facts)
        for facts in clip_facts(dataset)
    ]
    draw = np.random.Generator(np.random.Philox(20260725))
    caught = named = suspected = 0
    done = 0
    while done < TRIALS:
        ticks, frames, facts = clips[draw.integers(len(clips))]
        put = _put_fault(draw, ticks, frames)
        if put is None:
            continue
        column, *tables = put
        verdict = audit_clip(*tables, facts, constants)
        done += 1
        caught += not verdict.passed
        named += verdict.column == column
        suspected += column in (verdict.column, *verdict.also)
    with capsys.disabled():
        print(f"\n1 % faults: {caught}/{TRIALS} caught, {named} named first, {suspected} among the suspects")
    assert caught >= 0.99 * TRIALS
    assert named >= 0.93 * TRIALS
    assert suspected >= 0.97 * TRIALS


def _put_fault(
    draw: np.random.Generator, ticks: dict[str, np.ndarray], frames: dict[str, np.ndarray]
) -> tuple[Any, ...] | None:
    """A share of a column's value or range, over all of it or a stretch, as its maker or one table's writer would."""
    names = [c.name for c in TICK_CHANNELS if ticks[c.name].dtype != np.bool_]
    name = names[draw.integers(len(names))]
    whose = ("maker", "ticks", "frames")[draw.integers(3)]
    values = ticks[name].astype(float)
    count = len(values)
    begin = draw.integers(count - 300) if draw.random() < 0.5 else 0
    end = begin + draw.integers(200, 1000) if begin else count
    share = draw.choice([-0.01, 0.01])
    change = np.zeros(count)
    change[begin:end] = share * (values[begin:end] if draw.random() < 0.5 else np.ptp(values))
    shown = change if whose != "frames" else change[frames["tick"]]
    if np.abs(shown).max() <= 1e-12 * np.abs(values).max():
        return None  # one per cent of nothing is no fault
    faulty = {**ticks, name: values + change} if whose != "frames" else ticks
    rows = {**frames, name: frames[name] + change[frames["tick"]]} if whose != "ticks" else frames
    return f"{'frames' if whose == 'frames' else 'ticks'}.{name}", faulty, rows


@pytest.mark.parametrize(
    "name", ["film_depth_mm", "surface_friction", "tyre_peak", "stopping_distance", "peak_pitch", "static_pitch",
             "initial_speed_km_h", "peak_pressure_mpa", "hazard_height_m"],
)  # fmt: skip
def test_one_per_cent_in_a_clips_row_is_caught(dataset: Path, name: str) -> None:
    label = "dry/stop" if name == "stopping_distance" else "rain-50/hump"
    assert is_named_where_one_per_cent_off(dataset, label, name)


def test_one_per_cent_in_what_the_pose_check_found_is_caught(toy_dataset: Layout) -> None:
    assert is_named_where_one_per_cent_off(toy_dataset.root, "snow-3/hump", "check_pitch_rmse_deg")


def is_named_where_one_per_cent_off(dataset: Path, label: str, name: str) -> bool:
    facts = next(f for f in clip_facts(dataset) if f["label"] == label)
    tables = clip_columns(dataset, "ticks", facts), clip_columns(dataset, "frames", facts)
    verdict = audit_clip(*tables, {**facts, name: facts[name] * 1.01}, read_constants(dataset))
    return f"clips.{name}" in (verdict.column, *verdict.also)


def test_a_pose_that_does_not_follow_the_station_is_named(dataset: Path) -> None:
    facts = clip_facts(dataset)[0]
    ticks, frames = clip_columns(dataset, "ticks", facts), clip_columns(dataset, "frames", facts)
    poses = frames["T_world_rig"].copy()
    poses[:, 3] *= 1.01
    verdict = audit_clip(ticks, {**frames, "T_world_rig": poses}, facts, read_constants(dataset))
    assert verdict.column == "frames.T_world_rig"


def test_a_table_without_a_column_is_refused(dataset: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(dataset, copy, ignore=shutil.ignore_patterns("frames.zarr"))
    for path in (copy / "telemetry" / "ticks").rglob("*.parquet"):
        table: pa.Table = pq.read_table(path, partitioning=None)
        pq.write_table(table.drop_columns(["speed"]), path)
    with pytest.raises(InputError, match="lacks speed"):
        audit_physics(str(copy))


def test_a_grown_car_on_another_tyre_that_holds_its_speed_is_judged_with_its_poses(tmp_path: Path) -> None:
    car = tmp_path / "car.yaml"
    car.write_text("extends: multibody-grown\ntyre: pacejka-205-60r15\n")
    grid = write_toy_grid(tmp_path, HELD, car=car)
    generate_dataset(grid, str(tmp_path / "made"), runner="threads", workers=1, pictures=False)
    result = audit_physics(str(tmp_path / "made"), out=str(tmp_path))
    assert result["verified"], [(row["label"], row["broken"]) for row in result["clips"]]
    assert result["poses_checked"]
    facts = clip_facts(tmp_path / "made")[0]
    ticks, frames = (clip_columns(tmp_path / "made", table, facts) for table in ("ticks", "frames"))
    high = frames["T_world_rig"] + 0.05 * (np.arange(16) == 11)
    route = find_route(read_plan(tmp_path / "made").scene)
    verdict = audit_clip(
        ticks, {**frames, "T_world_rig": high}, facts, read_constants(tmp_path / "made"), route
    )
    assert [(law.name, round(law.size, 3)) for law in verdict.broken] == [
        ("rig stands where route, heave and pitch put it", 0.05)
    ]


def test_a_clip_without_a_judged_frame_has_no_figures_of_the_check_and_keeps_its_laws(
    toy_dataset: Layout,
) -> None:
    facts = next(row for row in clip_facts(toy_dataset.root) if row["label"] == "snow-3/hump")
    ticks, frames = (clip_columns(toy_dataset.root, table, facts) for table in ("ticks", "frames"))
    lost = np.arange(len(frames["frame"])) > 0
    frames |= {
        name: np.where(lost, np.nan, frames[name]) for name in ("recovered_pitch", "recovered_progress")
    }
    blind = {name: np.nan for name in facts if name.startswith("check_") and isinstance(facts[name], float)}
    counts = {"check_failed_frames": int(lost.sum()), "check_judged_frames": 0}
    constants = read_constants(toy_dataset.root)
    assert audit_clip(ticks, frames, {**facts, **blind, **counts}, constants).passed
    wrong = audit_clip(ticks, frames, {**facts, **blind, **counts, "check_judged_frames": 1}, constants)
    assert [law.name for law in wrong.broken] == ["check_judged_frames worked out again"]


@pytest.mark.parametrize("angle_deg", [-3, 3])
def test_a_rig_that_is_turned_off_its_way_all_along_breaks_a_law(dataset: Path, angle_deg: float) -> None:
    facts = clip_facts(dataset)[0]
    ticks, frames = (clip_columns(dataset, table, facts) for table in ("ticks", "frames"))
    turned = np.eye(4)
    cos, sin = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    turned[:2, :2] = [[cos, -sin], [sin, cos]]
    T = (frames["T_world_rig"].reshape(-1, 4, 4) @ turned).reshape(-1, 16)
    verdict = audit_clip(ticks, {**frames, "T_world_rig": T}, facts, read_constants(dataset))
    assert "rig less heave and pitch goes along its heading" in [law.name for law in verdict.broken]
