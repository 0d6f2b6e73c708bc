"""The sky: directions of constant light during the drive, as a smooth model, as masks and as a panorama."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.reconstruction.camera import pixel_rays, rasteriser_intrinsics
from tasks.render.camera import world_to_camera
from tasks.render.environment import environment_view

BIN = 12
"""Directions are compared over time in bins of this size [px]."""
STRIDE = 4
"""Distance between the pixels from which the sky is fitted [px]."""
EVEN = 0.05
"""Sky has less local contrast than this, as a share of its brightness [1]."""
STEADY = 0.10
"""Sky changes less than this over the drive: interquartile range as a share of the median [1]."""
CLIPPED = 0.98
"""A direction this bright may be a white wall as well as sky, and is not used in the fit [1]."""
FIT_SPREAD = 0.05
"""Relative error above which a direction counts less in the fit [1]."""
ENOUGH = 20
"""Steady directions needed for a sky [1]."""
MATCHING = 0.14
"""A pixel this near to the expected sky, as a share of its brightness, is sky [1]."""
HORIZON = np.radians(0.5)
"""Nothing below this elevation is sky [rad]."""
SMALLEST_PATCH = 12
"""Smaller patches cannot be distinguished from a leaf of the sky's brightness [px]."""
SMOOTHING = np.radians(0.7)
"""Standard deviation of the panorama's smoothing [rad]."""
MODEL_WEIGHT = 4.0
"""Weight of the smooth model in the panorama, in pixels [1]."""


