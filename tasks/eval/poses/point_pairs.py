"""Points seen in two frames without depth: the corners of each frame, tracked into the other."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.corners import Tracks, even_contrast, track_corners
from tasks.eval.poses.epipolar import fit_rotation
from tasks.eval.poses.rigid import Floats, invert_pose, viewing_rays
from tasks.eval.poses.warp import bilinear_taps, view_from, warp_map

Picture = tuple[NDArray[np.uint8], NDArray[np.float32]]
"""Grey levels [H, W] [1] and the corners in them [N, 2] [px]."""


class Tracker(NamedTuple):
    """How corners are tracked: `window` [px], `levels` [1] and `forward_backward` [px] as `track_corners` takes them.

    With a `least_contrast` [1], `even_contrast` evens a picture and the view that it is held against, so that
    patches of one surface are evened alike however much nearer it came; without one, pictures stay as they are.
    """

    window: int
    levels: int
    forward_backward: float
    least_contrast: float | None = None


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
    earlier: Picture,
    later: Picture,
    inverse_depth: NDArray[np.float32],
    predicted: Floats,
    K: Floats,
    tracker: Tracker,
) -> PointPairs:
    """Track the corners of both frames, each into the other picture warped to its own camera.

    The depth hardly changes from one frame to the next, so the earlier frame's depth serves for both views.

    Parameters
    ----------
    earlier, later : the two pictures
    inverse_depth : float32 [H, W] a guess for every pixel of the earlier picture; 0 if unknown
    predicted : float64 [4, 4] pose of the later camera in the earlier one, in that guess's unit
    K : float64 [3, 3] intrinsics [px]
    tracker : how the corners are tracked
    """
    (grey, corners), (later_grey, later_corners) = earlier, later
    to_later = warp_map(inverse_depth, invert_pose(predicted), K)
    ahead, kept = _track_into_view(grey, view_from(later_grey, to_later), corners, tracker)
    seen_later, inside = _sample_map(to_later, ahead)
    kept &= inside
    to_earlier = warp_map(inverse_depth, predicted, K)
    behind, later_kept = _track_into_view(later_grey, view_from(grey, to_earlier), later_corners, tracker)
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


def correct_turn(
    earlier: Picture,
    later: NDArray[np.uint8],
    inverse_depth: NDArray[np.float32],
    predicted: Floats,
    K: Floats,
    tracker: Tracker,
    fewest: int,
    near: float,
) -> Floats:
    """Return a predicted pose, turned as the earlier frame's corners show where it is far off.

    An evened picture has no gradient wider than a patch, so that a tracker finds little in it that has moved by
    several pixels. Here it reads grey levels as they are, which reach further and need not be precise.

    Parameters
    ----------
    earlier, later : the two pictures at half the resolution, and the corners at the full one
    inverse_depth, predicted, K : as `track_pairs` takes them, at the full resolution
    tracker : how the corners are tracked at half the resolution
    fewest : tracked corners below which the prediction is kept [1]
    near : median distance between predicted and tracked corners up to which it is kept [px]
    """
    half = K * np.array([[0.5], [0.5], [1.0]])
    where = warp_map(inverse_depth[::2, ::2], invert_pose(predicted), half)
    corners = earlier[1] * np.float32(0.5)
    tracks = _track_into_view(earlier[0], view_from(later, where), corners, tracker)
    seen, inside = _sample_map(where, tracks.places)
    kept = tracks.came_back & inside
    if kept.sum() < fewest:
        return predicted
    expected, seen = _sample_map(where, corners)[0][kept], seen[kept]
    if 2 * np.median(np.linalg.norm(seen - expected, axis=-1)) <= near:
        return predicted
    turn = np.eye(4)
    turn[:3, :3], _ = fit_rotation(viewing_rays(expected, half), viewing_rays(seen, half), float(half[0, 0]))
    return predicted @ invert_pose(turn)


def _track_into_view(
    grey: NDArray[np.uint8], view: NDArray[np.uint8], corners: NDArray[np.float32], tracker: Tracker
) -> Tracks:
    window, levels, forward_backward, least = tracker
    if least is not None:
        grey, view = even_contrast(grey, window, least), even_contrast(view, window, least)
    return track_corners(grey, view, corners, window, levels, forward_backward)


def _sample_map(where: NDArray[np.float32], at: NDArray[np.float32]) -> tuple[Floats, NDArray[np.bool_]]:
    taps, weights, inside = bilinear_taps(at, where.shape[:2])
    return (weights[..., None] * where[taps]).sum(axis=0), inside
