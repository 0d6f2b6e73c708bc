"""Laws of the recorded pose check: its figures follow from the motion that the frame table holds."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tasks.eval.body_agreement import rms
from tasks.eval.physics.constants import Floats
from tasks.eval.physics.laws import Law, evaluate_law

PITCH = "frames.recovered_pitch frames.pitch ticks.pitch"
PROGRESS = "frames.recovered_progress frames.station ticks.station"
"""Columns that the figures of pitch and of progress follow from."""


def pose_check_laws(frames: Mapping[str, Floats], facts: Mapping[str, Any]) -> list[Law | None]:
    """Return the laws of the check's figures, each computed again; none of a dataset of telemetry alone.

    Roll, yaw, place and heave are recovered too, and in no column: their figures are left unjudged.

    Parameters
    ----------
    frames : columns of the frame table
    facts : the clip's row
    """
    seen = np.isfinite(frames["recovered_pitch"])
    if not seen.any():
        return []
    figures = [("check_failed_frames", "frames.recovered_pitch", float(np.sum(~seen)))]
    if "check_judged_frames" in facts:
        figures.append(("check_judged_frames", "frames.recovered_pitch", float(np.sum(seen[1:]))))
    if seen[1:].any():
        figures += _compute_figures(frames, facts, seen)
    return [
        evaluate_law(f"{name} worked out again", f"clips.{name} {columns}",
            np.array([facts[name] - value]), 1e-9 * (1 + abs(value)))
        for name, columns, value in figures
    ]  # fmt: skip


def _compute_figures(
    frames: Mapping[str, Floats], facts: Mapping[str, Any], seen: Floats
) -> list[tuple[str, str, float]]:
    """Name, columns and value of each figure that compares recovered with claimed motion."""
    claimed = np.rad2deg(frames["pitch"] - frames["pitch"][0])[seen]
    found = np.rad2deg(frames["recovered_pitch"])[seen]
    way = (frames["station"] - frames["station"][0])[seen]
    progress = frames["recovered_progress"][seen]
    response, error = rms(claimed), rms(found - claimed)
    figures = [
        ("check_claimed_pitch_rms_deg", "frames.pitch ticks.pitch", response),
        ("check_pitch_rmse_deg", PITCH, error),
        ("check_progress_rmse_m", PROGRESS, rms(progress - way)),
    ]
    if np.isfinite(facts["check_pitch_relative_error"]):
        relative = error / response
        figures.append(("check_pitch_relative_error", f"{PITCH} clips.check_pitch_rmse_deg", relative))
    if np.isfinite(facts["check_pitch_correlation"]):
        figures.append(("check_pitch_correlation", PITCH, float(np.corrcoef(found, claimed)[0, 1])))
    if way[-1] > 0 and np.isfinite(facts["check_normalised_progress_rmse"]):
        share = rms(progress / progress[-1] - way / way[-1])
        figures.append(("check_normalised_progress_rmse", PROGRESS, share))
    return figures
