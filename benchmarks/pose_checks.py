"""Every check of a clip of 81 frames, 480 x 320 px: pose error against known motion, and CPU time."""

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from studies.evaluation.metrics.flip import flip_error
from studies.evaluation.metrics.no_reference import piqe, temporal_error
from studies.evaluation.metrics.road_edit import score_road_edit
from studies.evaluation.metrics.severity import measure_image, sampled_frames
from studies.synthetic_street import Clip, drive_clip
from tasks.conventions import SemanticClass
from tasks.eval.image_quality import ssim
from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.photometric import recover_motion_photometric
from tasks.eval.poses.pnp import recover_motion_pnp

PITCH_LIMITS_DEG = {"pnp": 0.04, "photometric": 0.02, "essential": 0.06}
"""Pitch RMSE allowed in clear weather [deg]."""
PROTOTYPE_PROGRESS_M = {"pnp": 0.13, "photometric": 0.015}
"""Worst progress RMSE of a prototype [m]."""
PROTOTYPE_NORMALISED = 0.0024
"""Worst normalised progress RMSE of a camera-only prototype [1]."""
CPU_LIMIT_S = 12.0
"""CPU time allowed for all checks of one clip [CPU-s]."""
FEATURE_M, LOOK_AHEAD_M = (13.3, 13.9), 40.0
"""Where on the way the street's hump lies, and from where on it is looked for [m]."""
SHADE = 40
"""How much darker the feature clip is there than its flat twin, 8-bit [1]."""
AROUND = 18
"""How far about the feature its shade may reach [px]."""


def measure_rows() -> list[dict[str, Any]]:
    """Measure each check on one drive over a hump at 40 km/h, 16 frames per second.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    clip = drive_clip()
    with_depth = (clip.frames, clip.depth, clip.K, clip.T_rig_camera, clip.class_id == SemanticClass.SKY)
    checks: dict[str, Callable[[], RecoveredMotion]] = {
        "pnp": lambda: recover_motion_pnp(*with_depth),
        "photometric": lambda: recover_motion_photometric(*with_depth),
        "essential": lambda: recover_motion_essential(clip.frames, clip.K, clip.T_rig_camera),
    }
    result, total = [], 0.0
    for name, check in checks.items():
        seen, cpu_s = check(), least_cpu_s(check)
        total += cpu_s
        result += [
            *_error_rows(name, seen, clip),
            make_row(f"{name}: CPU time", cpu_s, "CPU-s", "limit, all checks", CPU_LIMIT_S),
        ]
    others: dict[str, Callable[[], object]] = {
        "piqe": lambda: [piqe(picture) for picture in clip.frames[sampled_frames(len(clip.frames))]],
        "temporal error": lambda: temporal_error(clip.frames),
        "image statistics": lambda: measure_image(clip.frames, clip.class_id == SemanticClass.ROAD),
    }
    totals = {}
    for kind, measures in {"a clip": others, "a feature clip": _feature_checks(clip)}.items():
        for name, measure in measures.items():
            cpu_s = least_cpu_s(measure)
            total += cpu_s
            result.append(make_row(f"{name}: CPU time", cpu_s, "CPU-s", "limit, all checks", CPU_LIMIT_S))
        totals[kind] = total
    return result + [
        make_row(f"all checks of {kind}: CPU time", cpu_s, "CPU-s", "limit", CPU_LIMIT_S)
        for kind, cpu_s in totals.items()
    ]


def _feature_checks(clip: Clip) -> dict[str, Callable[[], object]]:
    """Measure the further checks of a clip with a road feature: the edit, and the likeness to its flat twin."""
    targets = _find_targets(clip)
    shown = clip.frames.copy()
    shown[targets] -= np.minimum(shown[targets], SHADE)
    kept = np.flatnonzero(targets.any(axis=(1, 2)))
    reach = np.ones((2 * AROUND + 1, 2 * AROUND + 1), np.uint8)

    def twins(measure: Callable[..., object]) -> list[object]:
        return [
            measure(clip.frames[k], shown[k], cv2.dilate(targets[k].astype(np.uint8), reach) == 0)
            for k in kept
        ]

    return {
        "road edit": lambda: score_road_edit(list(shown), list(clip.frames), list(targets)),
        "twin SSIM": lambda: twins(ssim),
        "twin FLIP": lambda: twins(flip_error),
    }


def _find_targets(clip: Clip) -> NDArray[np.bool_]:
    """Road pixels on the feature while the car has not passed it, bool [F, H, W]."""
    masks = np.zeros(clip.depth.shape, bool)
    poses = clip.T_world_rig @ clip.T_rig_camera
    for k in np.flatnonzero(clip.station < FEATURE_M[1]):
        y, x = np.nonzero((clip.class_id[k] == SemanticClass.ROAD) & (clip.depth[k] < LOOK_AHEAD_M))
        rays = np.stack([x, y, np.ones(len(x))], axis=1) @ np.linalg.inv(clip.K).T
        along = (rays * clip.depth[k, y, x, None]) @ poses[k, 0, :3] + poses[k, 0, 3]
        on = (along >= FEATURE_M[0]) & (along <= FEATURE_M[1])
        masks[k, y[on], x[on]] = True
    return masks


def _error_rows(name: str, seen: RecoveredMotion, clip: Clip) -> list[dict[str, Any]]:
    pitch_deg = _compute_rms(np.rad2deg(seen.pitch - clip.pitch))
    result = [make_row(f"{name}: pitch RMSE", pitch_deg, "deg", "limit", PITCH_LIMITS_DEG[name])]
    if name in PROTOTYPE_PROGRESS_M:
        progress = _compute_rms(seen.progress - clip.station)
        result.append(
            make_row(f"{name}: progress RMSE", progress, "m", "prototype", PROTOTYPE_PROGRESS_M[name])
        )
    normalised = _compute_rms(seen.normalised_path[:, 0] - clip.station / clip.station[-1])
    result.append(
        make_row(f"{name}: normalised progress RMSE", normalised, "1", "prototype", PROTOTYPE_NORMALISED)
    )
    return result


def _compute_rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


if __name__ == "__main__":
    print_rows(measure_rows())
