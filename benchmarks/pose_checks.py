"""The pose checks on a clip of 81 frames, 480 x 320 px: error against known motion, and CPU time."""

import time
from collections.abc import Callable
from statistics import median
from typing import Any, TypeVar

import numpy as np

from benchmarks.synthetic_street import Clip, drive_clip
from tasks.conventions import SemanticClass
from tasks.eval.motion import RecoveredMotion
from tasks.eval.no_reference import piqe, temporal_error
from tasks.eval.pose_essential import recover_motion_essential
from tasks.eval.pose_photometric import recover_motion_photometric
from tasks.eval.pose_pnp import recover_motion_pnp
from tasks.eval.severity import sampled_frames

PITCH_LIMITS_DEG = {"pnp": 0.04, "photometric": 0.02, "essential": 0.06}
"""Pitch RMSE allowed in clear weather [deg]."""
PROTOTYPE_PROGRESS_M = {"pnp": 0.13, "photometric": 0.015}
"""Worst progress RMSE of a prototype [m]."""
PROTOTYPE_NORMALISED = 0.0024
"""Worst normalised progress RMSE of a camera-only prototype [1]."""
CPU_LIMIT_S = 12.0
"""CPU time allowed for all checks of one clip [CPU-s]."""
REPEATS = 3
T = TypeVar("T")


def rows() -> list[dict[str, Any]]:
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
        seen, cpu_s = _timed(check)
        total += cpu_s
        result += [
            *_error_rows(name, seen, clip),
            _row(f"{name}: CPU time", cpu_s, "CPU-s", "limit, all checks", CPU_LIMIT_S),
        ]
    quality: dict[str, Callable[[], object]] = {
        "piqe": lambda: [piqe(picture) for picture in clip.frames[sampled_frames(len(clip.frames))]],
        "temporal error": lambda: temporal_error(clip.frames),
    }
    for name, measure in quality.items():
        _, cpu_s = _timed(measure)
        total += cpu_s
        result.append(_row(f"{name}: CPU time", cpu_s, "CPU-s", "limit, all checks", CPU_LIMIT_S))
    return [*result, _row("all checks: CPU time", total, "CPU-s", "limit", CPU_LIMIT_S)]


def _error_rows(name: str, seen: RecoveredMotion, clip: Clip) -> list[dict[str, Any]]:
    pitch_deg = _rms(np.rad2deg(seen.pitch - clip.pitch))
    result = [_row(f"{name}: pitch RMSE", pitch_deg, "deg", "limit", PITCH_LIMITS_DEG[name])]
    if name in PROTOTYPE_PROGRESS_M:
        progress = _rms(seen.progress - clip.station)
        result.append(_row(f"{name}: progress RMSE", progress, "m", "prototype", PROTOTYPE_PROGRESS_M[name]))
    normalised = _rms(seen.normalised_path[:, 0] - clip.station / clip.station[-1])
    result.append(
        _row(f"{name}: normalised progress RMSE", normalised, "1", "prototype", PROTOTYPE_NORMALISED)
    )
    return result


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _timed(check: Callable[[], T]) -> tuple[T, float]:
    """A check's result and its median CPU time, after a run that compiles or loads what it needs [CPU-s]."""
    seen = check()
    times = []
    for _ in range(REPEATS):
        started = time.process_time()
        check()
        times.append(time.process_time() - started)
    return seen, median(times)


def _row(name: str, value: float, unit: str, peer: str, peer_value: float) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "peer": peer, "ratio": value / peer_value}


if __name__ == "__main__":
    for row in rows():
        print(f"{row['name']:44} {row['value']:10.5f} {row['unit']:8} {row['ratio']:.4f} of {row['peer']}")
