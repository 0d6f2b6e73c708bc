"""Exposure of each picture, from surfaces that several pictures show."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.reconstruction.camera import pixel_rays
from tasks.reconstruction.pose_correction import FRAME_GAPS
from tasks.render.composition import to_display, to_linear

STRIDE = 6
"""Distance between compared pixels [px]."""
DARKEST, BRIGHTEST = 12, 245
"""Pixel values outside are noise or clipped [1]."""
MATCHED = 1.0
"""Largest difference between predicted and measured disparity of one surface [px]."""
SPREAD = 0.05
"""Deviation of log ratios above which they count less and less [1]."""
PRIOR = 0.1
"""Weight, against one pixel's, of the pull of every unknown towards 0 [1]."""
ROBUST_ROUNDS = 8


_LINEAR = to_linear(np.arange(256, dtype=np.float32) / np.float32(255))


@dataclass(frozen=True, kw_only=True)
class Exposure:
    """A surface of radiance L has the linear pixel value ``gain * falloff(pixel) * L``.

    Parameters
    ----------
    gains : float64 [F] per picture, geometric mean 1 over the training pictures [1]
    falloff : float32 [H, W] lens shading, 1 on the optical axis [1]
    """

    gains: NDArray[np.float64]
    falloff: NDArray[np.float32]

    def to_radiance(self, picture: NDArray[np.uint8], frame: int) -> NDArray[np.float32]:
        """Return the scene radiance of an sRGB-encoded picture [H, W, 3] taken as ``frame`` [1]."""
        return _LINEAR[picture] / (np.float32(self.gains[frame]) * self.falloff[..., None])

    def to_picture(self, radiance: NDArray[np.float32], frame: int) -> NDArray[np.float32]:
        """Return display values 0 to 1 of the radiance [H, W, 3] at the exposure of ``frame`` [1]."""
        exposed = radiance * (np.float32(self.gains[frame]) * self.falloff[..., None])
        return to_display(exposed)


def estimate_exposure(
    pictures: NDArray[np.uint8],
    disparity: NDArray[np.float32],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    T_world_camera: NDArray[np.float64],
    training: NDArray[np.int64],
) -> Exposure:
    """Estimate gains of all pictures and the lens's radial falloff from surfaces that two pictures show.

    The logarithms of corresponding pixel values differ by the difference of log gains plus
    ``a (r2^2 - r1^2) + b (r2^4 - r1^4) + c log(z1 / z2)``, r the distance from the principal point over
    the focal length and z the depth. On a forward drive every surface moves outward and nearer, where the lens shades
    more and the view is steeper; without a, b and c the fit would explain this by an exposure that keeps falling. All
    pairs of training pictures are fitted at once by reweighted least squares. Other pictures are not read: their gain
    is interpolated between the neighbouring training ones.

    Parameters
    ----------
    pictures : uint8 [F, H, W] grey left pictures, sRGB-encoded [1]
    disparity : float32 [F, H, W] disparity of the training frames [px]
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]
    T_world_camera : float64 [F, 4, 4] camera poses
    training : int [T] numbers of the training frames, ascending [1]
    """
    size = pictures.shape[1:]
    radius2 = (pixel_rays(size, intrinsics)[..., :2] ** 2).sum(axis=-1)
    blurred = {int(i): cv2.GaussianBlur(pictures[i], (0, 0), 2.0) for i in training}
    calm = {i: _calm_above_horizon(pictures[i], intrinsics) for i in blurred}
    count = len(training)
    pairs = []
    for gap in FRAME_GAPS:
        for n in range(count - gap):
            i, j = int(training[n]), int(training[n + gap])
            relative = np.linalg.inv(T_world_camera[j]) @ T_world_camera[i]
            near = pair_pixels(disparity[i], disparity[j], intrinsics, disparity_scale, relative)
            far = pair_directions(calm[i], calm[j], intrinsics, relative)
            here, there = (
                tuple(np.concatenate(a) for a in zip(near[k], far[k], strict=True)) for k in (0, 1)
            )
            nearing = np.log(disparity[j][near[1]] / disparity[i][near[0]])
            nearing = np.concatenate([nearing, np.zeros(len(far[0][0]))])
            first, second = blurred[i][here], blurred[j][there]
            usable = (np.minimum(first, second) > DARKEST) & (np.maximum(first, second) < BRIGHTEST)
            ratio = np.log(_LINEAR[second[usable]] / _LINEAR[first[usable]])
            r1, r2 = radius2[here][usable], radius2[there][usable]
            pairs.append((n, n + gap, ratio, np.stack([r2 - r1, r2**2 - r1**2, nearing[usable]], axis=1)))

    x: NDArray[np.floating] = np.zeros(count + 3)
    for _ in range(ROBUST_ROUNDS):
        H, b = PRIOR * np.eye(count + 3), np.zeros(count + 3)
        for n, m, ratio, basis in pairs:
            J = np.concatenate([np.full((len(ratio), 1), -1.0), np.full((len(ratio), 1), 1.0), basis], axis=1)
            at = [n, m, count, count + 1, count + 2]
            weight = 1 / (1 + ((ratio - J @ x[at]) / SPREAD) ** 2)
            H[np.ix_(at, at)] += (J * weight[:, None]).T @ J
            b[at] += (J * weight[:, None]).T @ ratio
        x = np.linalg.solve(H, b)
    log_gain = x[:count] - x[:count].mean()
    return Exposure(
        gains=np.exp(np.interp(np.arange(len(pictures)), training, log_gain)),
        falloff=np.exp(x[count] * radius2 + x[count + 1] * radius2**2).astype(np.float32),
    )


