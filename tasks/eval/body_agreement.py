"""Agreement of the recovered with the claimed rig in what pitch and progress leave open: roll, yaw, place, heave."""

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.rigid import invert_pose

Floats = NDArray[np.float64]

HEAVE_SPAN = 2
"""Frames over which heave is compared: a rolling shutter, taken out again, blurs what happens within one [1]."""


@dataclass(frozen=True, kw_only=True)
class BodyClaim:
    """Claimed motion of the whole rig at the frames.

    Parameters
    ----------
    T_world_rig : float64 [F, 4, 4] rig poses of route, heave and pitch [m]
    heave : float64 [F] of the body [m]
    """

    T_world_rig: Floats
    heave: Floats


@dataclass(frozen=True, kw_only=True)
class BodyErrors:
    """Recovered against claimed rig, both counted from frame 0; NaN where nothing is said of the rig.

    Parameters
    ----------
    roll_rmse_deg, yaw_rmse_deg : RMSE of the rig's roll and yaw [deg]
    lateral_rmse_m, rise_rmse_m : RMSE of its place along the claimed left and upward axes [m]
    heave_gain : recovered heave over claimed heave, from changes over `HEAVE_SPAN` frames by least squares [1];
        NaN where the claimed heave does not change
    heave_gain_std : standard uncertainty of the gain, from the residuals [1]
    """

    roll_rmse_deg: float = nan
    yaw_rmse_deg: float = nan
    lateral_rmse_m: float = nan
    rise_rmse_m: float = nan
    heave_gain: float = nan
    heave_gain_std: float = nan


def pose_body(heave: Floats, pitch: Floats, cg_behind_front_axle: float, cg_height: float) -> Floats:
    """Return the body's poses [N, 4, 4] in the undisturbed rig [m] (paper, Eq. camera_pose).

    Parameters
    ----------
    heave : float64 [N] up positive [m]
    pitch : float64 [N] nose-down positive, about the centre of gravity [rad]
    cg_behind_front_axle, cg_height : place of the centre of gravity [m]
    """
    body = np.tile(np.eye(4), (len(heave), 1, 1))
    body[:, 0, 0] = body[:, 2, 2] = np.cos(pitch)
    body[:, 0, 2], body[:, 2, 0] = np.sin(pitch), -np.sin(pitch)
    centre = np.array([-cg_behind_front_axle, 0.0, cg_height])
    body[:, :3, 3] = centre - body[:, :3, :3] @ centre
    body[:, 2, 3] += heave
    return body


def compare_body(recovered: RecoveredMotion, claim: BodyClaim) -> BodyErrors:
    """Compare the recovered rig with the claimed one over the frames that have a pose.

    Parameters
    ----------
    recovered : result of a pose check that knows the scale
    claim : of the same frames

    Raises
    ------
    InputError
        If the claim has not one finite pose and heave per frame.
    """
    frames = len(recovered.failed)
    problems = [
        f"The claimed {name} must be finite [{', '.join(map(str, shape))}], got shape {values.shape}."
        for name, values, shape in (
            ("rig poses", claim.T_world_rig, (frames, 4, 4)),
            ("heave", claim.heave, (frames,)),
        )
        if values.shape != shape or not np.isfinite(values).all()
    ]
    if problems:
        raise InputError(problems)
    meant = invert_pose(claim.T_world_rig[:1]) @ claim.T_world_rig
    error = (invert_pose(meant) @ recovered.T_rig0_rig)[~recovered.failed]
    roll = np.arctan2(error[:, 2, 1], error[:, 2, 2])
    yaw = np.arctan2(error[:, 1, 0], error[:, 0, 0])
    gain, std = _fit_heave_gain(recovered, meant, claim.heave)
    return BodyErrors(
        roll_rmse_deg=float(np.rad2deg(rms(roll))),
        yaw_rmse_deg=float(np.rad2deg(rms(yaw))),
        lateral_rmse_m=rms(error[:, 1, 3]),
        rise_rmse_m=rms(error[:, 2, 3]),
        heave_gain=gain,
        heave_gain_std=std,
    )


def _fit_heave_gain(recovered: RecoveredMotion, meant: Floats, heave: Floats) -> tuple[float, float]:
    """Gain of the recovered heave and its standard uncertainty [1], without what the track drifts by each frame."""
    if len(heave) <= HEAVE_SPAN:
        return float("nan"), float("nan")
    # steps in the axes of the frame before: there a pitch that drifts does not turn the way into heave
    steps = recovered.T_previous_rig[1:, :3, 3] - (invert_pose(meant[:-1]) @ meant[1:])[:, :3, 3]
    up = np.einsum("nj,nj->n", meant[:-1, 2, :3], steps)
    error = np.convolve(up, np.ones(HEAVE_SPAN), mode="valid")
    change = heave[HEAVE_SPAN:] - heave[:-HEAVE_SPAN]
    seen = np.isfinite(error)
    error, change = (values[seen] - np.mean(values[seen]) for values in (error, change))
    energy = float(change @ change)
    if not energy > 0:
        return float("nan"), float("nan")
    excess = float(error @ change) / energy
    # neighbouring changes share a frame, so only one in HEAVE_SPAN is a measurement of its own
    std = np.sqrt(HEAVE_SPAN / energy) * rms(error - excess * change)
    return 1.0 + excess, float(std)


def rms(values: Floats) -> float:
    """Return the root mean square [any]."""
    return float(np.sqrt(np.mean(np.square(values))))