@dataclass(frozen=True, kw_only=True)
class Sky:
    """Smooth radiance of the sky over direction: a second-order polynomial within the directions seen.

    Parameters
    ----------
    coefficients : float64 [6, 3] of 1, a, e, a^2, a e, e^2 with azimuth a and elevation e [1]
    azimuth, elevation : lowest and highest seen; beyond, the nearest seen direction counts [rad]
    """

    coefficients: NDArray[np.float64]
    azimuth: tuple[float, float]
    elevation: tuple[float, float]

    def radiance_along(
        self, azimuth: NDArray[np.float64], elevation: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return linear light [..., 3] along directions [rad]."""
        terms = _polynomial_terms(np.clip(azimuth, *self.azimuth), np.clip(elevation, *self.elevation))
        return np.maximum(terms @ self.coefficients, 0).astype(np.float32)


def azimuth_elevation(rays: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return azimuth from +x towards +y, and elevation [rad], of world rays [..., 3]."""
    x, y, z = np.moveaxis(rays, -1, 0)
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def _polynomial_terms(azimuth: NDArray[np.float64], elevation: NDArray[np.float64]) -> NDArray[np.float64]:
    a, e = azimuth, elevation
    return np.stack([np.ones_like(a), a, e, a * a, a * e, e * e], axis=-1)


def fit_sky(
    radiance: list[NDArray[np.float32]], intrinsics: NDArray[np.float64], T_world_camera: NDArray[np.float64]
) -> Sky | None:
    """Fit the sky to directions that are even and keep their colour over the whole drive.

    Parameters
    ----------
    radiance : per picture, float32 [H, W, 3] linear light after exposure compensation [1]
    intrinsics : float64 [3, 3] camera matrix [px]
    T_world_camera : float64 [F, 4, 4] poses in a frame with z up

    Returns
    -------
    Sky, or None where too little steady sky is seen
    """
    rays = pixel_rays(radiance[0].shape[:2], intrinsics)[::STRIDE, ::STRIDE]
    bin_size = BIN / float(intrinsics[0, 0])
    keys, colours = [], []
    for picture, pose in zip(radiance, T_world_camera, strict=True):
        azimuth, elevation = azimuth_elevation(rays @ pose[:3, :3].T)
        grey = picture.mean(axis=2)
        mean = cv2.blur(grey, (9, 9))
        contrast = np.sqrt(np.maximum(cv2.blur(grey * grey, (9, 9)) - mean * mean, 0)) / np.maximum(
            mean, 1e-4
        )
        calm = (contrast[::STRIDE, ::STRIDE] < EVEN) & (elevation > 4 * HORIZON)
        keys.append(
            np.stack([np.floor(azimuth[calm] / bin_size), np.floor(elevation[calm] / bin_size)], axis=-1)
        )
        colours.append(picture[::STRIDE, ::STRIDE][calm])
    cells, cell, counts = np.unique(np.concatenate(keys), axis=0, return_inverse=True, return_counts=True)
    values = np.concatenate(colours)
    order = np.lexsort((values.mean(axis=1), cell.ravel()))
    starts = np.cumsum(counts) - counts
    low, median, high = (values[order[starts + counts * q // 4]] for q in (1, 2, 3))
    brightness = np.maximum(median.mean(axis=1), 1e-4)
    spread = (high - low).mean(axis=1) / brightness
    steady = (spread < STEADY) & (counts > 4 * len(radiance)) & (brightness < CLIPPED)
    if steady.sum() < ENOUGH:
        return None
    a, e = (cells[steady] + 0.5).T * bin_size
    A, target = _polynomial_terms(a, e), median[steady].astype(np.float64)
    weight = np.ones(len(A))
    for _ in range(20):
        W = A * weight[:, None]
        coefficients = np.linalg.solve(W.T @ A + 1e-9 * np.eye(6), W.T @ target)
        error = np.abs(A @ coefficients - target).mean(axis=1) / brightness[steady]
        weight = 1 / (1 + (error / FIT_SPREAD) ** 2) ** 2
    trusted = weight > 0.25
    return Sky(
        coefficients=coefficients,
        azimuth=(float(a[trusted].min(initial=0)), float(a[trusted].max(initial=0))),
        elevation=(float(e[trusted].min(initial=0)), float(e[trusted].max(initial=0))),
    )


def mask_sky(
    radiance: NDArray[np.float32],
    sky: Sky | None,
    intrinsics: NDArray[np.float64],
    T_world_camera: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return the pixels of one picture that show sky, bool [H, W].

    Parameters
    ----------
    radiance : float32 [H, W, 3] linear light after exposure compensation [1]
    sky : from `fit_sky`
    intrinsics : float64 [3, 3] camera matrix [px]
    T_world_camera : float64 [4, 4] pose in a frame with z up
    """
    if sky is None:
        return np.zeros(radiance.shape[:2], dtype=np.bool_)
    azimuth, elevation = azimuth_elevation(
        pixel_rays(radiance.shape[:2], intrinsics) @ T_world_camera[:3, :3].T
    )
    expected = sky.radiance_along(azimuth, elevation)
    near = np.abs(radiance - expected).max(axis=2) < MATCHING * expected.mean(axis=2)
    near &= elevation > HORIZON
    _, labels, stats, _ = cv2.connectedComponentsWithStats(near.astype(np.uint8), connectivity=4)
    large = stats[:, cv2.CC_STAT_AREA] >= SMALLEST_PATCH
    large[0] = False
    return large[labels]


def build_panorama(
    sky: Sky | None,
    radiance: list[NDArray[np.float32]],
    masks: list[NDArray[np.bool_]],
    intrinsics: NDArray[np.float64],
    T_world_camera: NDArray[np.float64],
    rows: int,
) -> NDArray[np.float32]:
    """Return the equirectangular sky: the mean of the sky pixels, weighted with the smooth model.

    Below the horizon it has the median radiance of the other pixels, so that a gap in the street looks dark.

    Parameters
    ----------
    sky : from `fit_sky`; without one, the upper half is like the lower
    radiance : per picture, float32 [H, W, 3] linear light after exposure compensation [1]
    masks : per picture, bool [H, W] sky pixels
    intrinsics : float64 [3, 3] camera matrix [px]
    T_world_camera : float64 [F, 4, 4] poses in a frame with z up
    rows : of the panorama; it has twice as many columns [px]

    Returns
    -------
    float32 [rows, 2 rows, 3], row 0 zenith, column centre +x, leftward columns towards +y [1]
    """
    columns = 2 * rows
    street = np.concatenate([p[~m][::97] for p, m in zip(radiance, masks, strict=True)])
    out = np.broadcast_to(np.median(street, axis=0), (rows, columns, 3)).astype(np.float32)
    if sky is None:
        return out
    azimuth = np.pi * (1 - (2 * np.arange(columns) + 1) / columns)
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    upper = elevation > 0
    model = sky.radiance_along(*np.meshgrid(azimuth, elevation[upper]))
    total, count = MODEL_WEIGHT * model.astype(np.float64), np.full(model.shape[:2], MODEL_WEIGHT)
    rays = pixel_rays(masks[0].shape, intrinsics)
    for picture, mask, pose in zip(radiance, masks, T_world_camera, strict=True):
        a, e = azimuth_elevation(rays[mask] @ pose[:3, :3].T)
        column = np.floor((0.5 - a / (2 * np.pi)) * columns).astype(np.int64) % columns
        cell = (
            np.clip(np.floor((0.5 - e / np.pi) * rows).astype(np.int64), 0, len(model) - 1) * columns + column
        )
        count += np.bincount(cell, minlength=count.size).reshape(count.shape)
        for c in range(3):
            total[..., c] += np.bincount(cell, picture[mask][:, c], minlength=count.size).reshape(count.shape)
    total, count = (cv2.GaussianBlur(a, (0, 0), SMOOTHING / np.pi * rows) for a in (total, count))
    out[upper] = total / count[..., None]
    return out


def sky_view(
    environment: NDArray[np.float32],
    shape: tuple[int, int],
    intrinsics: NDArray[np.float64],
    T_world_camera: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Return the part of the panorama that one picture [H, W, 3] of the sequence shows."""
    return environment_view(
        environment, world_to_camera(T_world_camera), rasteriser_intrinsics(intrinsics), shape[1], shape[0]
    )
