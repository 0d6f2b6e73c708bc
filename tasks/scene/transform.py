"""Translation, rotation and scaling of a cloud of Gaussians, its view-dependent colour included."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.scene.gaussians import Gaussians, check_gaussians
from tasks.scene.spherical_harmonics import sh_basis

BANDS = ((1, 4), (4, 9), (9, 16))
"""First and last coefficient of the bands 1, 2 and 3; band 0 is invariant under rotation."""
SAMPLES = 64
"""Directions of the fit below: it is exact for any number of directions that spans the largest band."""


def transform_gaussians(gaussians: Gaussians, T_world_source: NDArray[np.float64]) -> Gaussians:
    """Transform a cloud to another frame.

    Parameters
    ----------
    gaussians : in the source frame
    T_world_source : float64 [4, 4] source-to-world similarity: rotation, one scale, translation [m]

    Raises
    ------
    InputError
        If the transformed cloud has values out of range.
    """
    scale = np.cbrt(np.linalg.det(T_world_source[:3, :3]))
    R = T_world_source[:3, :3] / scale
    turn = Rotation.from_matrix(R)
    quats = (turn * Rotation.from_quat(gaussians.quats_wxyz, scalar_first=True)).as_quat(scalar_first=True)
    with np.errstate(over="ignore", under="ignore"):
        means = (gaussians.means @ T_world_source[:3, :3].T + T_world_source[:3, 3]).astype(np.float32)
        scales = (scale * gaussians.scales).astype(np.float32)
    turned = replace(
        gaussians,
        means=means,
        scales=scales,
        quats_wxyz=quats.astype(np.float32),
        normals=(gaussians.normals @ R.T).astype(np.float32),
        sh=rotate_sh(gaussians.sh, R),
    )
    check_gaussians(turned, "the cloud along the route")
    return turned


def rotate_sh(sh: NDArray[np.float32], rotation: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the coefficients of the rotated colour function: ``f'(d) = f(R^T d)``.

    Each band is invariant under rotation, so its matrix follows from values at enough directions:
    ``Y(d) c' = Y(R^T d) c`` in the band.

    Parameters
    ----------
    sh : float32 [N, K, 3] coefficients [1]
    rotation : float64 [3, 3] source to world [1]
    """
    count = sh.shape[1]
    # a spiral over the sphere: even and deterministic
    z = np.linspace(-0.98, 0.98, SAMPLES)
    azimuth = np.pi * (3 - np.sqrt(5)) * np.arange(SAMPLES)
    ring = np.sqrt(1 - z**2)
    directions = np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), z], axis=1)
    at, back = sh_basis(directions, count), sh_basis(directions @ rotation, count)
    turned = sh.astype(np.float64)
    for first, last in BANDS:
        if count >= last:
            matrix = np.linalg.lstsq(at[:, first:last], back[:, first:last], rcond=None)[0]
            turned[:, first:last] = np.einsum("ij,njc->nic", matrix, sh[:, first:last].astype(np.float64))
    return turned.astype(np.float32)
