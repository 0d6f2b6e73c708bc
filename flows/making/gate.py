"""The check of a clip: the motion that the finished frames show, held against the telemetry."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.making.catalogue import Catalogue
from tasks.eval.body_agreement import BodyClaim, pose_body
from tasks.eval.motion_agreement import PoseVerdict, judge_pose
from tasks.eval.poses.checks import (
    GATE_CHECK,
    POSE_CHECKS,
    CheckedClip,
    JudgeCamera,
    hide_moving,
    prepare_clip,
)
from tasks.eval.poses.resampling import halve_camera, halve_frames, undistort_frames
from tasks.render.camera import PIXEL_CENTRE, Camera


def judge_motion(
    buffers: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    film_depth_mm: float,
    catalogue: Catalogue,
    camera: Camera,
) -> dict[str, Any]:
    """Motion that the gate's pose check recovers from the finished frames, compared with the telemetry."""
    shown = {name: buffers[name] for name in ("rgb", "depth", "class")}
    if "instance" in buffers:
        shown["depth"] = hide_moving(buffers["depth"], buffers["instance"])
    pinhole = undistort_frames(shown, camera.K - PIXEL_CENTRE, camera.distortion)
    halved = camera.height >= catalogue.gates.halved_from_px
    checked = prepare_for_checks(pinhole, frames, film_depth_mm, catalogue, camera, halved=halved)
    recovered = POSE_CHECKS[GATE_CHECK](checked)
    body = pose_body(
        frames["heave"], frames["pitch"], catalogue.vehicle.cg_to_front_axle, catalogue.vehicle.cg_height
    )
    claim = BodyClaim(T_world_rig=catalogue.scene.route.pose(frames["station"]) @ body, heave=frames["heave"])
    verdict = judge_pose(recovered, frames["pitch"], frames["station"], catalogue.gates, claim)
    return {
        "recovered_pitch": recovered.pitch,
        "recovered_progress": recovered.progress,
        "verdict": asdict(verdict) | {"reasons": list(verdict.reasons)},
    }


def prepare_for_checks(
    pinhole: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    film_depth_mm: float,
    catalogue: Catalogue,
    camera: Camera,
    *,
    halved: bool = False,
) -> CheckedClip:
    """Return a clip's undistorted ``rgb``, ``depth`` and ``class`` as every pose check takes them, or half as wide."""
    seen = JudgeCamera(
        K=camera.K - PIXEL_CENTRE,
        T_rig_camera=camera.T_rig_camera,
        distortion=camera.distortion,
        line_delay_s=camera.line_delay_s,
    )
    return prepare_clip(
        halve_frames(pinhole) if halved else pinhole,
        halve_camera(seen) if halved else seen,
        frame_interval_s=float(frames["t_ns"][1] - frames["t_ns"][0]) * 1e-9,
        film_depth_mm=film_depth_mm,
        route_rotations=catalogue.scene.route.pose(frames["station"])[:, :3, :3],
    )


def nothing_to_judge(frames: int, reason: str) -> dict[str, Any]:
    """Return the result of `judge_motion` where there is no picture: every value is not represented.

    Parameters
    ----------
    frames : of the clip [1]
    reason : why there is none
    """
    verdict = {figure.name: None for figure in fields(PoseVerdict)}
    return {
        "recovered_pitch": np.full(frames, np.nan),
        "recovered_progress": np.full(frames, np.nan),
        "verdict": verdict | {"reasons": [reason]},
    }
