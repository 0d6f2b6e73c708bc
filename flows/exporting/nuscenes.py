"""Tables as nuScenes has them, with CAN bus messages: a scene a clip, a sample a frame.

The version is ``v1.0-musync``; pictures are ``samples/CAM_FRONT/*.png``. The ego frame is nuScenes': x forward, y left,
z up, below the middle of the rear axle, a wheelbase behind our rig; positive pitch about its y axis is nose-down, as
ours. The camera's axes are ours (x right, y down, z forward) and pixel centres whole numbers. Quaternions are wxyz.
Time is in microseconds; scene n of the export starts at n times the length of the telemetry and one second, so that
times rise from scene to scene.

Of the CAN bus, ``pose`` and ``ms_imu`` have a message a frame with the motion of the ego frame's origin in its own axes
(acceleration as an accelerometer feels it, at rest 9.80665 m/s^2 up), ``zoe_veh_info`` 100 a second (wheel speeds
[rpm], speed [km/h]) and ``vehicle_monitor`` two (speed [km/h], brake pressure as a whole number from 0 to 126 [bar],
rear wheels [rpm]). Keys that we do not represent are absent. A road user is an instance with an annotation in every
sample; its box counts no point of a lidar, which there is none of. Scenes count from 2000, because the devkit refuses
numbers of scenes of its own that lack a CAN bus.

Format: https://www.nuscenes.org/nuscenes#data-format and python-sdk/nuscenes/can_bus/README.md of nuscenes-devkit
"""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.exporting.dataset import Columns, ExportedClip, ExportedDataset, require_pinhole
from flows.exporting.inertial import compute_inertial_motion
from flows.exporting.json_array import JsonArray, open_array
from flows.exporting.poses import compute_quaternions
from flows.exporting.road_users import NAMES, find_attribute, find_visibility_level, list_objects_by_frame
from flows.store.layout import write_json
from manifests.canonical import sha256_of
from manifests.manifest import describe_scenes
from tasks.errors import InputError
from tasks.render.camera import PIXEL_CENTRE
from tasks.render.contact_sheet import encode_png
from tasks.vehicle.parameters import Vehicle

VERSION = "v1.0-musync"
CHANNEL = "CAM_FRONT"
FIRST_SCENE = 2000
MOST_SCENES = 8000
"""A scene's number has four digits."""
STREAMED = (
    "calibrated_sensor", "ego_pose", "scene", "sample", "sample_data", "instance", "sample_annotation",
)  # fmt: skip
VISIBILITIES = ("v0-40", "v40-60", "v60-80", "v80-100")
RPM = 60 / (2 * np.pi)
"""Revolutions a minute in one radian a second."""
KM_H = 3.6
BAR = 10.0
"""Bars in one megapascal."""
VEHICLE_INFO = {
    "FL_wheel_speed": ("wheel_speed_f", RPM),
    "FR_wheel_speed": ("wheel_speed_f", RPM),
    "RL_wheel_speed": ("wheel_speed_r", RPM),
    "RR_wheel_speed": ("wheel_speed_r", RPM),
    "longitudinal_accel": ("longitudinal_acceleration", 1.0),
    "odom_speed": ("speed", KM_H),
}
"""Keys of ``zoe_veh_info``: our column, and the factor to their unit."""
MONITOR = {
    "rear_left_rpm": ("wheel_speed_r", RPM),
    "rear_right_rpm": ("wheel_speed_r", RPM),
    "vehicle_speed": ("speed", KM_H),
}
"""Keys of ``vehicle_monitor``, in the same way; those of the brake are whole numbers."""
MOST_BAR = 126
"""Of ``vehicle_monitor.brake`` [bar]."""
PAUSE_US = 1_000_000
"""Between the end of one scene's telemetry and the start of the next [us]."""