def _calm_above_horizon(picture: NDArray[np.uint8], intrinsics: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return pixels of the upper half whose neighbourhood is so even that parallax has no effect: mostly sky."""
    grey = picture.astype(np.float32)
    mean = cv2.blur(grey, (15, 15))
    variance = cv2.blur(grey * grey, (15, 15)) - mean * mean
    rows = np.arange(len(picture))[:, None]
    return (variance < (0.04 * mean) ** 2 + 1) & (rows < intrinsics[1, 2])


def pair_directions(
    calm: NDArray[np.bool_],
    other_calm: NDArray[np.bool_],
    intrinsics: NDArray[np.float64],
    relative: NDArray[np.float64],
) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Return rows and columns of pixels with equal directions in two pictures, on a coarse grid.

    Parameters
    ----------
    calm, other_calm : bool [H, W] pixels to compare
    intrinsics : float64 [3, 3] camera matrix [px]
    relative : float64 [4, 4] camera coordinates of the first to those of the other; only its rotation is used
    """
    rows, columns = _coarse_grid_pixels(calm)
    rays = np.stack([columns, rows, np.ones(len(rows))], axis=1) @ np.linalg.inv(intrinsics).T
    first, second = _find_visible_points(rows, columns, rays @ relative[:3, :3].T, intrinsics, calm.shape)[:2]
    same = other_calm[second]
    return (first[0][same], first[1][same]), (second[0][same], second[1][same])


def pair_pixels(
    disparity: NDArray[np.float32],
    other_disparity: NDArray[np.float32],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    relative: NDArray[np.float64],
) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Return rows and columns of pixels in one picture and of the same surfaces in another, on a coarse grid.

    Parameters
    ----------
    disparity, other_disparity : float32 [H, W] disparity, NaN where unknown [px]
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]
    relative : float64 [4, 4] camera coordinates of the first to those of the other
    """
    rows, columns = _coarse_grid_pixels(disparity > 1)
    rays = np.stack([columns, rows, np.ones(len(rows))], axis=1) @ np.linalg.inv(intrinsics).T
    points = (
        rays * (disparity_scale / disparity[rows, columns])[:, None] @ relative[:3, :3].T + relative[:3, 3]
    )
    first, second, depth = _find_visible_points(rows, columns, points, intrinsics, disparity.shape)
    same = np.abs(other_disparity[second] - disparity_scale / depth) < MATCHED
    return (first[0][same], first[1][same]), (second[0][same], second[1][same])


def _coarse_grid_pixels(wanted: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the wanted pixels on a coarse grid."""
    coarse = np.zeros_like(wanted)
    coarse[STRIDE // 2 :: STRIDE, STRIDE // 2 :: STRIDE] = True
    rows, columns = np.nonzero(wanted & coarse)
    return rows, columns


def _find_visible_points(
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    points: NDArray[np.float64],
    intrinsics: NDArray[np.float64],
    shape: tuple[int, ...],
) -> tuple[tuple[NDArray[np.int64], ...], tuple[NDArray[np.int64], ...], NDArray[np.float64]]:
    """Return the pixels whose points lie in the other camera's picture, their places there, and their depth [m]."""
    z = np.maximum(points[:, 2], 1e-6)
    pixel = np.rint((points @ intrinsics.T)[:, :2] / z[:, None])
    inside = (points[:, 2] > 0.5) & (pixel >= 0).all(axis=1) & (pixel < (shape[1], shape[0])).all(axis=1)
    column, row = pixel[inside].astype(np.int64).T
    return (rows[inside], columns[inside]), (row, column), z[inside]
