"""Samples of confirmed pixels: place, size and orientation of the Gaussians."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.reconstruction.camera import pixel_rays

COARSE = 4
"""Side of the blocks that become one Gaussian where picture and surface are even [px]."""
EVEN = 16
"""Largest difference of smoothed pixel values within an even block, of 255 [1]."""
ONE_SURFACE = 2.0
"""Largest difference of disparity within an even block [px]."""
COVERAGE = 0.72
"""Standard deviation of a Gaussian in its picture, as a share of the distance to its neighbours [1]."""
THICKNESS = 0.2
"""Standard deviation along the normal, as a share of the smaller one across [1]."""


@dataclass(frozen=True, kw_only=True)
class Surfels:
    """Samples of surfaces, each from the picture that shows it largest.

    Parameters
    ----------
    rays : float64 [N, 3] from the camera to the sample, in camera coordinates with z = 1 [1]
    depth : float64 [N] camera z [m]
    normals : float64 [N, 3] camera coordinates, facing the camera [1]
    radiance : float32 [N, 3] linear light [1]
    spacing : float64 [N] distance to the neighbours in the picture [px]
    """

    rays: NDArray[np.float64]
    depth: NDArray[np.float64]
    normals: NDArray[np.float64]
    radiance: NDArray[np.float32]
    spacing: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.depth)


def sample_picture(
    wanted: NDArray[np.bool_],
    depth: NDArray[np.float32],
    normals: NDArray[np.float32],
    picture: NDArray[np.uint8],
    radiance: NDArray[np.float32],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    spacing: int,
) -> Surfels:
    """Sample the wanted pixels of one picture: on a fine grid, and more coarsely where all is even.

    Parameters
    ----------
    wanted : bool [H, W] pixels that this picture shows best
    depth : float32 [H, W] camera z [m]
    normals : float32 [H, W, 3] camera coordinates [1]
    picture : uint8 [H, W, 3] as taken [1]
    radiance : float32 [H, W, 3] linear light after exposure compensation [1]
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]
    spacing : side of the fine grid's cells [px]
    """
    rays = pixel_rays(depth.shape, intrinsics)
    disparity = np.where(wanted, disparity_scale / depth, 0)
    smooth = cv2.blur(picture.max(axis=2), (3, 3)).astype(np.int64)
    even = np.logical_and.reduce(_view_blocks(wanted, COARSE), axis=(1, 3))
    for values, limit in ((smooth, EVEN), (disparity, ONE_SURFACE)):
        cells = _view_blocks(values, COARSE)
        even &= cells.max(axis=(1, 3)) - cells.min(axis=(1, 3)) <= limit
    in_even = np.zeros(wanted.shape, dtype=np.bool_)
    _view_blocks(in_even, COARSE)[...] = even[:, None, :, None]

    parts = []
    for cell, chosen in ((COARSE, even), (spacing, None)):
        # A cell is represented by its middle; its depth and normal are those of the pixel beside it.
        middle = (
            _view_blocks(wanted & ~in_even, cell)[:, cell // 2, :, cell // 2] if chosen is None else chosen
        )
        rows, columns = (cell * k + cell // 2 for k in np.nonzero(middle))
        shift = 0.5 if cell % 2 == 0 else 0.0
        parts.append(Surfels(
            rays=rays[rows, columns] - shift * np.append(1 / intrinsics[[0, 1], [0, 1]], 0),
            depth=depth[rows, columns].astype(np.float64),
            normals=normals[rows, columns].astype(np.float64),
            radiance=_view_blocks(radiance, cell).mean(axis=(1, 3))[middle],
            spacing=np.full(len(rows), float(cell)),
        ))  # fmt: skip
    return join_samples(parts)


def _view_blocks(values: NDArray[Any], side: int) -> NDArray[Any]:
    """Return [H, W, ...] viewed as [H / side, side, W / side, side, ...], without the rest at the far edges."""
    rows, columns = (n // side for n in values.shape[:2])
    cut = values[: rows * side, : columns * side]
    shape, strides = cut.shape, cut.strides
    return np.lib.stride_tricks.as_strided(
        cut,
        (rows, side, columns, side, *shape[2:]),
        (side * strides[0], strides[0], side * strides[1], strides[1], *strides[2:]),
    )


def join_samples(parts: list[Surfels]) -> Surfels:
    """Concatenate the samples."""
    names = ("rays", "depth", "normals", "radiance", "spacing")
    return Surfels(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def derive_discs(
    rays: NDArray[np.float64],
    depth: NDArray[np.float64],
    normals: NDArray[np.float64],
    spacing: NDArray[np.float64],
    focal_length: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return axes and standard deviations of discs in the surface whose picture is round.

    In the camera that took the sample, the disc's picture is a Gaussian of standard deviation
    ``COVERAGE * spacing``.

    Parameters
    ----------
    rays : float64 [N, 3] camera coordinates with z = 1 [1]
    depth : float64 [N] camera z [m]
    normals : float64 [N, 3] unit normals, camera coordinates, facing the camera [1]
    spacing : float64 [N] distance to the neighbours in the picture [px]
    focal_length : of the camera [px]

    Returns
    -------
    rotation : float64 [N, 3, 3] local axes as columns, camera coordinates: the longest, the one across, the normal
    scales : float64 [N, 3] standard deviations [m]
    """
    # Motion of the surface point per pixel to the right and per pixel down.
    along = (rays * normals).sum(axis=1, keepdims=True)
    unit = depth[:, None] / focal_length
    right = unit * (np.array([1.0, 0, 0]) - rays * normals[:, :1] / along)
    down = unit * (np.array([0, 1.0, 0]) - rays * normals[:, 1:2] / along)
    # Principal axes of [right, down] in closed form.
    rr, dd, rd = (right * right).sum(axis=1), (down * down).sum(axis=1), (right * down).sum(axis=1)
    angle = 0.5 * np.arctan2(2 * rd, rr - dd)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    first, second = cosine * right + sine * down, cosine * down - sine * right
    lengths = np.stack([np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)], axis=1)
    first = first / lengths[:, :1]
    rotation = np.stack([first, np.cross(normals, first), normals], axis=-1)
    sigma = COVERAGE * spacing[:, None] * lengths
    return rotation, np.concatenate([sigma, THICKNESS * sigma.min(axis=1, keepdims=True)], axis=1)
