"""Motions of the rig that the telemetry does not claim: what falsified pictures would show."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.eval.body_agreement import BodyClaim
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.rigid import invert_pose

Floats = NDArray[np.float64]

ROLL, ASIDE, YAW = np.deg2rad([3.0, 3.0, 2.0])
"""Roll back and forth, yaw all along, yaw back and forth [rad]."""
SWAY = 0.3
"""Sway to either side [m]."""
ROLL_HZ, SWAY_HZ = 0.5, 0.3
"""Frequencies of roll, and of yaw and sway [Hz]."""


def _turn(T: Floats, first: int, second: int, angle: Floats | float) -> Floats:
    turned = np.tile(np.eye(4), (len(T), 1, 1))
    turned[:, first, first] = turned[:, second, second] = np.cos(angle)
    turned[:, first, second], turned[:, second, first] = -np.sin(angle), np.sin(angle)
    return T @ turned


def _shift(T: Floats, axis: int, way: Floats) -> Floats:
    shifted = T.copy()
    shifted[:, :3, 3] += way[:, None] * T[:, :3, axis]
    return shifted


def _swing(times: Floats, hertz: float) -> Floats:
    return np.sin(2 * np.pi * hertz * (times - times[0]))


FALSE_RIGS: dict[str, Callable[[BodyClaim, Floats], Floats]] = {
    "no-heave": lambda rig, times: _shift(rig.T_world_rig, 2, -rig.heave),
    "heave-flip": lambda rig, times: _shift(rig.T_world_rig, 2, -2 * rig.heave),
    "heave-3": lambda rig, times: _shift(rig.T_world_rig, 2, 2 * rig.heave),
    "roll": lambda rig, times: _turn(rig.T_world_rig, 1, 2, ROLL * _swing(times, ROLL_HZ)),
    "yaw": lambda rig, times: _turn(rig.T_world_rig, 0, 1, YAW * _swing(times, SWAY_HZ)),
    "aside": lambda rig, times: _turn(rig.T_world_rig, 0, 1, ASIDE),
    "sway": lambda rig, times: _shift(rig.T_world_rig, 1, SWAY * _swing(times, SWAY_HZ)),
}
"""Rig poses [F, 4, 4] that false pictures show [m], from the true claim and the frames' times [s], by name."""


def show_rig(recovered: RecoveredMotion, claim: BodyClaim, T_world_rig: Floats) -> RecoveredMotion:
    """Return the motion as the pose check would have recovered it, errors and all, from a rig that moved otherwise.

    Pitch and progress stay as they were recovered: no motion of `FALSE_RIGS` changes them by more than rounding.

    Parameters
    ----------
    recovered : from the true pictures
    claim : true
    T_world_rig : float64 [F, 4, 4] of the other motion [m]
    """
    true, shown = (invert_pose(T[:1]) @ T for T in (claim.T_world_rig, T_world_rig))
    return replace(recovered, T_rig0_rig=shown @ invert_pose(true) @ recovered.T_rig0_rig)
