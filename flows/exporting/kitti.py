"""KITTI: odometry sequences, and drives of the raw data with OXTS packets.

``odometry/sequences/00`` has the pictures as ``image_2``, ``times.txt`` [s] and ``calib.txt``;
``odometry/poses/00.txt`` the camera's poses in its first frame (x right, y down, z forward, as ours).
``raw/1970_01_01`` has a drive a clip with one OXTS packet a frame and no pictures. A dataset with road users has
``object/training`` too: ``image_2``, ``calib`` and ``label_2``, a line a road user that the frame shows, numbered over
all clips. The velodyne's and the IMU's frame are our rig (x forward, y left, z up, below the middle of the front axle):
``Tr`` takes the rig to the camera. Pixel centres are whole numbers, as KITTI's.

Of OXTS, roll, pitch and yaw turn the rig into the world by Rz Ry Rx: pitch is positive nose-down, as ours. The world's
x is east, its y north; its origin lies at latitude and longitude zero. Velocities and accelerations are those of the
rig's origin: ``vn`` and ``ve`` in the world, ``vf``, ``vl`` and ``vu`` along the level heading. Accelerations are an
accelerometer's, which feels 9.80665 m/s^2 up at rest: ``af``, ``al`` and ``au`` along the level heading, ``ax``, ``ay``
and ``az`` in the axes of the pitched body. So are the turn rates ``wf`` to ``wu`` and ``wx`` to ``wz``. Accuracies,
satellites and modes are 0. Time 0 is 1970-01-01.

Formats: http://www.cvlibs.net/datasets/kitti, devkit_odometry/readme.txt and devkit_raw_data/readme.txt
"""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.exporting.dataset import ExportedClip, ExportedDataset, require_one_camera, require_pinhole
from flows.exporting.inertial import compute_inertial_motion
from flows.exporting.road_users import describe_kitti_label, list_objects_by_frame
from tasks.render.camera import PIXEL_CENTRE, Camera
from tasks.render.contact_sheet import encode_png
from tasks.vehicle.parameters import Vehicle

DATE = "1970_01_01"
EARTH_RADIUS = 6378137.0
"""Of KITTI's Mercator projection [m]."""


