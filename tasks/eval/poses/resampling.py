"""Pictures as a pose check takes them: undistorted to a pinhole by OpenCV, and where that loses nothing, half as wide.

Motion is a matter of many pixels. The code is the judges' own.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.eval.poses.checks import JudgeCamera
from tasks.eval.poses.rigid import Floats

COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3")
"""Of Brown and Conrady, in the order in which OpenCV takes them."""
ONE_SURFACE = np.float32(0.1)
"""Spread of inverse depth by its mean up to which four pixels show one surface [1]."""


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


def halve_camera(camera: JudgeCamera) -> JudgeCamera:
    """Return the camera of `halve_frames`: its pixels are as large as four, and its rows as late as two."""
    K = camera.K.copy()
    K[:2] /= 2
    K[:2, 2] -= 0.25  # pixel centres are whole numbers: the first pixel's lies between those of 0 and 1
    return replace(camera, K=K, line_delay_s=2 * camera.line_delay_s)


def halve_frames(buffers: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return pinhole pictures of which each pixel stands for two by two; an odd last row or column is left out.

    Parameters
    ----------
    buffers : ``rgb`` uint8 [F, H, W, 3], ``depth`` float32 [F, H, W] camera z [m] and ``class`` uint8 [F, H, W]

    Returns
    -------
    The mean colours, the inverse of the mean inverse depth where four pixels show one surface and NaN elsewhere, and
    the class of the upper left pixel.
    """
    count, height, width = buffers["depth"].shape
    size = count, height // 2, width // 2
    even = slice(None), slice(size[1] * 2), slice(size[2] * 2)
    rgb, depth = np.empty((*size, 3), np.uint8), np.empty(size, np.float32)
    for frame, picture in enumerate(buffers["rgb"][even]):
        cv2.resize(picture, size[:0:-1], dst=rgb[frame], interpolation=cv2.INTER_AREA)
    _halve_depth(buffers["depth"], depth)
    return {"rgb": rgb, "depth": depth, "class": buffers["class"][even][:, ::2, ::2].copy()}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _halve_depth(depth, halved):  # type: ignore[no-untyped-def]
    for k in range(halved.shape[0]):
        for i in range(halved.shape[1]):
            for j in range(halved.shape[2]):
                a, b = 1 / depth[k, 2 * i, 2 * j], 1 / depth[k, 2 * i, 2 * j + 1]
                c, d = 1 / depth[k, 2 * i + 1, 2 * j], 1 / depth[k, 2 * i + 1, 2 * j + 1]
                mean = (a + b + c + d) / np.float32(4)
                spread = max(max(a, b), max(c, d)) - min(min(a, b), min(c, d))
                # a comparison with NaN, of a pixel without depth, is false
                together = (mean > 0) & (spread < ONE_SURFACE * mean)
                halved[k, i, j] = np.float32(1) / mean if together else np.float32(np.nan)
