"""The tables join as nuScenes' do; the devkit, where it is installed, opens them and the CAN bus."""

import json
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flows.exporting.dataset import TICK_COLUMNS
from flows.exporting.nuscenes import describe_can_bus
from flows.making.catalogue import catalogue_of
from tests.flows.exporting.conftest import BRAKING, HUMP

PERIOD_US = 2_000_000
"""From the start of a scene to that of the next: the second that the clip lasts, and a second of pause."""
SCENES = {BRAKING: "scene-2000", HUMP: "scene-2001"}


@pytest.fixture(scope="module")
def tables(export):
    folder = export("nuscenes")
    return {path.stem: json.loads(path.read_text()) for path in (folder / "v1.0-musync").glob("*.json")}


def to_matrix(row):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(row["rotation"], scalar_first=True).as_matrix()
    pose[:3, 3] = row["translation"]
    return pose


def test_a_scene_chains_its_samples_to_pictures_and_poses(export, stored, tables, toy_dataset):
    catalogue = catalogue_of(toy_dataset.root)
    by_token = {row["token"]: row for rows in tables.values() for row in rows}
    assert len(by_token) == sum(map(len, tables.values()))
    data_of = {row["sample_token"]: row for row in tables["sample_data"]}
    for number, scene in enumerate(tables["scene"]):
        clip = stored[scene["description"]]
        token, seen = scene["first_sample_token"], []
        while token:
            seen.append(data_of[token])
            token = by_token[token]["next"]
        assert len(seen) == scene["nbr_samples"] == 11
        for frame, row in enumerate(seen):
            assert row["timestamp"] == clip.frames["t_ns"][frame] // 1000 + number * PERIOD_US
            assert by_token[row["ego_pose_token"]]["timestamp"] == row["timestamp"]
            assert by_token[row["sample_token"]]["timestamp"] == row["timestamp"]
            picture = cv2.imread(str(export("nuscenes") / row["filename"]))[..., ::-1]
            np.testing.assert_array_equal(picture, clip.pixels["rgb"][frame])
            ego = to_matrix(by_token[row["ego_pose_token"]])
            # ego and mount together give our camera's pose
            expected = clip.T_world_rig[frame] @ catalogue.camera.T_rig_camera
            np.testing.assert_allclose(
                ego @ to_matrix(by_token[row["calibrated_sensor_token"]]), expected, atol=1e-12
            )
            # the ego frame lies a wheelbase behind the front axle
            wheelbase = catalogue.vehicle.cg_to_front_axle + catalogue.vehicle.cg_to_rear_axle
            behind = np.linalg.inv(clip.T_world_rig[frame]) @ ego[:, 3]
            np.testing.assert_allclose(behind[:3], [-wheelbase, 0, 0], atol=1e-12)


