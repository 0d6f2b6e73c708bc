"""Image statistics that should grow with the precipitation rate, ranked against it.

They replace a learned judge, whose weights are not available. They are no perceptual scores.
"""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

SAMPLED_FRAMES = 16
"""Frames of a clip that are evaluated, evenly spread (as in the paper's Section 4.3) [1]."""
DARK_WINDOW = 15
"""Side of the dark channel's window (He et al. 2011, DOI 10.1109/TPAMI.2010.168) [px]."""
SPECULAR = 0.85
"""Luma from which a road pixel counts as a highlight [1]."""


def sampled_frames(count: int) -> NDArray[np.int64]:
    """Return the numbers of the frames that are evaluated, evenly spread from the first to the last."""
    return np.unique(np.linspace(0, count - 1, min(SAMPLED_FRAMES, count)).astype(np.int64))


def measure_image(frames: NDArray[np.uint8], road: NDArray[np.bool_]) -> dict[str, float]:
    """Means over the sampled frames of a clip.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB [1]
    road : bool [F, H, W] road pixels [1]

    Returns
    -------
    dark_channel, contrast, road_brightness, road_saturation, specular_share, particle_energy [1]
    """
    rows = []
    for k in sampled_frames(len(frames)):
        picture = frames[k].astype(np.float32) / 255
        luma = picture @ np.array([0.299, 0.587, 0.114], np.float32)
        kernel = np.ones((DARK_WINDOW, DARK_WINDOW), np.uint8)
        there = road[k]
        shade, colour = luma[there], picture[there]
        top = colour.max(axis=1) if there.any() else np.zeros(1)
        low = colour.min(axis=1) if there.any() else np.zeros(1)
        fine = luma - cv2.medianBlur((luma * 255).astype(np.uint8), 5).astype(np.float32) / 255
        rows.append(
            {
                "dark_channel": float(cv2.erode(picture.min(axis=2), kernel).mean()),
                "contrast": float(luma.std()),
                "road_brightness": float(shade.mean()) if there.any() else np.nan,
                "road_saturation": float(np.mean((top - low) / np.maximum(top, 1e-3))),
                "specular_share": float(np.mean(shade > SPECULAR)) if there.any() else np.nan,
                "particle_energy": float(np.mean(fine[~there] ** 2)) if (~there).any() else np.nan,
            }
        )
    return {name: float(np.nanmean([row[name] for row in rows])) for name in rows[0]}


def severity_agreement(rates: Mapping[str, float], values: Mapping[str, float]) -> tuple[float, float]:
    """Spearman's rank correlation of a statistic with the rate, and the share of adjacent levels in its order.

    Parameters
    ----------
    rates : precipitation of each clip [mm/h]
    values : the statistic of each clip, by the same keys [1]

    Returns
    -------
    Signed rank correlation [1], and accuracy between neighbours in the direction of its sign [1].
    """
    keys = sorted(rates, key=lambda key: rates[key])
    x = np.array([values[key] for key in keys])
    if np.ptp(x) == 0:
        return 0.0, 0.0
    rho = float(spearmanr([rates[key] for key in keys], x).statistic)
    return rho, float(np.mean(np.diff(x) * (1.0 if rho >= 0 else -1.0) > 0))
