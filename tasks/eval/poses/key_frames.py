"""Frames of the chain without depth: their pictures, their corners, and what is known of the depth of these."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.corners import (
    cell_size,
    corner_strength,
    even_contrast,
    grid_corners,
    least_strength,
)
from tasks.eval.poses.point_pairs import PointPairs
from tasks.eval.poses.rigid import Floats


@dataclass(frozen=True, kw_only=True)
class KeyFrame:
    """A frame against which later ones are placed.

    Parameters
    ----------
    index : the frame
    grey : uint8 [H, W] grey levels [1]
    evened : uint8 [H, W] the same with one mean and contrast of all patches [1]
    coarse : uint8 [H/2, W/2] the grey levels at half the resolution [1]
    corners : float32 [N, 2] x, y [px]
    depth : float64 [N] depth of the corners in the chain's unit [1]
    precision : float64 [N] its relative precision, up to a factor; 0 where the depth is unknown [1]
    inverse_depth : float32 [H, W] a guess for every pixel, in the chain's unit [1]
    """

    index: int
    grey: NDArray[np.uint8]
    evened: NDArray[np.uint8]
    coarse: NDArray[np.uint8]
    corners: NDArray[np.float32]
    depth: Floats
    precision: Floats
    inverse_depth: NDArray[np.float32]


def make_key_frame(
    index: int,
    rgb: NDArray[np.uint8],
    cells_across: int,
    corner_quality: float,
    window: int,
    least_contrast: float,
) -> KeyFrame:
    """Return a frame [H, W, 3] whose depth is not known yet.

    Parameters
    ----------
    index : the frame
    rgb : uint8 [H, W, 3] sRGB picture [1]
    cells_across, corner_quality, window, least_contrast : as of `tasks.eval.poses.essential.EssentialSettings`
    """
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    strength = corner_strength(grey)
    corners = grid_corners(strength, cells_across, window // 2, least_strength(strength, corner_quality))
    unknown = np.zeros(len(corners))
    return KeyFrame(
        index=index,
        grey=grey,
        evened=even_contrast(grey, window, least_contrast),
        coarse=cv2.pyrDown(grey),
        corners=corners.astype(np.float32),
        depth=unknown,
        precision=unknown,
        inverse_depth=np.zeros(grey.shape, np.float32),
    )


def give_depth(
    frame: KeyFrame, pairs: PointPairs, depth: Floats, precision: Floats, cells_across: int
) -> KeyFrame:
    """Return a frame with the depth that a step to it shows.

    Parameters
    ----------
    frame : the later one of the step
    pairs : the points of the step, of which the last ones are the frame's own corners
    depth, precision : float64 [N] of all points in the frame, as in `KeyFrame`
    cells_across : grid cells over the picture's width [1]
    """
    own = int(pairs.kept.sum())
    shown = precision > 0
    return replace(
        frame,
        depth=_scatter_values(depth[own:], pairs.later_kept),
        precision=_scatter_values(precision[own:], pairs.later_kept),
        inverse_depth=_spread_inverse_depth(
            pairs.later_pixels[shown], 1 / depth[shown], frame.grey.shape, cells_across
        ),
    )


def keep_sharper_depth(frame: KeyFrame, other: KeyFrame) -> KeyFrame:
    """Return a frame with, of each corner, the more precise one of two depths.

    Parameters
    ----------
    frame, other : the same frame after two steps to it, of which the first one's guess for every pixel is kept
    """
    sharper = other.precision > frame.precision
    return replace(
        frame,
        depth=np.where(sharper, other.depth, frame.depth),
        precision=np.where(sharper, other.precision, frame.precision),
    )


def _spread_inverse_depth(
    pixels: Floats, inverse_depth: Floats, shape: tuple[int, ...], cells_across: int
) -> NDArray[np.float32]:
    """Return a smooth guess of inverse depth for every pixel, by normalised convolution over the grid cells."""
    cell = cell_size(shape[1], cells_across)
    rows, columns = -(-shape[0] // cell), -(-shape[1] // cell)
    at = np.clip((pixels[:, ::-1] / cell).astype(np.int64), 0, [rows - 1, columns - 1])
    total, count = np.zeros((rows, columns)), np.zeros((rows, columns))
    np.add.at(total, tuple(at.T), inverse_depth)
    np.add.at(count, tuple(at.T), 1.0)
    near, far = ([cv2.GaussianBlur(a, (0, 0), width) for a in (total, count)] for width in (1.0, 6.0))
    # the wide blur only matters where no point lies near
    guess = (near[0] + 1e-3 * far[0]) / (near[1] + 1e-3 * far[1] + 1e-12)
    return cv2.resize(guess.astype(np.float32), (columns * cell, rows * cell))[: shape[0], : shape[1]]


def _scatter_values(values: Floats, where: NDArray[np.bool_]) -> Floats:
    spread = np.zeros(len(where))
    spread[where] = values
    return spread
