"""Correction of the given poses by the pictures: visual odometry on a pose graph."""

import cv2
import numpy as np
from numpy.typing import NDArray

FRAME_GAPS = (1, 2, 4)
"""Training frames this far apart are tied together."""
TRACKS = 1500
"""Corners tracked per pair."""
HUBER = 0.5
"""Residual above which a track counts linearly [px]."""
GROSS = 3.0
"""Residual above which a track is a mismatch in the last iterations [px]."""
PRIOR_ROTATION, PRIOR_TRANSLATION = np.radians(0.5), 0.1
"""Standard deviations of the prior on the given poses [rad], [m]."""
ITERATIONS = 6


def correct_poses(
    pictures: NDArray[np.uint8],
    disparity: NDArray[np.float32],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    T_origin_camera: NDArray[np.float64],
    training: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return the poses after the smallest correction under which tracked corners reproject.

    Corners of one training picture get their depth from its disparity and are tracked into the next
    training pictures; Gauss-Newton over all poses at once minimises the Huber-weighted reprojection
    error plus a weak prior on the given poses. Pictures that are not training frames are not read:
    their poses receive the correction interpolated between the neighbouring training frames.

    Parameters
    ----------
    pictures : uint8 [F, H, W] grey left pictures [1]
    disparity : float32 [F, H, W] disparity of the training frames [px]
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]
    T_origin_camera : float64 [F, 4, 4] given poses
    training : int [T] numbers of the training frames, ascending [1]

    Returns
    -------
    float64 [F, 4, 4] corrected poses
    """
    given = T_origin_camera
    poses = {int(i): given[i] for i in training}
    pairs = []
    for gap in FRAME_GAPS:
        for i, j in zip(training[:-gap], training[gap:], strict=True):
            points, pixels = _track_corners(
                pictures[i],
                pictures[j],
                disparity[i],
                intrinsics,
                disparity_scale,
                np.linalg.inv(given[j]) @ given[i],
            )
            if len(points) >= 20:
                pairs.append((int(i), int(j), points, pixels))
    row = {int(i): n for n, i in enumerate(training)}
    prior = np.diag([PRIOR_ROTATION**-2] * 3 + [PRIOR_TRANSLATION**-2] * 3)

    for iteration in range(ITERATIONS):
        H = np.zeros((len(row), 6, len(row), 6))
        b = np.zeros((len(row), 6))
        for i, n in row.items():
            H[n, :, n, :] += prior
            b[n] -= prior @ _small_log(np.linalg.inv(given[i]) @ poses[i])
        for i, j, points, pixels in pairs:
            relative = np.linalg.inv(poses[j]) @ poses[i]
            information, gradient = _reprojection_normal_equations(
                relative, points, pixels, intrinsics, np.inf if iteration < 2 else GROSS
            )
            A = _adjoint_matrix(relative)
            for a, left in ((row[i], A.T), (row[j], -np.eye(6))):
                b[a] += left @ gradient
                for c, right in ((row[i], A), (row[j], -np.eye(6))):
                    H[a, :, c, :] += left @ information @ right
        size = 6 * len(row)
        step = np.linalg.solve(H.reshape(size, size), b.reshape(size)).reshape(-1, 6)
        poses = {i: poses[i] @ exponential_map(step[n]) for i, n in row.items()}

    corrections = np.array([_small_log(np.linalg.inv(given[i]) @ poses[i]) for i in row])
    frames = np.arange(len(given))
    everywhere = np.stack([np.interp(frames, training, corrections[:, k]) for k in range(6)], axis=1)
    return np.array([given[i] @ exponential_map(everywhere[i]) for i in frames])


def _track_corners(
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    disparity: NDArray[np.float32],
    intrinsics: NDArray[np.float64],
    disparity_scale: float,
    relative: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return corners of the first picture as camera points [m], and their places in the second [px]."""
    matched = np.isfinite(disparity)
    corners = cv2.goodFeaturesToTrack(first, TRACKS, 0.003, 7, mask=matched.astype(np.uint8))
    if corners is None:
        return np.empty((0, 3)), np.empty((0, 2))
    corners = corners[:, 0]
    columns, rows = np.rint(corners).astype(np.int64).T
    depth = disparity_scale / np.maximum(disparity[rows, columns], 0.5)
    points = np.c_[corners, np.ones(len(corners))] @ np.linalg.inv(intrinsics).T * depth[:, None]
    moved = points @ relative[:3, :3].T + relative[:3, 3]
    guess = (moved @ intrinsics.T)[:, :2] / np.maximum(moved[:, 2:], 0.1)
    height, width = first.shape
    inside = (moved[:, 2] > 0.5) & (guess > 0).all(axis=1) & (guess < (width - 1, height - 1)).all(axis=1)
    corners, points, guess = corners[inside], points[inside], guess[inside].astype(np.float32)
    if not len(corners):
        return np.empty((0, 3)), np.empty((0, 2))

    found, ok = _track_points(first, second, corners, guess)
    back, ok_back = _track_points(second, first, found, corners)
    good = ok & ok_back & (np.abs(back - corners).max(axis=1) < 0.5)
    return points[good], found[good].astype(np.float64)


