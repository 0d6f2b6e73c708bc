"""A seeded street-like cloud for measurements: a road between two facades, with bushes along the sides."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.gaussians import Gaussians

LENGTH, HALF_WIDTH, WALL_HEIGHT = 120.0, 9.0, 12.0
"""The corridor: x in 0..120 m, y in -9..9 m, z in 0..12 m [m]."""

_SURFACES = (
    # class, share of the Gaussians, normal
    (SemanticClass.ROAD, 0.30, (0.0, 0.0, 1.0)),
    (SemanticClass.BUILDING, 0.25, (0.0, -1.0, 0.0)),
    (SemanticClass.BUILDING, 0.25, (0.0, 1.0, 0.0)),
    (SemanticClass.VEGETATION, 0.20, (0.0, 0.0, 1.0)),
)
_BUSHES = 60


def make_corridor(count: int, sh_count: int = 16, seed: int = 0) -> Gaussians:
    """Gaussians about as large as their spacing, flat on the road and the walls, thick in the bushes.

    Parameters
    ----------
    count : number of Gaussians [1]
    sh_count : coefficients per channel: 1, 4, 9 or 16 [1]
    seed : of every random draw [1]
    """
    rng = np.random.default_rng(seed)
    sizes = [round(count * share) for _, share, _ in _SURFACES]
    sizes[-1] = count - sum(sizes[:-1])
    class_id = np.repeat([label for label, _, _ in _SURFACES], sizes).astype(np.uint8)
    means = np.concatenate([
        _draw_points(rng, label, normal, size)
        for (label, _, normal), size in zip(_SURFACES, sizes, strict=True)
    ])  # fmt: skip
    normals = np.repeat([normal for _, _, normal in _SURFACES], sizes, axis=0)
    normals = normals + 0.05 * rng.standard_normal((count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # The quaternion half way between no turn and a half turn takes the local z axis to the normal.
    quats = np.column_stack((1 + normals[:, 2], -normals[:, 1], normals[:, 0], np.zeros(count)))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    area = LENGTH * 2 * (HALF_WIDTH + WALL_HEIGHT)
    spacing = np.sqrt(area / sum(sizes[:-1]))
    scales = 0.6 * spacing * np.exp(0.35 * rng.standard_normal((count, 3)))
    scales[:, 2] *= np.where(class_id == SemanticClass.VEGETATION, 0.5, 0.1)
    sh = rng.standard_normal((count, sh_count, 3), dtype=np.float32)
    sh *= np.where(np.arange(sh_count) == 0, 0.5, 0.06).astype(np.float32)[:, None]
    return Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=quats.astype(np.float32),
        scales=scales.astype(np.float32),
        opacities=rng.beta(2.0, 1.0, count).clip(0.02, 0.995).astype(np.float32),
        sh=sh,
        normals=normals.astype(np.float32),
        class_id=class_id,
    )


def _draw_points(
    rng: np.random.Generator, label: SemanticClass, normal: tuple[float, float, float], size: int
) -> NDArray[np.float64]:
    if label == SemanticClass.VEGETATION:
        x, away, z = rng.uniform((0, 4.5, 0.5), (LENGTH, 8, 3), (_BUSHES, 3)).T
        bushes = np.column_stack((x, away * rng.choice((-1, 1), _BUSHES), z))
        return bushes[rng.integers(0, _BUSHES, size)] + rng.normal(0, (0.8, 0.5, 0.6), (size, 3))
    along = rng.uniform(0, LENGTH, size)
    if label == SemanticClass.ROAD:
        across, height = rng.uniform(-HALF_WIDTH, HALF_WIDTH, size), rng.normal(0, 0.01, size)
    else:
        across, height = (
            -normal[1] * HALF_WIDTH + rng.normal(0, 0.02, size),
            rng.uniform(0, WALL_HEIGHT, size),
        )
    return np.column_stack((along, across, height))


def driver_view(station: float, width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
