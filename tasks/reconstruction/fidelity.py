"""How near a picture is to another: peak signal-to-noise ratio and structural similarity."""

import cv2
import numpy as np
from numpy.typing import NDArray

WINDOW, SIGMA = 11, 1.5
"""Side [px] and standard deviation [px] of the window of structural similarity."""
C1, C2 = 0.01**2, 0.03**2
"""Stabilising constants for pictures from 0 to 1 [1]."""


def psnr(
    picture: NDArray[np.floating], reference: NDArray[np.floating], mask: NDArray[np.bool_] | None = None
) -> float:
    """Peak signal-to-noise ratio [dB] of pictures from 0 to 1; NaN over an empty mask.

    Parameters
    ----------
    picture, reference : [H, W, 3] display values [1]
    mask : bool [H, W] pixels that count; None for all
    """
    error = (picture - reference).astype(np.float64) ** 2
    if mask is not None:
        error = error[mask]
    return float(-10 * np.log10(error.mean())) if error.size else float("nan")


def ssim_map(picture: NDArray[np.floating], reference: NDArray[np.floating]) -> NDArray[np.float64]:
    """Structural similarity of the grey pictures, per pixel (Wang et al. 2004, doi:10.1109/TIP.2003.819861).

    Parameters
    ----------
    picture, reference : [H, W, 3] display values from 0 to 1 [1]

    Returns
    -------
    float64 [H, W] [1]
    """
    a, b = picture.astype(np.float64).mean(axis=2), reference.astype(np.float64).mean(axis=2)
    mean_a, mean_b = _blur(a), _blur(b)
    var_a, var_b = _blur(a * a) - mean_a**2, _blur(b * b) - mean_b**2
    covariance = _blur(a * b) - mean_a * mean_b
    numerator = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
    return numerator / ((mean_a**2 + mean_b**2 + C1) * (var_a + var_b + C2))


def _blur(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return cv2.GaussianBlur(values, (WINDOW, WINDOW), SIGMA, borderType=cv2.BORDER_REFLECT)
