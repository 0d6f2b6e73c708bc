"""What a controller sees and may ask, the environment, and a grid that a policy drives into a dataset."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import musync
from catalogs.entries import load
from catalogs.road_users import EGO
from flows.auditing.explain import explain_frame
from flows.driving import policy as policies
from flows.driving.drive import drive_grid
from flows.driving.simulator import Simulator
from flows.driving.view import StepCamera
from flows.store.layout import Layout
from flows.store.sealed import read_manifest
from studies.physics_judge.audit_physics import audit_physics
from tasks.driving.targets import TargetTrack
from tasks.errors import InputError
from tests.toy_street import write_toy_grid

WET = {"weather": "rain", "precipitation_mm_h": 20.0, "initial_speed_km_h": 70.0}
GRID = """
name: braked
pictures: false
vehicle: bmw-320i
vehicle_mode: coupled
frames: 11
frame_rate_hz: 10
duration_s: 2
visual_seeds: 2
scenarios:
  dry: {initial_speed_km_h: 50, hold_speed: true}
  wet:
    {weather: rain, precipitation_mm_h: 50, initial_speed_km_h: 90, hazard_center_m: 20, hazard_length_m: 3.6,
     hazard_height_m: 0.05}
"""
POLICY = """
from time import sleep

def brake(seen):
    if seen.time < 0.4:
        return 0
    return min(3.0, 2.0 * seen.time) if seen.speed > 10 else 0.5

class Once:
    def __init__(self):
        self.asked = 0
    def __call__(self, seen):
        self.asked += 1
        return 0.1 * self.asked

def fail(seen):
    raise ValueError("no target in sight")

def lose(seen):
    return float("nan")

def dawdle(seen):
    sleep(60)

ASKED = []
def wander(seen):
    ASKED.append(1)
    return 0.001 * len(ASKED)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    name = f"policy_{abs(hash(tmp_path))}"
    (tmp_path / f"{name}.py").write_text(POLICY)
    (tmp_path / "grid.yaml").write_text(GRID)
    ahead = "{initial_speed_km_h: 50, objects: [{kind: car, track: {gap_m: 12}}]}"
    (tmp_path / "car.yaml").write_text(GRID.replace("{initial_speed_km_h: 50, hold_speed: true}", ahead))
    monkeypatch.chdir(tmp_path)
    return name


def test_a_drive_begins_anew_the_same_and_sees_what_is_ahead():
    lead = TargetTrack(station=30.0, speed=15.0, change_at=0.5, acceleration=-5.0)
    simulator = Simulator(WET, targets=[lead], truth=True, duration_s=1.0)
    drives = []
    for _ in range(2):
        seen = [simulator.reset()]
        while not seen[-1].ends:
            seen.append(simulator.step(2.0 if seen[-1].time >= 0.2 else 0.0))
        drives.append(seen)
    assert drives[0] == drives[1] and len(drives[0]) == 21
    first, last = drives[0][0], drives[0][-1]
    assert (first.speed, first.station, first.stands) == (pytest.approx(70 / 3.6), 0.0, False)
    assert last.speed < first.speed and last.acceleration < -3.0 and last.wheel_speed_f > 0
    assert (last.targets[0].station, last.targets[0].speed) == pytest.approx((30 + 15 - 0.5 * 5 * 0.25, 12.5))
    assert last.truth["brake_pressure_mpa"] == 2.0 and 0.5 < last.truth["surface_friction"] < 0.7
    assert simulator.describe().columns["speed"][-1] == last.speed
    assert musync.Simulator is Simulator


def test_pictures_are_those_of_the_drive_and_the_same_again(tmp_path):
    write_toy_grid(tmp_path, frames=3)
    car = {"kind": "car", "track": {"gap_m": 12.0}}
    given = {"scene": str(tmp_path / "scene"), "initial_speed_km_h": 40.0, "objects": [car]}
    drives = []
    for _ in range(2):
        simulator = Simulator(given, duration_s=0.2, rate_hz=10, camera=str(tmp_path / "camera.yaml"))
        drives.append([simulator.reset(), *(simulator.step(0.0) for _ in range(2))])
    first, again = ([seen.frame for seen in drive] for drive in drives)
    assert first[0].shape == (64, 96, 3) and first[0].dtype == np.uint8
    assert all((a == b).all() for a, b in zip(first, again, strict=True))
    assert np.abs(first[2].astype(int) - first[0]).mean() > 1.0


