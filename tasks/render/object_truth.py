"""Truth about the road users of a clip for detectors: where each is, how it moves, and how much of it is seen."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.render.camera import Camera
from tasks.render.clip import RigMotion, pose_rows
from tasks.render.moving_bodies import MovingBody
from tasks.render.readout import project_by_rows

Floats = NDArray[np.float64]

NEAR_M, NEAR_SHARE = 0.15, 0.01
"""What lies nearer than this, and than this share of its depth [1], hides a surface [m]."""
NEAREST_M = 0.1
"""Nothing closer to the camera is in the picture [m]."""


def measure_objects(
    clip: Mapping[str, NDArray[Any]], camera: Camera, motion: RigMotion
) -> dict[str, NDArray[Any]]:
    """Return the truth about each body in each frame, frame by frame.

    Parameters
    ----------
    clip : ``depth`` and ``instance`` of the finished frames; empty without pictures
    camera : that took them
    motion : of rig and bodies

    Returns
    -------
    Columns of F times B rows, named as of `tasks.conventions.OBJECT_CHANNELS`; NaN where nothing is seen.
    """
    frames, bodies = len(motion.T_world_rig), motion.bodies
    rows: list[dict[str, Any]] = []
    T_world_camera = motion.T_world_rig @ camera.T_rig_camera
    poses = pose_rows(camera, T_world_camera, motion.rig_at) if clip else None
    for frame in range(frames):
        for body in bodies:
            row = _describe_box(body, frame, motion.T_world_rig[frame]) | dict.fromkeys(
                ("box_left", "box_top", "box_right", "box_bottom", "visibility", "truncation"), np.nan
            )
            row["visible_pixels"] = 0
            if clip:
                shown = clip["instance"][frame] == body.number
                row |= _measure_box(shown)
                at = T_world_camera[frame] if poses is None else poses[frame][1]
                row |= _measure_visibility(body, frame, shown, clip["depth"][frame], camera, at)
            rows.append(row)
    return {name: np.array([row[name] for row in rows], kind) for name, kind in _KINDS.items()}


_KINDS: dict[str, Any] = {
    "frame": np.int64, "object": np.int64, "kind": np.str_, "visible_pixels": np.int64,
    **dict.fromkeys(
        ("box_left", "box_top", "box_right", "box_bottom", "visibility", "truncation", "size", "centre_world",
         "rotation_world", "centre_rig", "rotation_rig", "velocity_world", "velocity_rig"), np.float64),
}  # fmt: skip


def _describe_box(body: MovingBody, frame: int, T_world_rig: Floats) -> dict[str, Any]:
    """Return the box of a body, and its velocity, in the world and in the axes of the rig."""
    pose = body.T_world_body[frame].copy()
    pose[:3, 3] += pose[:3, 2] * body.body.size[2] / 2
    in_rig = np.linalg.inv(T_world_rig) @ pose
    turns = Rotation.from_matrix(np.stack((pose[:3, :3], in_rig[:3, :3]))).as_quat(
        canonical=True, scalar_first=True
    )
    return {
        "frame": frame,
        "object": body.number,
        "kind": body.body.kind,
        "size": body.body.size,
        "centre_world": pose[:3, 3],
        "rotation_world": turns[0],
        "centre_rig": in_rig[:3, 3],
        "rotation_rig": turns[1],
        "velocity_world": body.velocity[frame],
        "velocity_rig": T_world_rig[:3, :3].T @ body.velocity[frame],
    }


def _measure_box(shown: NDArray[np.bool_]) -> dict[str, Any]:
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    if not len(rows):
        return {}
    return {
        "box_left": columns[0],
        "box_top": rows[0],
        "box_right": columns[-1] + 1,
        "box_bottom": rows[-1] + 1,
        "visible_pixels": int(shown.sum()),
    }


def _measure_visibility(
    body: MovingBody,
    frame: int,
    shown: NDArray[np.bool_],
    depth: NDArray[np.floating],
    camera: Camera,
    at: Floats,
) -> dict[str, float]:
    """Return visibility and truncation by the surface that faces the camera, each part as large as it is seen."""
    pose, own = body.T_world_body[frame], body.body.body.gaussians
    points = own.means @ pose[:3, :3].T + pose[:3, 3]
    middle = at if at.ndim == 2 else at[len(at) // 2]
    towards = middle[:3, 3] - points
    distance = np.linalg.norm(towards, axis=1)
    cosine = np.einsum("nk,nk->n", towards, own.normals @ pose[:3, :3].T) / distance
    facing = cosine > 0
    area = (own.scales[:, :2].prod(axis=1) * cosine / distance**2)[facing]
    u, v, z = _project(points[facing], camera, at).T
    with np.errstate(invalid="ignore"):
        inside = (z > NEAREST_M) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    row, column = (np.where(inside, np.floor(place), 0).astype(np.int64) for place in (v, u))
    on_own = shown[row, column]
    behind = inside & (depth[row, column] < z - NEAR_M - NEAR_SHARE * z)
    # where the nearer surface is its own, its far side is not counted
    seen, hidden = area[inside & on_own & ~behind].sum(), area[behind & ~on_own].sum()
    return {
        "visibility": float(seen / (seen + hidden)) if seen + hidden > 0 else np.nan,
        "truncation": float(1 - area[inside].sum() / area.sum()) if len(area) else np.nan,
    }


def _project(points: Floats, camera: Camera, at: Floats) -> Floats:
    """Return right and down [px] and camera z [m] of points [N, 3], by one pose or by those of the rows."""
    if at.ndim == 3:
        return project_by_rows(points, at, camera)
    local = (points - at[:3, 3]) @ at[:3, :3]
    z = np.where(local[:, 2] > NEAREST_M, local[:, 2], np.nan)
    return np.column_stack(
        (
            camera.K[0, 0] * local[:, 0] / z + camera.K[0, 2],
            camera.K[1, 1] * local[:, 1] / z + camera.K[1, 2],
            z,
        )
    )
