"""Points seen in two frames without depth: the corners of each frame, tracked into the other."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.corners import track_corners
from tasks.eval.poses.rigid import Floats, invert_pose, viewing_rays
from tasks.eval.poses.warp import bilinear_taps, view_from, warp_map

Picture = tuple[NDArray[np.uint8], NDArray[np.float32]]
"""Grey levels [H, W] [1] and the corners in them [N, 2] [px]."""


@dataclass(frozen=True, kw_only=True)
class PointPairs:
    """Points seen in two frames: first the earlier frame's corners, then the later frame's.

    Parameters
    ----------
    rays, later_rays : float64 [N, 3] directions in both cameras, z = 1 [1]
    pixels, later_pixels : float64 [N, 2] places in both pictures [px]
    kept, later_kept : which of the earlier and of the later frame's corners were tracked
    """

    rays: Floats
    later_rays: Floats
    pixels: Floats
    later_pixels: Floats
    kept: NDArray[np.bool_]
    later_kept: NDArray[np.bool_]


def track_pairs(
    earlier: Picture, later: Picture, inverse_depth: NDArray[np.float32], predicted: Floats, K: Floats,
    window: int, levels: int, forward_backward: float,
) -> PointPairs:  # fmt: skip
    """Track the corners of both frames, each into the other picture warped to its own camera.

    The depth hardly changes from one frame to the next, so the earlier frame's depth serves for both views.

    Parameters
    ----------
    earlier, later : the two pictures
    inverse_depth : float32 [H, W] a guess for every pixel of the earlier picture; 0 if unknown
    predicted : float64 [4, 4] pose of the later camera in the earlier one, in that guess's unit
    K : float64 [3, 3] intrinsics [px]
    window, levels, forward_backward : as `track_corners` takes them
    """
    tracker = (window, levels, forward_backward)
    (grey, corners), (later_grey, later_corners) = earlier, later
    to_later = warp_map(inverse_depth, invert_pose(predicted), K)
    ahead, kept = track_corners(grey, view_from(later_grey, to_later), corners, *tracker)
    seen_later, inside = _sample_map(to_later, ahead)
    kept &= inside
    to_earlier = warp_map(inverse_depth, predicted, K)
    behind, later_kept = track_corners(later_grey, view_from(grey, to_earlier), later_corners, *tracker)
    seen_earlier, inside = _sample_map(to_earlier, behind)
    later_kept &= inside
    pixels = np.concatenate([corners[kept], seen_earlier[later_kept]])
    later_pixels = np.concatenate([seen_later[kept], later_corners[later_kept]])
    return PointPairs(
        rays=viewing_rays(pixels, K),
        later_rays=viewing_rays(later_pixels, K),
        pixels=pixels,
        later_pixels=later_pixels,
        kept=kept,
        later_kept=later_kept,
    )


def _sample_map(where: NDArray[np.float32], at: NDArray[np.float32]) -> tuple[Floats, NDArray[np.bool_]]:
    taps, weights, inside = bilinear_taps(at, where.shape[:2])
    return (weights[..., None] * where[taps]).sum(axis=0), inside