def _track_points(
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    start: NDArray[np.float32],
    guess: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Track points of the first picture to the second by Lucas and Kanade's method; return also which were found."""
    found, ok, _ = cv2.calcOpticalFlowPyrLK(
        first,
        second,
        start[:, None],
        guess[:, None].copy(),
        winSize=(13, 13),
        maxLevel=2,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return found[:, 0], ok[:, 0] > 0


def _reprojection_normal_equations(
    relative: NDArray[np.float64],
    points: NDArray[np.float64],
    pixels: NDArray[np.float64],
    intrinsics: NDArray[np.float64],
    gross: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return information matrix and right-hand side of a left increment (rotation, translation) of the pose."""
    p = points @ relative[:3, :3].T + relative[:3, 3]
    front = p[:, 2] > 0.5
    p, pixels = p[front], pixels[front]
    x, y, z = p.T
    fx, fy = intrinsics[0, 0], intrinsics[1, 1]
    residual = pixels - np.c_[fx * x / z + intrinsics[0, 2], fy * y / z + intrinsics[1, 2]]
    zero = np.zeros_like(z)
    d_pixel = np.stack(
        [np.stack([fx / z, zero, -fx * x / z**2], -1), np.stack([zero, fy / z, -fy * y / z**2], -1)], 1
    )
    d_point = np.concatenate([-_cross_matrices(p), np.broadcast_to(np.eye(3), (len(p), 3, 3))], axis=2)
    J = d_pixel @ d_point
    size = np.linalg.norm(residual, axis=1)
    weight = np.where(size < gross, np.minimum(1.0, HUBER / np.maximum(size, 1e-9)), 0.0)
    weighted = J * weight[:, None, None]
    return np.einsum("nra,nrb->ab", weighted, J), np.einsum("nra,nr->a", weighted, residual)


def _cross_matrices(v: NDArray[np.float64]) -> NDArray[np.float64]:
    zero = np.zeros(v.shape[:-1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack(
        [np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2
    )


def _adjoint_matrix(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix that takes a right increment (rotation, translation) of T to a left increment of T."""
    R, t = T[:3, :3], T[:3, 3]
    return np.block([[R, np.zeros((3, 3))], [_cross_matrices(t) @ R, R]])


def exponential_map(increment: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rigid motion of a small increment: rotation vector [rad], then translation [m]."""
    T = np.eye(4)
    T[:3, :3] = cv2.Rodrigues(increment[:3])[0]
    T[:3, 3] = increment[3:]
    return T


def _small_log(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of `exponential_map`."""
    return np.concatenate([cv2.Rodrigues(T[:3, :3])[0][:, 0], T[:3, 3]])
