"""Road users of a dataset's clips as detectors take them: their rows, and their names and boxes in other formats."""

from math import isnan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flows.exporting.dataset import ExportedClip, to_json_value

STANDING_M_S = 0.1
"""Speed below which a road user stands [m/s]."""


class Names(NamedTuple):
    """Names of a kind: type in KITTI, category in nuScenes, attribute there when it moves and when it stands."""

    kitti: str
    nuscenes: str
    moving: str
    standing: str


_VEHICLE = "vehicle.moving", "vehicle.stopped"
_PEDESTRIAN = "pedestrian.moving", "pedestrian.standing"
NAMES = {
    "car": Names("Car", "vehicle.car", *_VEHICLE),
    "van": Names("Van", "vehicle.car", *_VEHICLE),
    "truck": Names("Truck", "vehicle.truck", *_VEHICLE),
    "adult": Names("Pedestrian", "human.pedestrian.adult", *_PEDESTRIAN),
    "child": Names("Pedestrian", "human.pedestrian.child", *_PEDESTRIAN),
    "bicycle": Names("Cyclist", "vehicle.bicycle", "cycle.with_rider", "cycle.with_rider"),
}


def list_objects_by_frame(clip: ExportedClip) -> list[list[dict[str, Any]]]:
    """Return the rows of the table of road users as JSON has them, frame by frame; empty lists without any.

    Parameters
    ----------
    clip : with road users or without
    """
    frames: list[list[dict[str, Any]]] = [[] for _ in range(clip.plan.settings.frames)]
    columns = clip.objects
    names = [name for name in columns if name not in {"clip_id", "label", "weather", "frame"}]
    for index, frame in enumerate(columns.get("frame", ())):
        row = {name: columns[name][index] for name in names}
        frames[int(frame)].append(
            {name: v.tolist() if isinstance(v, np.ndarray) else to_json_value(v) for name, v in row.items()}
        )
    return frames


def find_attribute(row: dict[str, Any]) -> str:
    """Return the nuScenes attribute of a row."""
    names = NAMES[row["kind"]]
    return names.moving if np.linalg.norm(row["velocity_world"]) > STANDING_M_S else names.standing


def find_visibility_level(row: dict[str, Any]) -> int:
    """Return the nuScenes level of visibility of a row, 1 to 4: up to 40, 60, 80 and 100 %."""
    share = row["visibility"] if row["visible_pixels"] else 0.0
    return 1 + int(np.searchsorted((0.4, 0.6, 0.8), 0.0 if share is None else share))


def describe_kitti_label(row: dict[str, Any], T_world_camera: NDArray[np.float64]) -> str:
    """Return the line of a visible road user in ``label_2``.

    Parameters
    ----------
    row : of `list_objects_by_frame`, with a box in the picture
    T_world_camera : float64 [4, 4] pose of the camera [m]
    """
    turn = Rotation.from_quat(row["rotation_world"], scalar_first=True).as_matrix()
    length, width, height = row["size"]
    foot = np.array(row["centre_world"]) - turn[:, 2] * height / 2
    x, y, z = (foot - T_world_camera[:3, 3]) @ T_world_camera[:3, :3]
    right, _, ahead = turn[:, 0] @ T_world_camera[:3, :3]
    yaw = float(np.arctan2(-ahead, right))
    alpha = float(np.angle(np.exp(1j * (yaw - np.arctan2(x, z)))))
    level = row["visibility"]
    occluded = 3 if level is None or isnan(level) else 0 if level >= 0.8 else 1 if level >= 0.4 else 2
    box = row["box_left"], row["box_top"], row["box_right"] - 1, row["box_bottom"] - 1
    numbers = (alpha, *box, height, width, length, x, y, z, yaw)
    return (
        f"{NAMES[row['kind']].kitti} {row['truncation']:.2f} {occluded} "
        + " ".join(f"{value:.6g}" for value in numbers)
        + "\n"
    )