def test_a_policy_with_a_camera_reads_pictures_and_only_those_that_it_reads_are_drawn(tmp_path, monkeypatch):
    write_toy_grid(tmp_path, frames=3)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    look = "    def __call__(self, seen):\n        return 2.0 if seen.time == 0.1 and seen.frame.std() > 1 else 0.0\n"
    Path("looking.py").write_text(
        f"class Looks:\n    camera = 'camera.yaml'\n{look}class Odd:\n    camera = 3\n"
    )
    looks, drawn, see = policies.load_policy("looking:Looks"), [], StepCamera.see
    monkeypatch.setattr(StepCamera, "see", lambda *given: drawn.append(given[1]) or see(*given))
    given = {"scene": str(tmp_path / "scene"), "initial_speed_km_h": 40.0}
    simulator = Simulator(given, duration_s=0.3, rate_hz=10, camera=looks.camera)
    assert policies.drive_with(looks, simulator, "here") == [0.0, 2.0, 0.0] and drawn == [1]
    late = simulator.reset()
    simulator.step(0.0)
    assert (late.frame == simulator.reset().frame).all()
    with pytest.raises(InputError, match="camera must be the name or file of a camera; it is 3"):
        policies.load_policy("looking:Odd")


def test_another_road_is_felt_from_the_start_on():
    simulator = Simulator(WET | {"objects": [{"kind": "car", "track": {"gap_m": 20.0}}]}, duration_s=1.0)
    speeds = []
    for friction in (simulator.state.friction, 0.2):
        simulator.take_road(replace(simulator.state, friction=friction))
        simulator.reset()
        speeds.append([simulator.step(9.0) for _ in range(20)][-1].speed)
    assert 70 / 3.6 - speeds[1] == pytest.approx(0.2 * 9.80665, rel=0.25) and speeds[0] < speeds[1] - 2


def test_a_road_user_comes_out_of_the_fog_at_the_visual_range():
    objects = [{"kind": "car", "track": {"gap_m": 25.0}}]
    fog = {"weather": "fog", "visual_range_m": 15.0, "initial_speed_km_h": 36.0, "objects": objects}
    simulator = Simulator(fog, duration_s=1.5, rate_hz=20)
    (clear,) = Simulator(fog | {"visual_range_m": 100.0}, duration_s=1.0).reset().targets
    assert simulator.reset().targets == ()
    seen = [simulator.step(0.0) for _ in range(30)]
    bumper = load("road user sizes")[EGO][0]
    gaps = np.array([clear.station - one.station - bumper for one in seen])
    assert [bool(one.targets) for one in seen] == (gaps <= 15.0).tolist()
    assert 0 < (gaps <= 15.0).sum() < 30


def test_the_objects_of_a_scenario_are_seen_by_the_end_that_the_car_meets():
    objects = [
        {"kind": "car", "track": {"gap_m": 20.0, "speed_km_h": 36.0, "change_at_s": 0.5, "acceleration_m_s2": -20.0}},
        {"kind": "adult", "track": {"station_m": 30.0, "lateral_m": -3.0, "heading_deg": 90.0, "speed_km_h": 5.4}},
    ]  # fmt: skip
    simulator = Simulator(WET | {"objects": objects}, duration_s=1.0, rate_hz=20)
    lead, walker = simulator.reset().targets
    assert (lead.station, lead.speed, lead.lateral) == pytest.approx((20.0, 10.0, 0.0))
    assert (walker.station, walker.lateral, walker.lateral_speed) == pytest.approx((30.0, -3.0, 1.5), abs=0.4)
    for _ in range(20):
        seen = simulator.step(0.0)
    slows = 9.80665 * simulator.state.friction
    assert seen.targets[0].speed == pytest.approx(10.0 - 0.5 * slows, abs=0.01)


