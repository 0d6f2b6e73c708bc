"""The rasteriser's rules in plain NumPy, one Gaussian at a time in float64: the oracle of the fast kernels."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tasks.render.rasterise.blending import SURFACE_RATIO
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.preparation import morton_order, rotation_matrices
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import sh_basis

NEAR, RAY_MARGIN, MIN_ALPHA, MAX_ALPHA, STOP = 0.05, 0.3, 1 / 255, 0.999, 1e-4


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """Contribution of one Gaussian to a window of the picture.

    Parameters
    ----------
    gaussian : index in the cloud [1]
    depth : camera z of its centre [m]
    window : rows and columns of the picture
    weight : float64 [h, w] opacity times the transmittance in front of it [1]
    transmittance : float64 [h, w] share of light left in front of it [1]
    """

    gaussian: int
    depth: float
    window: tuple[slice, slice]
    weight: NDArray[np.float64]
    transmittance: NDArray[np.float64]


def blend_steps(
    gaussians: Gaussians, viewmat: NDArray[np.floating], K: NDArray[np.floating], width: int, height: int
) -> Iterator[Contribution]:
    """Blend the Gaussians front to back, one step each; equal depths follow the Morton curve.

    Parameters
    ----------
    gaussians : the cloud
    viewmat : [4, 4] world to camera [m]
    K : [3, 3] intrinsics [px]
    width, height : picture size [px]

    Yields
    ------
    Contribution
    """
    R, t = np.asarray(viewmat, np.float64)[:3, :3], np.asarray(viewmat, np.float64)[:3, 3]
    f, c = np.array((K[0, 0], K[1, 1]), np.float64), np.asarray(K, np.float64)[:2, 2]
    size = np.array((width, height))
    low, high = -c / f - RAY_MARGIN * 0.5 * size / f, (size - c) / f + RAY_MARGIN * 0.5 * size / f
    means = gaussians.means.astype(np.float64) @ R.T + t
    axes = rotation_matrices(gaussians.quats_wxyz) * gaussians.scales[:, None, :].astype(np.float64)

    order = morton_order(gaussians.means)
    order = order[np.argsort(means[order, 2].astype(np.float32), kind="stable")]
    transmittance = np.ones((height, width))
    still_open = np.ones((height, width), dtype=bool)
    for i in order[means[order, 2] >= NEAR]:
        z = means[i, 2]
        ray = means[i, :2] / z
        J = np.column_stack((np.diag(f / z), -f * np.clip(ray, low, high) / z))
        M = J @ R @ axes[i]
        low_pass = 0.1 if gaussians.antialiased else 0.3
        covariance = M @ M.T + low_pass * np.eye(2)
        opacity = float(gaussians.opacities[i])
        if gaussians.antialiased:
            opacity *= np.sqrt(max(np.linalg.det(M @ M.T) / np.linalg.det(covariance), 1e-12))
        centre = f * ray + c
        if gaussians.surroundings is not None:
            centre = centre + _shift_nearer(gaussians, int(i), R, f, c, centre, covariance, low_pass)
        half = np.sqrt(2 * max(np.log(opacity / MIN_ALPHA), 0) * np.diag(covariance))
        first = np.clip(np.floor(centre - half), 0, size).astype(int)
        last = np.clip(np.ceil(centre + half), 0, size).astype(int)
        if (first >= last).any():
            continue
        window = slice(first[1], last[1]), slice(first[0], last[0])
        dy, dx = np.meshgrid(
            np.arange(first[1], last[1]) + 0.5 - centre[1],
            np.arange(first[0], last[0]) + 0.5 - centre[0],
            indexing="ij",
        )
        (a, b), (_, d) = np.linalg.inv(covariance)
        alpha = opacity * np.exp(-0.5 * (a * dx * dx + 2 * b * dx * dy + d * dy * dy))
        drawn = (alpha >= MIN_ALPHA) & still_open[window]
        alpha = np.minimum(alpha, MAX_ALPHA)
        before = transmittance[window].copy()
        stops = drawn & (before * (1 - alpha) <= STOP)
        still_open[window] &= ~stops
        weight = np.where(drawn & ~stops, before * alpha, 0.0)
        transmittance[window] = before - weight
        yield Contribution(
            gaussian=int(i), depth=float(z), window=window, weight=weight, transmittance=before
        )


def _shift_nearer(
    gaussians: Gaussians,
    i: int,
    R: NDArray[np.float64],
    f: NDArray[np.float64],
    c: NDArray[np.float64],
    centre: NDArray[np.float64],
    covariance: NDArray[np.float64],
    low_pass: float,
) -> NDArray[np.float64]:
    """Return the shift of a disc towards the nearer side of its surface, against the painter's bias [px].

    It is `painters_bias` in double precision: without a table, by the trapezoidal rule.
    """
    normal = R @ gaussians.normals[i].astype(np.float64)
    gradient = normal[:2] / f
    slant = gradient @ (centre - c) + normal[2]
    steepness = np.linalg.norm(gradient)
    if steepness < 1e-9:
        return np.zeros(2)
    nearer = gradient / steepness * np.sign(slant)
    variance = nearer @ covariance @ nearer
    overlap, size = gaussians.surroundings[i].astype(np.float64)  # type: ignore[index]
    r = np.sqrt(variance / (size**2 * (variance - low_pass) + low_pass))
    horizon = abs(slant) / steepness / np.sqrt(variance)
    t = np.linspace(-9, 9, 6001)
    density = np.exp(-((r * t) ** 2) / 2) / np.sqrt(2 * np.pi)
    weight = np.exp(-(t**2) / 2 - overlap * ndtr(r * t))
    weight /= weight.sum()
    mean = weight @ t
    stretch = weight @ (t - mean) ** 2 + 2 * overlap / r * (weight @ ((t - mean) * density))
    closeness = min((1 - low_pass / variance) / horizon, 0.1)
    return np.minimum(closeness * stretch - mean, 2.5) / np.sqrt(variance) * (covariance @ nearer)


def rasterise_reference(
    gaussians: Gaussians, viewmat: NDArray[np.floating], K: NDArray[np.floating], width: int, height: int
) -> GBuffer:
    """Return the result of `tasks.render.rasterise.rasteriser.rasterise_view` by slow, readable code.

    Parameters
    ----------
    gaussians : the cloud
    viewmat : [4, 4] world to camera [m]
    K : [3, 3] intrinsics [px]
    width, height : picture size [px]

    Returns
    -------
    GBuffer
    """
    R, t = np.asarray(viewmat, np.float64)[:3, :3], np.asarray(viewmat, np.float64)[:3, 3]
    direction = gaussians.means.astype(np.float64) + R.T @ t
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    basis = sh_basis(direction, gaussians.sh.shape[1])
    colours = np.maximum(np.einsum("nk,nkc->nc", basis, gaussians.sh) + 0.5, 0)
    away = (gaussians.normals * direction).sum(axis=1) > 0
    normals = np.where(away[:, None], -gaussians.normals, gaussians.normals)

    rgb, normal = np.zeros((height, width, 3)), np.zeros((height, width, 3))
    expected, left, front = np.zeros((height, width)), np.ones((height, width)), np.full((height, width), -1)
    class_id = np.zeros((height, width), dtype=np.uint8)
    for step in blend_steps(gaussians, viewmat, K, width, height):
        rgb[step.window] += step.weight[..., None] * colours[step.gaussian]
        normal[step.window] += step.weight[..., None] * normals[step.gaussian]
        expected[step.window] += step.weight * step.depth
        left[step.window] -= step.weight
        halves = (step.transmittance >= 0.5) & (step.transmittance - step.weight < 0.5)
        class_id[step.window][halves] = gaussians.class_id[step.gaussian]
        front[step.window][halves] = step.gaussian
    alpha = 1 - left
    covered = alpha > 0
    expected[covered] /= alpha[covered]
    expected[~covered] = np.nan
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.stack(((u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones_like(u)), axis=-1) @ R
    from_eye = gaussians.means.astype(np.float64) + R.T @ t
    centre = (gaussians.means.astype(np.float64) @ R.T + t)[front, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = (from_eye * normals).sum(axis=1)[front] / (normals[front] * rays).sum(axis=-1)
    tilted = (plane < centre * SURFACE_RATIO) & (centre < plane * SURFACE_RATIO)
    depth = np.where(front < 0, expected, np.where(tilted, plane, centre))
    normal[covered] /= np.linalg.norm(normal[covered], axis=1, keepdims=True)
    return GBuffer(
        rgb=rgb.astype(np.float32),
        depth=depth.astype(np.float32),
        expected_depth=expected.astype(np.float32),
        alpha=alpha.astype(np.float32),
        normal=normal.astype(np.float32),
        class_id=class_id,
        object_id=np.zeros((height, width), np.uint16),
    )