def write_nuscenes(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``v1.0-musync/``, ``samples/``, ``can_bus/`` and ``maps/``.

    Parameters
    ----------
    dataset : with frames of a pinhole
    folder : empty

    Raises
    ------
    InputError
        If the lens distorts or there are more than 8000 clips.
    """
    require_pinhole(dataset, "nuscenes")
    if len(dataset) > MOST_SCENES:
        raise InputError(
            f"{dataset.layout}: --to nuscenes takes {MOST_SCENES} clips at most: name some with --clip"
        )
    tables = folder / VERSION
    for subfolder in (tables, folder / "samples" / CHANNEL, folder / "can_bus", folder / "maps"):
        subfolder.mkdir(parents=True)
    (folder / "maps" / "none.png").write_bytes(encode_png(np.full((1, 1, 3), 255, np.uint8)))
    for name, rows in _describe_fixed(dataset).items():
        write_json(tables / f"{name}.json", rows)
    period_us = round(dataset.plan.settings.telemetry_s * 1e6) + PAUSE_US
    with ExitStack() as stack:
        rows_of = {
            name: stack.enter_context(open_array(stack.enter_context((tables / f"{name}.json").open("w"))))
            for name in STREAMED
        }
        for number, clip in enumerate(dataset):
            scene, start_us = f"scene-{FIRST_SCENE + number:04d}", number * period_us
            _write_scene(clip, dataset, scene, start_us, folder, rows_of)
            _write_annotations(clip, rows_of)
            for message, rows in describe_can_bus(clip, dataset.vehicle, start_us).items():
                write_json(folder / "can_bus" / f"{scene}_{message}.json", rows)


def make_token(*parts: object) -> str:
    """Return the token of a row: 32 hexadecimal digits that follow from what it is."""
    return sha256_of(["/".join(map(str, parts)).encode()])[:32]


def compute_ego_poses(clip: ExportedClip, vehicle: Vehicle) -> NDArray[np.float64]:
    """Return the ego-to-world poses [F, 4, 4]: those of the rig, moved back to the rear axle [m]."""
    return clip.T_world_rig @ _rig_from_ego(vehicle)


def describe_can_bus(clip: ExportedClip, vehicle: Vehicle, start_us: int) -> dict[str, list[dict[str, Any]]]:
    """Return the messages of a clip's CAN bus, by kind; what is not represented is left out.

    Parameters
    ----------
    clip : that was driven
    vehicle : that drove it
    start_us : of the scene [us]
    """
    ticks = clip.ticks
    poses = compute_ego_poses(clip, vehicle)
    motion = compute_inertial_motion(clip, vehicle, _rig_from_ego(vehicle)[:3, 3])
    turns, positions = compute_quaternions(poses, scalar_first=True).tolist(), poses[:, :3, 3].tolist()
    at = (start_us + clip.frames["t_ns"] // 1000).tolist()
    speeds, forces, rates = (
        motion.attitude.inv().apply(vectors).tolist()
        for vectors in (motion.velocity, motion.force, motion.turn_rate)
    )
    return {
        "pose": [
            {"accel": forces[k], "orientation": turns[k], "pos": positions[k], "rotation_rate": rates[k],
             "utime": at[k], "vel": speeds[k]}
            for k in range(len(at))
        ],
        "ms_imu": [
            {"linear_accel": forces[k], "q": turns[k], "rotation_rate": rates[k], "utime": at[k]}
            for k in range(len(at))
        ],
        "zoe_veh_info": [
            _describe_tick(ticks, k, start_us, VEHICLE_INFO)
            for k in _every(ticks["t_ns"], 10_000_000)
        ],
        "vehicle_monitor": [
            _describe_tick(ticks, k, start_us, MONITOR) | _describe_brake(float(ticks["brake_pressure_mpa"][k]))
            for k in _every(ticks["t_ns"], 500_000_000)
        ],
    }  # fmt: skip


def _describe_tick(
    ticks: Columns, tick: int, start_us: int, keys: Mapping[str, tuple[str, float]]
) -> dict[str, Any]:
    values = {key: float(ticks[column][tick]) * factor for key, (column, factor) in keys.items()}
    known = {key: value for key, value in values.items() if np.isfinite(value)}
    return known | {"utime": start_us + int(ticks["t_ns"][tick]) // 1000}


def _describe_brake(pressure_mpa: float) -> dict[str, int]:
    if not np.isfinite(pressure_mpa):
        return {}
    return {"brake": min(round(pressure_mpa * BAR), MOST_BAR), "brake_switch": 2 if pressure_mpa > 0 else 1}


def _write_scene(
    clip: ExportedClip,
    dataset: ExportedDataset,
    scene: str,
    start_us: int,
    folder: Path,
    rows_of: dict[str, JsonArray],
) -> None:
    own = make_token("scene", clip.clip_id)
    frames = clip.frames
    count = len(frames["frame"])
    poses = compute_ego_poses(clip, dataset.vehicle)
    turns, pictures = compute_quaternions(poses, scalar_first=True), clip.read_array("rgb")
    mount = np.linalg.inv(_rig_from_ego(dataset.vehicle)) @ clip.camera.T_rig_camera
    rows_of["calibrated_sensor"].append(
        {"token": make_token("calibrated_sensor", clip.clip_id), "sensor_token": make_token("sensor"),
         "translation": mount[:3, 3].tolist(),
         "rotation": compute_quaternions(mount[None], scalar_first=True)[0].tolist(),
         "camera_intrinsic": (clip.camera.K - PIXEL_CENTRE).tolist()}
    )  # fmt: skip
    rows_of["scene"].append(
        {"token": own, "log_token": make_token("log"), "nbr_samples": count, "name": scene,
         "description": clip.label, "first_sample_token": make_token("sample", clip.clip_id, 0),
         "last_sample_token": make_token("sample", clip.clip_id, count - 1)}
    )  # fmt: skip
    for frame, at_us in enumerate((start_us + frames["t_ns"] // 1000).tolist()):
        name = f"samples/{CHANNEL}/{scene}_{frame:06d}.png"
        (folder / name).write_bytes(encode_png(pictures[frame]))
        ego, sample = (make_token(table, clip.clip_id, frame) for table in ("ego_pose", "sample"))
        rows_of["ego_pose"].append(
            {"token": ego, "timestamp": at_us, "rotation": turns[frame].tolist(),
             "translation": poses[frame, :3, 3].tolist()}
        )  # fmt: skip
        rows_of["sample"].append(
            {"token": sample, "timestamp": at_us, "scene_token": own}
            | dict(_link("sample", clip, frame, count))
        )
        rows_of["sample_data"].append(
            {"token": make_token("sample_data", clip.clip_id, frame), "sample_token": sample,
             "ego_pose_token": ego, "calibrated_sensor_token": make_token("calibrated_sensor", clip.clip_id),
             "timestamp": at_us, "fileformat": "png", "is_key_frame": True, "filename": name,
             "height": dataset.camera.height, "width": dataset.camera.width}
            | dict(_link("sample_data", clip, frame, count))
        )  # fmt: skip


def _write_annotations(clip: ExportedClip, rows_of: dict[str, JsonArray]) -> None:
    frames = list_objects_by_frame(clip)
    for index, first in enumerate(frames[0]):
        number = first["object"]
        token = make_token("instance", clip.clip_id, number)
        boxes = [make_token("sample_annotation", clip.clip_id, number, frame) for frame in range(len(frames))]
        rows_of["instance"].append(
            {"token": token, "category_token": make_token("category", NAMES[first["kind"]].nuscenes),
             "nbr_annotations": len(boxes), "first_annotation_token": boxes[0], "last_annotation_token": boxes[-1]}
        )  # fmt: skip
        for frame, rows in enumerate(frames):
            row = rows[index]
            length, width, height = row["size"]
            rows_of["sample_annotation"].append(
                {"token": boxes[frame], "sample_token": make_token("sample", clip.clip_id, frame),
                 "instance_token": token, "visibility_token": str(find_visibility_level(row)),
                 "attribute_tokens": [make_token("attribute", find_attribute(row))],
                 "translation": row["centre_world"], "size": [width, length, height],
                 "rotation": row["rotation_world"], "num_lidar_pts": 0, "num_radar_pts": 0,
                 "prev": boxes[frame - 1] if frame else "",
                 "next": boxes[frame + 1] if frame + 1 < len(boxes) else ""}
            )  # fmt: skip


def _link(table: str, clip: ExportedClip, frame: int, count: int) -> Iterator[tuple[str, str]]:
    for name, other in (("prev", frame - 1), ("next", frame + 1)):
        yield name, make_token(table, clip.clip_id, other) if 0 <= other < count else ""


def _describe_fixed(dataset: ExportedDataset) -> dict[str, list[dict[str, Any]]]:
    log = make_token("log")
    users = dataset.plan.settings.has_objects
    categories = dict.fromkeys(names.nuscenes for names in NAMES.values()) if users else {}
    attributes = dict.fromkeys(name for names in NAMES.values() for name in names[2:]) if users else {}
    levels = [
        {"token": str(level), "level": name, "description": f"visibility of {name[1:]} %"}
        for level, name in enumerate(VISIBILITIES, start=1)
    ]
    return {
        "category": [{"token": make_token("category", name), "name": name, "description": ""} for name in categories],
        "attribute": [{"token": make_token("attribute", name), "name": name, "description": ""} for name in attributes],
        "visibility": levels if users else [],
        "log": [{"token": log, "logfile": dataset.manifest["run_id"], "vehicle": dataset.plan.settings.vehicle,
                 "date_captured": "", "location": describe_scenes(dataset.manifest)}],
        "map": [{"token": make_token("map"), "log_tokens": [log], "category": "semantic_prior",
                 "filename": "maps/none.png"}],
        "sensor": [{"token": make_token("sensor"), "channel": CHANNEL, "modality": "camera"}],
    }  # fmt: skip


def _rig_from_ego(vehicle: Vehicle) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[0, 3] = -(vehicle.cg_to_front_axle + vehicle.cg_to_rear_axle)
    return pose


def _every(t_ns: NDArray[np.int64], period_ns: int) -> list[int]:
    """Rows whose time is a multiple of a period."""
    rows: list[int] = np.flatnonzero(t_ns % period_ns == 0).tolist()
    return rows