def test_nuscenes_devkit_opens_tables_and_can_bus(export, stored, toy_dataset):
    nuscenes = pytest.importorskip("nuscenes.nuscenes", reason="pip install nuscenes-devkit")
    from nuscenes.can_bus.can_bus_api import NuScenesCanBus

    folder, catalogue = str(export("nuscenes")), catalogue_of(toy_dataset.root)
    base = nuscenes.NuScenes(version="v1.0-musync", dataroot=folder, verbose=False)
    bus = NuScenesCanBus(dataroot=folder)
    base.list_scenes()  # sorts by time, and fails where two scenes start together
    for number, (record, (label, clip)) in enumerate(zip(base.scene, stored.items(), strict=True)):
        assert (record["name"], record["description"]) == (SCENES[label], label)
        sample = base.get("sample", record["last_sample_token"])
        path, _, K = base.get_sample_data(sample["data"]["CAM_FRONT"])
        np.testing.assert_array_equal(cv2.imread(path)[..., ::-1], clip.pixels["rgb"][-1])
        np.testing.assert_array_equal(K, [[80, 0, 47.5], [0, 80, 31.5], [0, 0, 1]])
        poses = bus.get_messages(record["name"], "pose")
        start_us = number * PERIOD_US
        assert [row["utime"] for row in poses] == (clip.frames["t_ns"] // 1000 + start_us).tolist()
        turns = Rotation.from_quat([row["orientation"] for row in poses], scalar_first=True)
        np.testing.assert_allclose(turns.as_euler("ZYX")[:, 1], clip.frames["pitch"], atol=1e-12)
        # the rear axle, at the height of the road, goes up and back where the nose goes down
        up = turns.apply([row["vel"] for row in poses])[:, 2]
        far = catalogue.vehicle.cg_to_rear_axle * np.cos(clip.frames["pitch"])
        high = catalogue.vehicle.cg_height * np.sin(clip.frames["pitch"])
        rising = clip.frames["heave_rate"] + clip.frames["pitch_rate"] * (far + high)
        np.testing.assert_allclose(up, rising, atol=1e-9)
        monitor = bus.get_messages(record["name"], "vehicle_monitor")
        ticks = clip.ticks.iloc[::500]
        np.testing.assert_allclose([row["vehicle_speed"] for row in monitor], ticks["speed"] * 3.6)
        assert [row["utime"] for row in monitor] == (ticks["t_ns"] // 1000 + start_us).tolist()
        assert [row["brake"] for row in monitor] == (ticks["brake_pressure_mpa"] * 10).round().tolist()
        assert all(type(row["brake"]) is int for row in monitor)
        wheels = bus.get_messages(record["name"], "zoe_veh_info")
        np.testing.assert_allclose(
            [row["RL_wheel_speed"] for row in wheels], clip.ticks["wheel_speed_r"][::10] * 60 / (2 * np.pi)
        )
    last = bus.get_messages("scene-2000", "pose")[-1]
    assert last["accel"][0] < -1 and last["accel"][2] == pytest.approx(9.80665, abs=1)


@pytest.fixture
def driven() -> SimpleNamespace:
    """A clip that stands for half a second, as describe_can_bus takes it."""
    t_ns = np.arange(501) * 1_000_000
    ticks = {name: np.zeros(501) for name in TICK_COLUMNS} | {"t_ns": t_ns}
    frames = {name: column[::100] for name, column in ticks.items()} | {"tick": np.arange(0, 501, 100)}
    return SimpleNamespace(ticks=ticks, frames=frames, T_world_rig=np.tile(np.eye(4), (6, 1, 1)))


def test_the_can_bus_has_its_own_units(driven, toy_dataset):
    for name, value in {"speed": 10.0, "wheel_speed_f": 2 * np.pi, "wheel_speed_r": 4 * np.pi}.items():
        driven.ticks[name][:] = value
    messages = describe_can_bus(driven, catalogue_of(toy_dataset.root).vehicle, start_us=7)
    monitor, wheels = (messages[kind][1] for kind in ("vehicle_monitor", "zoe_veh_info"))
    assert monitor == pytest.approx(
        {
            "rear_left_rpm": 120,
            "rear_right_rpm": 120,
            "vehicle_speed": 36,
            "brake": 0,
            "brake_switch": 1,
            "utime": 500_007,
        }
    )
    turns = {f"{wheel}_wheel_speed": rpm for wheel, rpm in (("FL", 60), ("FR", 60), ("RL", 120), ("RR", 120))}
    assert wheels == pytest.approx(turns | {"longitudinal_accel": 0, "odom_speed": 36, "utime": 10_007})


def test_what_a_reference_trace_does_not_know_is_no_key_of_a_message(driven, toy_dataset):
    vehicle = catalogue_of(toy_dataset.root).vehicle
    for name in ("brake_pressure_mpa", "wheel_speed_f", "wheel_speed_r"):
        driven.ticks[name][:] = np.nan
    messages = describe_can_bus(driven, vehicle, start_us=0)
    json.dumps(messages, allow_nan=False)
    assert messages["vehicle_monitor"][1] == {"vehicle_speed": 0.0, "utime": 500_000}
    assert messages["zoe_veh_info"][1] == {"longitudinal_accel": 0.0, "odom_speed": 0.0, "utime": 10_000}


@pytest.mark.parametrize(("pressure_mpa", "bar"), [(0.0, 0), (2.34, 23), (15.0, 126)])
def test_the_brake_pressure_is_a_whole_number_of_bar_up_to_126(driven, toy_dataset, pressure_mpa, bar):
    driven.ticks["brake_pressure_mpa"][:] = pressure_mpa
    first = describe_can_bus(driven, catalogue_of(toy_dataset.root).vehicle, start_us=0)["vehicle_monitor"][0]
    assert (first["brake"], type(first["brake"])) == (bar, int)
    assert first["brake_switch"] == (2 if pressure_mpa else 1)
