"""How far the two modes lie apart on one scenario."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.vehicle.rollout import Rollout

AFTER_STOP_S = 1.0
SLIP_SPEED = 0.5
"""Slip is compared above this speed, as in the paper's Appendix A.2 [m/s]."""


@dataclass(frozen=True, kw_only=True)
class ModeDifference:
    """Coupled beside paper mode; NaN where the scenario has no stop.

    Parameters
    ----------
    stop_paper, stop_coupled : stopping distances [m]
    speed_rmse : [m/s]
    pitch_rmse_deg : [deg]
    peak_pitch_paper_deg, peak_pitch_coupled_deg : largest nose-down pitch [deg]
    slip_rmse : mean of the axles [1]
    wheel_load_rmse : of one wheel, mean of the axles [N]
    """

    stop_paper: float
    stop_coupled: float
    speed_rmse: float
    pitch_rmse_deg: float
    peak_pitch_paper_deg: float
    peak_pitch_coupled_deg: float
    slip_rmse: float
    wheel_load_rmse: float


def mode_difference(paper: Rollout, coupled: Rollout) -> ModeDifference:
    """Compare two rollouts of one scenario from the brake onset to a second after the later stop.

    Without a brake the comparison begins with the clip, without a stop it ends with it.

    Parameters
    ----------
    paper, coupled : the same scenario and duration in each mode
    """
    time = paper.columns["t_ns"] * 1e-9
    begin = np.nan_to_num(paper.brake_onset_time, nan=0.0)
    end = max(paper.stop_time, coupled.stop_time) + AFTER_STOP_S
    window = (time >= begin) & ~(time > end)
    moving = window & (np.minimum(paper.columns["speed"], coupled.columns["speed"]) > SLIP_SPEED)

    def rmse(name: str, rows: NDArray[np.bool_]) -> float:
        return float(np.sqrt(np.mean((paper.columns[name] - coupled.columns[name])[rows] ** 2)))

    return ModeDifference(
        stop_paper=paper.stopping_distance,
        stop_coupled=coupled.stopping_distance,
        speed_rmse=rmse("speed", window),
        pitch_rmse_deg=float(np.degrees(rmse("pitch", window))),
        peak_pitch_paper_deg=float(np.degrees(paper.columns["pitch"].max())),
        peak_pitch_coupled_deg=float(np.degrees(coupled.columns["pitch"].max())),
        slip_rmse=(rmse("braking_slip_f", moving) + rmse("braking_slip_r", moving)) / 2,
        wheel_load_rmse=(rmse("axle_load_f", window) + rmse("axle_load_r", window)) / 4,
    )