@pytest.mark.parametrize(
    ("scenario", "sentence"),
    [
        (WET | {"objects": [{"kind": "tram", "track": {"gap_m": 20.0}}]}, "scenario: objects"),
        (WET | {"objects": [{"kind": "car", "track": {"world_m": [9.0, 0.0]}}]}, "one is given by world_m"),
        (WET | {"peak_pressure_mpa": 3.0}, "peak_pressure_mpa is the controller's"),
        (WET | {"colour": "red"}, "there is no field 'colour'"),
        (WET | {"precipitation_mm_h": -1.0}, "precipitation_mm_h must not be negative"),
    ],
)
def test_a_scenario_that_brakes_by_itself_or_is_none_is_refused(scenario, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Simulator(scenario)


def test_the_environment_keeps_gymnasiums_rules():
    pytest.importorskip("gymnasium", reason="Gymnasium is not installed: pip install gymnasium")
    from gymnasium.utils.env_checker import check_env

    from flows.driving.environment import BrakingEnvironment

    world = BrakingEnvironment(Simulator(WET, targets=[TargetTrack(station=25.0)]))
    check_env(world, skip_render_check=True)
    world.reset()
    for _ in range(100):
        seen, reward, terminated, _, _ = world.step(np.zeros(1))
        if terminated:
            break
    assert (
        terminated and reward == pytest.approx(-70 / 3.6, abs=0.6) and np.isinf(seen["targets"][1:, 0]).all()
    )


@pytest.mark.parametrize("name", ["brake", "Once"])
def test_a_grid_that_a_policy_drives_is_an_ordinary_dataset_with_the_policys_hash(folder, name):
    result = drive_grid("grid.yaml", f"{folder}:{name}", "data", runner="threads", workers=1)
    manifest = read_manifest(Layout(Path("data")))
    assert result["clips"] == 4 and "driven/policy.py" in manifest["inputs"]
    record = json.loads(Path("data/inputs/driven/policy.json").read_text())
    assert record["source_sha256"] == result["source_sha256"] and record["policy"] == f"{folder}:{name}"
    assert Path("data/inputs/driven/policy.py").read_text() == POLICY
    audited = audit_physics("data", out="audit")
    assert audited["verified"], [(row["label"], row["broken"]) for row in audited["clips"]]
    ticks = musync.open("data").pandas("ticks", clip="dry/seed-2025")
    assert ticks["brake_pressure_mpa"].max() > 0.9 and ticks["speed"].iloc[-1] < 12
    again = drive_grid("grid.yaml", f"{folder}:{name}", "data", runner="threads", workers=1)
    assert (again["made"], again["run_id"]) == (0, result["run_id"])
    with pytest.raises(InputError, match="a policy braked its clips"):
        explain_frame("data", "dry/seed-2025", 3)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("fail", "clip dry: at 0 s: raised ValueError: no target in sight"),
        ("lose", "clip dry: at 0 s: brake pressure must be a number within 0 to 50 MPa; it is nan"),
        ("dawdle", "clip dry: at 0 s: took longer than 0.2 s for one step"),
        ("wander", "must ask for the same pressures in the same drive"),
        ("nobody", "has no function or class nobody"),
    ],
)
def test_a_policy_that_fails_gets_one_sentence_and_nothing_is_written(folder, monkeypatch, name, sentence):
    monkeypatch.setattr(policies, "LONGEST_CALL_S", 0.2)
    with pytest.raises(InputError, match=re.escape(sentence)) as told:
        drive_grid("grid.yaml", f"{folder}:{name}", "data", runner="threads", workers=1)
    assert len(told.value.problems) == 1 and not Path("data").exists()


def test_a_policy_sees_the_road_users_of_a_grid_and_the_result_says_what_became_of_them(folder):
    result = drive_grid("car.yaml", f"{folder}:Once", "data", pictures=False, runner="threads", workers=1)
    (outcome,) = result["outcomes"]
    assert (outcome["scenario"], outcome["number"], outcome["kind"]) == ("dry", 1, "car")
    assert outcome["collided"] and 40 < outcome["impact_speed_km_h"] < 50
    assert outcome["avoided_km_h"] == pytest.approx(50 - outcome["impact_speed_km_h"], abs=0.02)


def test_a_grid_that_brakes_by_itself_is_refused(folder, tmp_path):
    (tmp_path / "paper.yaml").write_text(
        GRID.replace("coupled", "paper").replace(
            "speed_km_h: 50", "speed_km_h: 50, peak_pressure_mpa: 2, brake_onset_s: 1"
        )
    )
    with pytest.raises(InputError) as told:
        drive_grid("paper.yaml", f"{folder}:brake", "data")
    assert "vehicle_mode must be coupled" in str(told.value) and "brake_onset_s is the policy's" in str(
        told.value
    )
