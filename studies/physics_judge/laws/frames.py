"""Laws of a clip's frames: their rows are ticks, and the rig pose follows the route."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.physics_judge.laws.constants import Constants, Floats
from studies.physics_judge.laws.law import Law, evaluate_law
from tasks.conventions import TICK_CHANNELS
from tasks.eval.body_agreement import pose_body, rms
from tasks.eval.poses.rigid import invert_pose

PITCH = "frames.recovered_pitch frames.pitch ticks.pitch"
PROGRESS = "frames.recovered_progress frames.station ticks.station"
"""Columns that the figures of pitch and of progress follow from."""


def frame_laws(
    ticks: Mapping[str, Floats],
    frames: Mapping[str, NDArray[Any]],
    facts: Mapping[str, Any],
    constants: Constants,
) -> list[Law | None]:
    """Return the laws that each frame row equals its nearest tick and that its surface is the clip's.

    Parameters
    ----------
    ticks, frames : columns of the two tables
    facts : the clip's row
    constants : car and pavement
    """
    tick, number = frames["tick"], np.arange(len(frames["tick"]))
    last = len(ticks["speed"]) - 1
    spacing = constants.ticks_per_frame
    laws = [
        evaluate_law("frames are counted", "frame", (frames["frame"] - number).astype(float), 0.5, "frames"),
        evaluate_law("frames show the nearest tick", "tick", tick - number * spacing, 0.5 + 1e-6, "frames"),
    ]
    rows = np.clip(tick, 0, last)
    for channel in TICK_CHANNELS:
        here = np.asarray(frames[channel.name], float)
        there = np.asarray(ticks[channel.name], float)[rows]
        laws.append(
            evaluate_law(f"frame rows are ticks: {channel.name}",
                f"frames.{channel.name} ticks.{channel.name} frames.tick", here - there, 1e-300)
        )  # fmt: skip
    for name in ("film_depth_mm", "snow_depth_mm", "snow_coverage", "surface_friction", "tyre_peak"):
        laws.append(
            evaluate_law(f"frame rows hold the clip's {name}", f"frames.{name} clips.{name}",
                frames[name] - facts[name], 1e-300)
        )  # fmt: skip
    return laws


def pose_laws(frames: Mapping[str, NDArray[Any]], constants: Constants) -> list[Law | None]:
    """Return the laws that the rig pose without heave and pitch follows the route (paper, Eq. camera_pose).

    Parameters
    ----------
    frames : columns of the frame table
    constants : car and pavement
    """
    T = frames["T_world_rig"].reshape(-1, 4, 4)
    turn = T[:, :3, :3]
    heave, pitch, station = frames["heave"], frames["pitch"], frames["station"]
    body = pose_body(heave, pitch, constants.car["cg_to_front_axle"], constants.car["cg_height"])
    route = T @ invert_pose(body)
    move = np.diff(route[:, :3, 3], axis=0)
    middle = route[1:, :3, :3] + route[:-1, :3, :3]
    across = np.einsum("nij,ni->nj", middle / np.linalg.norm(middle, axis=1, keepdims=True), move)
    gone = np.diff(station)
    # chords of a bend are shorter than its arc, and the road's crown and slope turn the axes a little
    slack, aside = 1e-3 * gone + 1e-4, 0.02 * gone + 1e-4
    identity = np.eye(3) - np.swapaxes(turn, 1, 2) @ turn
    return [
        evaluate_law("rig poses are rigid", "T_world_rig", np.abs(identity).max(axis=(1, 2)), 1e-9, "frames"),
        evaluate_law("rig poses end in 0 0 0 1", "T_world_rig",
            np.abs(T[:, 3] - [0, 0, 0, 1]).max(axis=1), 1e-12, "frames"),
        evaluate_law("rig moves by the station", "T_world_rig station ticks.station",
            np.linalg.norm(move, axis=1) - gone, slack, "frames"),
        evaluate_law("rig less heave and pitch stays on the route", "T_world_rig heave pitch ticks.heave ticks.pitch",
            across[:, 2], aside, "frames"),
        evaluate_law("rig less heave and pitch goes along its heading", "T_world_rig", across[:, 1], aside, "frames"),
    ]  # fmt: skip


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
