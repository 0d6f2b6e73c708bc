"""Small clouds and cameras for the rasteriser's tests."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

WIDTH, HEIGHT = 72, 52
K = np.array(((60.0, 0, 35.2), (0, 58.0, 26.9), (0, 0, 1)))


def random_cloud(count: int, sh_count: int = 16, seed: int = 0) -> Gaussians:
    """Gaussians all around the origin, 0 to 12 m away, of very different sizes, shapes and opacities."""
    rng = np.random.default_rng(seed)
    normals = rng.standard_normal((count, 3))
    quats = rng.standard_normal((count, 4))
    sh = rng.normal(0, 0.15, (count, sh_count, 3))
    sh[:, 0] += 1
    return Gaussians(
        means=rng.uniform(-7, 7, (count, 3)).astype(np.float32),
        quats_wxyz=(quats / np.linalg.norm(quats, axis=1, keepdims=True)).astype(np.float32),
        scales=np.exp(rng.normal(-2, 0.9, (count, 3))).astype(np.float32),
        opacities=rng.uniform(0.01, 1, count).astype(np.float32),
        sh=sh.astype(np.float32),
        normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32),
        class_id=rng.integers(1, len(SemanticClass), count).astype(np.uint8),
    )


def make_cloud(
    means: object,
    scales: object = 0.1,
    opacities: object = 0.9,
    quats_wxyz: object = (1, 0, 0, 0),
    colours: object = 0.5,
    normals: object = (0, 0, -1),
    class_id: object = SemanticClass.ROAD,
) -> Gaussians:
    """Gaussians given one by one, in plain colours; a single value stands for all of them."""
    centres = np.atleast_2d(np.asarray(means, dtype=np.float32))
    n = len(centres)
    wide = {"scales": scales, "quats_wxyz": quats_wxyz, "normals": normals, "colours": colours}
    columns = {"scales": 3, "quats_wxyz": 4, "normals": 3, "colours": 3}
    full = {
        name: np.broadcast_to(np.asarray(value, dtype=np.float32), (n, columns[name])).copy()
        for name, value in wide.items()
    }
    return Gaussians(
        means=centres,
        quats_wxyz=full["quats_wxyz"],
        scales=full["scales"],
        opacities=np.broadcast_to(np.asarray(opacities, dtype=np.float32), (n,)).copy(),
        sh=((full["colours"] - 0.5) / C0)[:, None, :].astype(np.float32),
        normals=full["normals"],
        class_id=np.broadcast_to(np.asarray(class_id, dtype=np.uint8), (n,)).copy(),
    )


def rotation_matrix(seed: int) -> NDArray[np.float64]:
    """A random rotation matrix."""
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def camera_at(position: object, R: NDArray[np.float64]) -> NDArray[np.float64]:
    """World-to-camera matrix of a camera with world-to-camera rotation R."""
    viewmat = np.eye(4)
    viewmat[:3, :3] = R
    viewmat[:3, 3] = -R @ np.asarray(position, dtype=np.float64)
    return viewmat
