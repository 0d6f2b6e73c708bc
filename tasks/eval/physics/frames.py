"""Laws of a clip's frames: their rows are ticks, and the rig pose follows the route."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import TICK_CHANNELS
from tasks.eval.body_agreement import pose_body
from tasks.eval.physics.constants import Constants, Floats
from tasks.eval.physics.laws import Law, evaluate_law
from tasks.eval.poses.rigid import invert_pose


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
