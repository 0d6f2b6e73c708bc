"""How far a recovered motion is from a clip's truth."""

import numpy as np

from studies.synthetic_street import Clip
from tasks.eval.poses.motion import RecoveredMotion


def pitch_rmse_deg(recovered: RecoveredMotion, clip: Clip) -> float:
    error = np.rad2deg(recovered.pitch - (clip.pitch - clip.pitch[0]))
    return float(np.sqrt(np.nanmean(error**2)))


def progress_rmse(recovered: RecoveredMotion, clip: Clip) -> float:
    error = recovered.progress - (clip.station - clip.station[0])
    return float(np.sqrt(np.nanmean(error**2)))


def normalised_progress_rmse(recovered: RecoveredMotion, clip: Clip) -> float:
    way = clip.station - clip.station[0]
    return float(np.sqrt(np.mean((recovered.normalised_path[:, 0] - way / way[-1]) ** 2)))
