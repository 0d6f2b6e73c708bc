"""Corners spread over a picture, and their tracks from one picture to another."""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray


class Tracks(NamedTuple):
    """Where corners were found in another picture: places float32 [N, 2] [px], and bool [N] whether they came back."""

    places: NDArray[np.float32]
    came_back: NDArray[np.bool_]


def corner_strength(grey: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the smaller eigenvalue of the structure tensor at each pixel of a grey picture [H, W] [1]
    (Shi and Tomasi 1994, DOI 10.1109/CVPR.1994.323794)."""
    return cv2.cornerMinEigenVal(grey, blockSize=5)


def least_strength(strength: NDArray[np.float32], quality: float) -> float:
    """Return that share of the 95th percentile of a picture's corner strength [H, W] [1]."""
    return quality * float(np.percentile(strength, 95))


GREY_LEVELS_A_DEVIATION = 40
"""Grey levels for one standard deviation of a patch: 3.2 of them fit into eight bits on either side [1]."""


def even_contrast(grey: NDArray[np.uint8], window: int, least: float) -> NDArray[np.uint8]:
    """Return a picture [H, W] whose patches all have one mean and one contrast [1].

    A surface that comes nearer loses veil, so that it darkens under a bright sky. Where its outline stands before the
    sky a tracker that takes grey levels as constant reads this as motion, always towards the sky.

    Parameters
    ----------
    grey : uint8 [H, W] grey levels [1]
    window : side of the tracked patches, which are also those that are evened [px]
    least : standard deviation to which that of a flat patch is raised, so that its noise stays noise, 8-bit [1]
    """
    level = grey.astype(np.float32)
    mean = cv2.blur(level, (window, window))
    variance = np.maximum(cv2.blur(level * level, (window, window)) - mean * mean, 0.0)
    evened = 128 + GREY_LEVELS_A_DEVIATION * (level - mean) / np.sqrt(variance + least**2)
    return np.clip(np.rint(evened), 0, 255).astype(np.uint8)


def cell_size(width: int, cells_across: int) -> int:
    """Return the side of the grid cells over a picture of that width [px]."""
    return max(width // cells_across, 4)


def grid_corners(
    strength: NDArray[np.float32],
    cells_across: int,
    margin: int,
    least: float,
    hidden: NDArray[np.bool_] | None = None,
) -> NDArray[np.int64]:
    """Return the strongest corner of each grid cell.

    Parameters
    ----------
    strength : float32 [H, W] corner strength [1]
    cells_across : cells over the picture's width, none smaller than 4 px [1]
    margin : least distance from the picture's edge [px]
    least : strength from which on a corner counts [1]
    hidden : bool [H, W] pixels that may not be chosen [1]

    Returns
    -------
    int64 [N, 2] x, y [px]
    """
    cell = cell_size(strength.shape[1], cells_across)
    allowed = strength if hidden is None else np.where(hidden, np.float32(0), strength)
    rows, columns = (n // cell for n in strength.shape)
    cells = allowed[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell).swapaxes(1, 2)
    best = cells.reshape(rows, columns, cell * cell).argmax(axis=-1)
    i, j = np.indices(best.shape)
    y, x = (i * cell + best // cell).ravel(), (j * cell + best % cell).ravel()
    inside = (
        (y >= margin) & (y < strength.shape[0] - margin) & (x >= margin) & (x < strength.shape[1] - margin)
    )
    good = inside & (allowed[y, x] > least)
    return np.stack([x[good], y[good]], axis=-1)


def track_corners(
    earlier: NDArray[np.uint8],
    later: NDArray[np.uint8],
    corners: NDArray[np.float32],
    window: int,
    levels: int,
    forward_backward: float,
) -> Tracks:
    """Track corners to another picture and back (Lucas and Kanade, in pyramids; Kalal et al. 2010,
    DOI 10.1109/ICPR.2010.675, for the track back).

    Parameters
    ----------
    earlier, later : uint8 [H, W] grey pictures [1]
    corners : float32 [N, 2] x, y in the earlier picture [px]
    window : side of the patches [px]
    levels : pyramid levels above full resolution [1]
    forward_backward : largest distance between a corner and its track there and back [px]

    Returns
    -------
    Places in the later picture; none depends on the other corners.
    """
    if not len(corners):
        return Tracks(np.empty((0, 2), np.float32), np.empty(0, bool))
    options: dict[str, Any] = {
        "winSize": (window, window),
        "maxLevel": levels,
        "criteria": (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.003),
    }
    there, found, _ = cv2.calcOpticalFlowPyrLK(earlier, later, corners, None, **options)
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(later, earlier, there, None, **options)
    returned = np.linalg.norm(back - corners, axis=-1) < forward_backward
    return Tracks(there, (found.ravel() == 1) & (found_back.ravel() == 1) & returned)


def merge_tracks(in_first: NDArray[np.bool_], first: Tracks, second: Tracks) -> Tracks:
    """Return the tracks of corners that were tracked in two lots, in the order of the corners.

    Parameters
    ----------
    in_first : bool [N] corners of the first lot; the others are those of the second [1]
    first, second : tracks of either lot
    """
    merged = Tracks(np.empty((len(in_first), 2), np.float32), np.empty(len(in_first), bool))
    for lot, tracks in ((in_first, first), (~in_first, second)):
        merged.places[lot], merged.came_back[lot] = tracks
    return merged