def write_kitti(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``odometry/`` and ``raw/``, a sequence and a drive a clip, numbered in the order of the export.

    Parameters
    ----------
    dataset : with frames of a pinhole
    folder : empty

    Raises
    ------
    InputError
        If the camera's lens distorts, or each clip has a camera of its own.
    """
    require_pinhole(dataset, "kitti")
    require_one_camera(dataset, "kitti")
    raw = folder / "raw" / DATE
    poses = folder / "odometry" / "poses"
    for subfolder in (raw, poses):
        subfolder.mkdir(parents=True)
    for name, content in _describe_raw_calibration(dataset.camera).items():
        (raw / name).write_text(content)
    shown = 0
    for number, clip in enumerate(dataset):
        sequence = folder / "odometry" / "sequences" / f"{number:02d}"
        (sequence / "image_2").mkdir(parents=True)
        for frame, picture in enumerate(clip.read_array("rgb")):
            (sequence / "image_2" / f"{frame:06d}.png").write_bytes(encode_png(picture))
        (sequence / "calib.txt").write_text(_describe_calibration(dataset.camera))
        (sequence / "times.txt").write_text("".join(f"{t / 1e9:.6e}\n" for t in clip.frames["t_ns"]))
        seen = np.linalg.inv(clip.T_world_camera[0]) @ clip.T_world_camera
        (poses / f"{number:02d}.txt").write_text("".join(f"{_format(pose[:3])}\n" for pose in seen))
        if dataset.plan.settings.has_objects:
            _write_labels(clip, folder / "object" / "training", shown)
            shown += len(clip.T_world_rig)
        _write_oxts(clip, dataset.vehicle, raw / f"{DATE}_drive_{number:04d}_sync" / "oxts")


def compute_oxts(clip: ExportedClip, vehicle: Vehicle) -> NDArray[np.float64]:
    """Return the first 25 fields of the OXTS packets at the frames, float64 [F, 25], in KITTI's order and units.

    Parameters
    ----------
    clip : that was driven
    vehicle : that drove it
    """
    motion = compute_inertial_motion(clip, vehicle)
    east, north, up = clip.T_world_rig[:, :3, 3].T
    yaw, pitch, roll = motion.attitude.as_euler("ZYX").T
    level, body, still = motion.level.inv(), motion.attitude.inv(), np.zeros(len(up))
    fields = (
        np.degrees(2 * np.arctan(np.exp(north / EARTH_RADIUS))) - 90.0, np.degrees(east / EARTH_RADIUS), up,
        roll, pitch, yaw,
        motion.velocity[:, 1], motion.velocity[:, 0], *level.apply(motion.velocity).T,
        *body.apply(motion.force).T, *level.apply(motion.force).T,
        *body.apply(motion.turn_rate).T, *level.apply(motion.turn_rate).T,
        still, still,
    )  # fmt: skip
    return np.stack(fields, axis=1)


def _write_oxts(clip: ExportedClip, vehicle: Vehicle, folder: Path) -> None:
    (folder / "data").mkdir(parents=True)
    for frame, packet in enumerate(compute_oxts(clip, vehicle)):
        (folder / "data" / f"{frame:010d}.txt").write_text(f"{_format(packet)} 0 0 0 0 0\n")
    times = "".join(f"{_format_time(int(t))}\n" for t in clip.frames["t_ns"])
    (folder / "timestamps.txt").write_text(times)


def _write_labels(clip: ExportedClip, folder: Path, first: int) -> None:
    """Write pictures, calibration and labels of a clip's frames, which are numbered from ``first`` on."""
    for name in ("image_2", "calib", "label_2"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    calibration = _describe_calibration(clip.camera).replace("Tr:", "Tr_velo_to_cam:")
    calibration += f"R0_rect: {_format(np.eye(3))}\nTr_imu_to_velo: {_format(np.eye(4)[:3])}\n"
    pictures, poses = clip.read_array("rgb"), clip.T_world_camera
    for frame, rows in enumerate(list_objects_by_frame(clip)):
        name = f"{first + frame:06d}"
        (folder / "image_2" / f"{name}.png").write_bytes(encode_png(pictures[frame]))
        (folder / "calib" / f"{name}.txt").write_text(calibration)
        lines = [describe_kitti_label(row, poses[frame]) for row in rows if row["visible_pixels"]]
        (folder / "label_2" / f"{name}.txt").write_text("".join(lines))


def _describe_calibration(camera: Camera) -> str:
    rows = {f"P{k}": _projection(camera) for k in range(4)} | {"Tr": np.linalg.inv(camera.T_rig_camera)[:3]}
    return "".join(f"{name}: {_format(values)}\n" for name, values in rows.items())


def _describe_raw_calibration(camera: Camera) -> dict[str, str]:
    T_camera_rig = np.linalg.inv(camera.T_rig_camera)
    size = np.array([camera.width, camera.height], np.float64)
    cameras: dict[str, NDArray[Any]] = {}
    for k in range(4):
        cameras |= {
            f"S_0{k}": size, f"K_0{k}": camera.K - PIXEL_CENTRE, f"D_0{k}": np.zeros(5),
            f"R_0{k}": np.eye(3), f"T_0{k}": np.zeros(3),
            f"S_rect_0{k}": size, f"R_rect_0{k}": np.eye(3), f"P_rect_0{k}": _projection(camera),
        }  # fmt: skip
    files = {
        "calib_cam_to_cam.txt": cameras,
        "calib_velo_to_cam.txt": {"R": T_camera_rig[:3, :3], "T": T_camera_rig[:3, 3]},
        "calib_imu_to_velo.txt": {"R": np.eye(3), "T": np.zeros(3)},
    }
    head = "calib_time: 01-Jan-1970 00:00:00\n"
    return {
        name: head + "".join(f"{key}: {_format(values)}\n" for key, values in rows.items())
        for name, rows in files.items()
    }


def _projection(camera: Camera) -> NDArray[np.float64]:
    return np.column_stack((camera.K - PIXEL_CENTRE, np.zeros(3)))


def _format(values: NDArray[Any]) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def _format_time(t_ns: int) -> str:
    second = datetime.fromtimestamp(t_ns // 10**9, UTC)
    return f"{second:%Y-%m-%d %H:%M:%S}.{t_ns % 10**9:09d}"
