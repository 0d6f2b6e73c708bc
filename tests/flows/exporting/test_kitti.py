"""pykitti, where it is installed, reads the sequences and the drives; times, poses, packets and signs are ours."""

import numpy as np
import pytest

from flows.making.catalogue import catalogue_of
from tests.flows.exporting.conftest import BRAKING, HUMP


@pytest.fixture
def pykitti():
    return pytest.importorskip("pykitti", reason="pip install pykitti")


def test_times_poses_and_pitch_stand_in_the_files_themselves(export, stored, toy_dataset):
    clip, mount = stored[BRAKING], catalogue_of(toy_dataset.root).camera.T_rig_camera
    sequences = export("kitti") / "odometry"
    np.testing.assert_allclose(
        np.loadtxt(sequences / "sequences" / "00" / "times.txt"), clip.frames["t_ns"] / 1e9, atol=1e-6
    )
    camera = clip.T_world_rig @ mount
    poses = np.loadtxt(sequences / "poses" / "00.txt").reshape(-1, 3, 4)
    np.testing.assert_allclose(poses, (np.linalg.inv(camera[0]) @ camera)[:, :3], atol=1e-9)
    oxts = export("kitti") / "raw" / "1970_01_01" / "1970_01_01_drive_0000_sync" / "oxts"
    stamps = [np.datetime64(line) for line in (oxts / "timestamps.txt").read_text().splitlines()]
    np.testing.assert_array_equal(np.array(stamps, "M8[ns]").astype(np.int64), clip.frames["t_ns"])
    pitch = [np.loadtxt(path)[4] for path in sorted((oxts / "data").iterdir())]
    np.testing.assert_allclose(pitch, clip.frames["pitch"], atol=1e-12)


@pytest.mark.parametrize(("number", "label"), [(0, BRAKING), (1, HUMP)])
def test_a_sequence_has_pictures_times_calibration_and_camera_poses(
    pykitti, export, stored, toy_dataset, number, label
):
    clip, camera = stored[label], catalogue_of(toy_dataset.root).camera
    read = pykitti.odometry(str(export("kitti") / "odometry"), f"{number:02d}")
    assert [time.total_seconds() for time in read.timestamps] == pytest.approx(
        clip.frames["t_ns"] / 1e9, abs=1e-6
    )
    for frame in range(11):
        np.testing.assert_array_equal(np.asarray(read.get_cam2(frame)), clip.pixels["rgb"][frame])
    assert read.calib.K_cam2[0, 2] == 47.5
    np.testing.assert_allclose(np.linalg.inv(read.calib.T_cam0_velo), camera.T_rig_camera, atol=1e-12)
    # KITTI's poses, taken back to the rig, are ours from the first frame
    rig = camera.T_rig_camera @ np.stack(read.poses) @ np.linalg.inv(camera.T_rig_camera)
    np.testing.assert_allclose(clip.T_world_rig[0] @ rig, clip.T_world_rig, atol=1e-9)


@pytest.mark.parametrize(("number", "label"), [(0, BRAKING), (1, HUMP)])
def test_a_drive_has_oxts_packets_in_si_with_pitch_nose_down(
    pykitti, export, stored, toy_dataset, number, label
):
    clip = stored[label]
    read = pykitti.raw(str(export("kitti") / "raw"), "1970_01_01", f"{number:04d}")
    assert [(t.second * 10**6 + t.microsecond) for t in read.timestamps] == (
        clip.frames["t_ns"] // 1000
    ).tolist()
    poses = np.stack([packet.T_w_imu for packet in read.oxts])
    ours = clip.T_world_rig.copy()
    ours[:, :3, 3] -= ours[0, :3, 3]
    np.testing.assert_allclose(poses, ours, atol=1e-8)
    packets = [packet.packet for packet in read.oxts]
    # the rig lies below the centre of gravity and in front of it: pitching moves it back and down
    car, pitch, rate = catalogue_of(toy_dataset.root).vehicle, clip.frames["pitch"], clip.frames["pitch_rate"]
    back = rate * (car.cg_to_front_axle * np.sin(pitch) + car.cg_height * np.cos(pitch))
    for names in (("vf", "vl"), ("ve", "vn")):  # the street runs east
        forward, across = ([getattr(p, name) for p in packets] for name in names)
        np.testing.assert_allclose(forward, clip.frames["speed"] - back, atol=1e-9)
        np.testing.assert_allclose(across, 0, atol=1e-9)
    np.testing.assert_allclose([packet.wl for packet in packets], rate, atol=1e-12)
    np.testing.assert_allclose([packet.pitch for packet in packets], clip.frames["pitch"], atol=1e-12)
    # what the accelerometer feels turns with the body, and has one length
    felt = np.array([(p.ax, p.az) for p in packets])
    np.testing.assert_allclose(np.hypot(*felt.T), [np.hypot(p.af, p.au) for p in packets])
    # the height of the rig follows its vertical speed, between two frames by the trapezium rule
    up = np.array([p.vu for p in packets])
    risen = np.cumsum((up[1:] + up[:-1]) / 2 * 0.1)
    assert np.abs(risen - (ours[1:, 2, 3] - ours[0, 2, 3])).max() < 0.2 * np.abs(ours[:, 2, 3]).max() + 1e-4


def test_a_braking_car_dips_its_nose_and_slows(pykitti, export):
    packet = pykitti.raw(str(export("kitti") / "raw"), "1970_01_01", "0000").oxts[-1].packet
    assert packet.pitch > 0.001
    assert packet.af < -1
    assert (
        packet.ax < packet.af
    )  # gravity pulls the nose-down body forward, which an accelerometer reads as backward
