"""A seeded street-like cloud for measurements: a road between two facades, with clutter along the sides."""

import numpy as np

from tasks.conventions import SemanticClass
from tasks.scene.gaussians import Gaussians

LENGTH, HALF_WIDTH, WALL_HEIGHT = 120.0, 9.0, 12.0
"""Extent of the corridor: x in 0..120 m, y in -9..9 m, z in 0..12 m [m]."""

_SURFACES = (
    # share of the Gaussians, class, normal
    (0.30, SemanticClass.ROAD, (0.0, 0.0, 1.0)),
    (0.25, SemanticClass.BUILDING, (0.0, -1.0, 0.0)),
    (0.25, SemanticClass.BUILDING, (0.0, 1.0, 0.0)),
    (0.20, SemanticClass.VEGETATION, (0.0, 0.0, 1.0)),
)


def corridor(count: int, sh_count: int = 16, seed: int = 0) -> Gaussians:
    """Flat Gaussians about as large as their spacing, 30 % thick clutter blobs aside.

    Parameters
    ----------
    count : number of Gaussians [1]
    sh_count : coefficients per channel: 1, 4, 9 or 16 [1]
    seed : of every random draw [1]
    """
    rng = np.random.default_rng(seed)
    means, normals, classes = [], [], []
    for share, label, normal in _SURFACES:
        n = round(count * share) if label != SemanticClass.VEGETATION else count - sum(map(len, means))
        x = rng.uniform(0, LENGTH, n)
        if label == SemanticClass.ROAD:
            points = np.column_stack((x, rng.uniform(-HALF_WIDTH, HALF_WIDTH, n), rng.normal(0, 0.01, n)))
        elif label == SemanticClass.BUILDING:
            side = -normal[1] * (HALF_WIDTH + rng.normal(0, 0.02, n))
            points = np.column_stack((x, side, rng.uniform(0, WALL_HEIGHT, n)))
        else:
            bushes = np.column_stack((
                rng.uniform(0, LENGTH, 60), rng.choice((-1, 1), 60) * rng.uniform(4.5, 8, 60), rng.uniform(0.5, 3, 60),
            ))  # fmt: skip
            points = bushes[rng.integers(0, 60, n)] + rng.normal(0, (0.8, 0.5, 0.6), (n, 3))
        means.append(points)
        normals.append(np.tile(normal, (n, 1)))
        classes.append(np.full(n, label, dtype=np.uint8))
    area = LENGTH * (2 * HALF_WIDTH + 2 * WALL_HEIGHT)
    spacing = np.sqrt(area / (0.8 * count))
    normal = np.concatenate(normals) + rng.normal(0, 0.05, (count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # The local z axis is the normal: turn z onto it by the half-way quaternion, after a random spin.
    quats = np.column_stack((1 + normal[:, 2], -normal[:, 1], normal[:, 0], np.zeros(count)))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    scales = spacing * np.exp(rng.normal(np.log(0.6), 0.35, (count, 3)))
    scales[:, 2] *= np.where(np.concatenate(classes) == SemanticClass.VEGETATION, 0.5, 0.1)
    sh = rng.normal(0, 0.06, (count, sh_count, 3))
    sh[:, 0] = rng.normal(0, 0.5, (count, 3))
    return Gaussians(
        means=np.concatenate(means).astype(np.float32),
        quats_wxyz=quats.astype(np.float32),
        scales=scales.astype(np.float32),
        opacities=rng.beta(2.0, 1.0, count).clip(0.02, 0.995).astype(np.float32),
        sh=sh.astype(np.float32),
        normals=normal.astype(np.float32),
        class_id=np.concatenate(classes),
    )


def driver_view(station: float, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """A camera 1.5 m above the road, looking along it, 77 degrees wide.

    Parameters
    ----------
    station : place along the corridor [m]
    width, height : picture size [px]

    Returns
    -------
    viewmat : float64 [4, 4] world to camera [m]
    K : float64 [3, 3] intrinsics [px]
    """
    viewmat = np.eye(4)
    viewmat[:3, :3] = ((0, -1, 0), (0, 0, -1), (1, 0, 0))
    viewmat[:3, 3] = -viewmat[:3, :3] @ (station, 0.3, 1.5)
    focal = width / (2 * np.tan(np.radians(77) / 2))
    return viewmat, np.array(((focal, 0, width / 2), (0, focal, height / 2), (0, 0, 1)))
