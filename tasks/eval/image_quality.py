"""Full-reference picture quality: PSNR and SSIM, over the whole picture or a region of it."""

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError

WINDOW, SIGMA, K1, K2 = 11, 1.5, 0.01, 0.03
"""Gaussian window [px], its standard deviation [px] and the stabilisers [1] of Wang et al. 2004."""


def psnr(
    reference: NDArray[np.uint8], picture: NDArray[np.uint8], region: NDArray[np.bool_] | None = None
) -> float:
    """Return the peak signal-to-noise ratio over all channels of a region.

    Parameters
    ----------
    reference, picture : uint8 [H, W, 3] or [H, W] [1]
    region : bool [H, W] pixels that count; all if None [1]

    Returns
    -------
    [dB]; infinite for equal pictures

    Raises
    ------
    InputError
        If the shapes or types differ, or the region is empty.
    """
    _check_pair(reference, picture, region)
    error = reference.astype(np.float64) - picture
    mean_square = float(np.mean(error**2 if region is None else error[region] ** 2))
    return float("inf") if mean_square == 0 else float(10 * np.log10(255.0**2 / mean_square))


def ssim(
    reference: NDArray[np.uint8], picture: NDArray[np.uint8], region: NDArray[np.bool_] | None = None
) -> float:
    """Return the mean structural similarity of luma over a region (Wang et al. 2004, DOI 10.1109/TIP.2003.819861).

    Only windows that lie wholly inside the picture count, as in the authors' own code; a window counts
    for the region that holds its centre.

    Parameters
    ----------
    reference, picture : uint8 [H, W, 3] sRGB or [H, W] grey, at least 11 x 11 [1]
    region : bool [H, W] pixels that count; all if None [1]

    Returns
    -------
    [1]; 1 for equal pictures

    Raises
    ------
    InputError
        If the shapes or types differ, the picture is smaller than the window, or the region holds no
        whole window's centre.
    """
    _check_pair(reference, picture, region)
    edge = WINDOW // 2
    if min(reference.shape[:2]) < WINDOW:
        raise InputError(f"SSIM needs at least {WINDOW} x {WINDOW} px, got {reference.shape[:2]}.")
    similarity = _ssim_map(_luma(reference), _luma(picture))[edge:-edge, edge:-edge]
    if region is None:
        return float(similarity.mean())
    inner = region[edge:-edge, edge:-edge]
    if not inner.any():
        raise InputError(f"SSIM needs a region that reaches {edge} px or more inside the picture.")
    return float(similarity[inner].mean())


def _ssim_map(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Wang et al. 2004, eq. 13, at each pixel."""

    def local_mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return cv2.GaussianBlur(values, (WINDOW, WINDOW), SIGMA)

    C1, C2 = (K1 * 255) ** 2, (K2 * 255) ** 2
    mu_x, mu_y = local_mean(x), local_mean(y)
    var_x, var_y = local_mean(x * x) - mu_x**2, local_mean(y * y) - mu_y**2
    cov = local_mean(x * y) - mu_x * mu_y
    return (2 * mu_x * mu_y + C1) * (2 * cov + C2) / ((mu_x**2 + mu_y**2 + C1) * (var_x + var_y + C2))


def _luma(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    """ITU-R BT.601 luma, not rounded [1]."""
    if picture.ndim == 2:
        return picture.astype(np.float64)
    return picture @ np.array([0.299, 0.587, 0.114])


def _check_pair(
    reference: NDArray[np.uint8], picture: NDArray[np.uint8], region: NDArray[np.bool_] | None
) -> None:
    problems = []
    for name, array in (("reference", reference), ("picture", picture)):
        if array.dtype != np.uint8 or array.ndim not in (2, 3):
            problems.append(f"The {name} must be uint8 [H, W] or [H, W, 3], got {array.dtype} {array.shape}.")
    if reference.shape != picture.shape:
        problems.append(f"Both pictures must have one shape, got {reference.shape} and {picture.shape}.")
    if region is not None and (region.shape != reference.shape[:2] or region.dtype != np.bool_):
        problems.append(f"The region must be bool {reference.shape[:2]}, got {region.dtype} {region.shape}.")
    elif region is not None and not region.any():
        problems.append("The region must hold at least one pixel.")
    if problems:
        raise InputError(problems)
