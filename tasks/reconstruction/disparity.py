"""Sub-pixel disparity by semi-global matching, kept where both views agree."""

import cv2
import numpy as np
from numpy.typing import NDArray

BLOCK = 5
"""Side of the matching window [px]."""
SHARPENING_WINDOW, SHARPENING_STEPS = 9, 2
"""Side of the window [px] and number of the steps that make the disparity sub-pixel [1]."""
SHARPENING_DAMPING = 4.0
"""Squared slope of the picture, in pixel values of 255, below which the steps shorten [px^-2]."""
LARGEST_LEAN = 0.5
"""Largest distance of the steps from the first match [px]."""


def match_stereo(left: NDArray[np.uint8], right: NDArray[np.uint8], disparities: int) -> NDArray[np.float32]:
    """Return sub-pixel disparity of the left picture, NaN where the right picture does not confirm the match.

    Semi-global matching over three paths (Hirschmueller, doi:10.1109/TPAMI.2007.1166) runs once for
    each view; a pixel stays when the two disparities differ by at most one pixel and its patch of
    similar disparity is larger than a speckle.

    Parameters
    ----------
    left, right : uint8 [H, W] or [H, W, 3] rectified pictures [1]
    disparities : range searched, a multiple of 16 [px]

    Returns
    -------
    float32 [H, W] disparity [px]
    """
    if left.ndim == 3:
        left, right = (cv2.cvtColor(np.ascontiguousarray(p), cv2.COLOR_RGB2GRAY) for p in (left, right))
    forward = _semi_global(left, right, disparities)
    backward = _semi_global(right[:, ::-1], left[:, ::-1], disparities)[:, ::-1]

    columns = np.arange(left.shape[1])
    partner = np.rint(columns - forward).astype(np.int64)
    seen = np.take_along_axis(backward, np.clip(partner, 0, len(columns) - 1), axis=1)
    agreed = (forward > 0) & (partner >= 0) & (np.abs(forward - seen) <= 1.0)

    speckles = np.where(agreed, forward * 16, 0).astype(np.int16)
    cv2.filterSpeckles(speckles, 0, 60, 32)
    confirmed = np.where(speckles > 0, forward, np.nan).astype(np.float32)
    return _refine_disparity(left, right, confirmed)


def _semi_global(left: NDArray[np.uint8], right: NDArray[np.uint8], disparities: int) -> NDArray[np.float32]:
    """Return the raw disparity [px]; the pictures are widened so that the left border is matched as well."""
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=disparities,
        blockSize=BLOCK,
        P1=8 * BLOCK * BLOCK,
        P2=32 * BLOCK * BLOCK,
        preFilterCap=31,
        disp12MaxDiff=-1,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    widened = [cv2.copyMakeBorder(p, 0, 0, disparities, 0, cv2.BORDER_REPLICATE) for p in (left, right)]
    return matcher.compute(*widened)[:, disparities:].astype(np.float32) / 16


def _refine_disparity(
    left: NDArray[np.uint8], right: NDArray[np.uint8], disparity: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Refine disparity by Gauss-Newton steps on the local squared difference of the pictures.

    Semi-global matching is biased towards whole pixels by up to a fifth of one. Lucas and Kanade's step
    (IJCAI 1981) within a window, on pictures without their local mean, removes that bias.
    """
    columns, rows = np.meshgrid(*(np.arange(n, dtype=np.float32) for n in left.shape[::-1]))
    window = (SHARPENING_WINDOW, SHARPENING_WINDOW)
    wanted, source = (p.astype(np.float32) for p in (left, right))
    wanted, source = wanted - cv2.blur(wanted, window), source - cv2.blur(source, window)
    slope = cv2.Sobel(source, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8)
    start = np.nan_to_num(disparity)
    found = start
    for _ in range(SHARPENING_STEPS):
        shown = cv2.remap(source, columns - found, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        gradient = cv2.remap(slope, columns - found, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        step = cv2.blur((shown - wanted) * gradient, window) / (
            cv2.blur(gradient * gradient, window) + SHARPENING_DAMPING
        )
        found = np.clip(found + step, start - LARGEST_LEAN, start + LARGEST_LEAN)
    return np.where(np.isnan(disparity), disparity, found)


def fill_disparity(disparity: NDArray[np.float32], background: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Fill unknown disparity with the farther of the neighbours left and right in the row.

    A surface that only one camera sees is mostly the background beside an object, so the farther
    neighbour is the better guess; at the picture's border the only neighbour is taken.

    Parameters
    ----------
    disparity : float32 [H, W] NaN where unknown [px]
    background : bool [H, W] sky: neither filled nor used as a neighbour
    """
    known = np.isfinite(disparity) & ~background
    columns = np.broadcast_to(np.arange(disparity.shape[1]), disparity.shape)
    before = np.maximum.accumulate(np.where(known, columns, -1), axis=1)
    after = np.minimum.accumulate(np.where(known, columns, disparity.shape[1])[:, ::-1], axis=1)[:, ::-1]
    neighbours = []
    for at, there in ((before, before >= 0), (after, after < disparity.shape[1])):
        value = np.take_along_axis(disparity, np.clip(at, 0, disparity.shape[1] - 1), axis=1)
        neighbours.append(np.where(there, value, np.inf))
    guess = np.minimum(*neighbours)
    return np.where(background | np.isfinite(disparity) | ~np.isfinite(guess), disparity, guess).astype(
        np.float32
    )
