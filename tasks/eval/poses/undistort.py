"""Undistortion of pictures to a pinhole, by OpenCV: the judges' own code."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.eval.poses.rigid import Floats

COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3")
"""Of Brown and Conrady, in the order in which OpenCV takes them."""


def undistort_frames(
    buffers: Mapping[str, NDArray[Any]], K: Floats, distortion: Floats | None
) -> dict[str, NDArray[Any]]:
    """Resample frames to the pinhole of the same intrinsics and size.

    Parameters
    ----------
    buffers : ``rgb`` uint8 [F, H, W, 3], ``depth`` float32 [F, H, W] camera z [m] and ``class`` uint8 [F, H, W], any
        of them. z is not changed: a lens changes the place of a ray in the picture, not the point that it meets
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    distortion : float64 [5] `COEFFICIENTS` [1]; None for a pinhole

    Returns
    -------
    The same arrays for a pinhole; else colours bilinear, inverse depth bilinear (exact on planes), the class of the
    nearest pixel. Pixels outside the lens's picture have no depth and class 0.
    """
    if distortion is None:
        return dict(buffers)
    height, width = next(iter(buffers.values())).shape[1:3]
    across, down = cv2.initUndistortRectifyMap(K, distortion, None, K, (width, height), cv2.CV_32FC1)
    seen: dict[str, NDArray[Any]] = {}
    for name, frames in buffers.items():
        if name == "rgb":
            pictures = [
                cv2.remap(f, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) for f in frames
            ]
        elif name == "depth":
            pictures = [_undistort_depth(f, across, down) for f in frames]
        elif name == "class":
            pictures = [cv2.remap(f, across, down, cv2.INTER_NEAREST) for f in frames]
        else:
            raise InputError(f"undistortion: only rgb, depth and class can be resampled; {name} is asked for")
        seen[name] = np.stack(pictures)
    return seen


def _undistort_depth(
    depth: NDArray[np.generic], across: NDArray[np.float32], down: NDArray[np.float32]
) -> NDArray[np.float32]:
    there = np.isfinite(depth)
    inverse = np.divide(1, depth, out=np.zeros(depth.shape, np.float32), where=there)
    inverse = cv2.remap(inverse, across, down, cv2.INTER_LINEAR)
    whole = cv2.remap(there.astype(np.uint8), across, down, cv2.INTER_NEAREST) > 0
    return np.divide(1, inverse, out=np.full_like(inverse, np.nan), where=whole & (inverse > 0))
