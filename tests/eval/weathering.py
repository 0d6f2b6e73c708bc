"""Weather and codecs over finished frames; the motion in them stays."""

import cv2
import numpy as np
from numpy.typing import NDArray


def add_flakes(frames: NDArray[np.uint8], count: int = 150, seed: int = 0) -> NDArray[np.uint8]:
    """Bright discs at new places in every frame."""
    rng = np.random.default_rng(seed)
    fallen = frames.copy()
    for picture in fallen:
        height, width = picture.shape[:2]
        for x, y, r in zip(
            rng.integers(0, width, count),
            rng.integers(0, height, count),
            rng.integers(1, 4, count),
            strict=True,
        ):
            cv2.circle(picture, (int(x), int(y)), int(r), (235, 235, 240), -1)
    return fallen


def code_as_jpeg(frames: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Each frame through lossy block coding."""
    coded = [cv2.imencode(".jpg", f, [cv2.IMWRITE_JPEG_QUALITY, quality])[1] for f in frames]
    return np.stack([cv2.imdecode(c, cv2.IMREAD_COLOR) for c in coded])


def add_noise(frames: NDArray[np.uint8], sigma: float, seed: int = 0) -> NDArray[np.uint8]:
    """Independent sensor noise [grey levels]."""
    noisy = frames + np.random.default_rng(seed).normal(0, sigma, frames.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def fade_pictures(frames: NDArray[np.uint8], contrast: float) -> NDArray[np.uint8]:
    """As through fog of one density."""
    return np.rint(190 + (frames - 190.0) * contrast).astype(np.uint8)


def add_veil(
    frames: NDArray[np.uint8],
    depth: NDArray[np.float32],
    K: NDArray[np.float64],
    extinction: float,
    light: float,
) -> NDArray[np.uint8]:
    """As through air of that extinction [1/m] and linear light [1], by Koschmieder's law; what has no depth is air."""
    y, x = np.indices(depth.shape[1:])
    ray = np.sqrt(1 + ((x - K[0, 2]) / K[0, 0]) ** 2 + ((y - K[1, 2]) / K[1, 1]) ** 2)
    through = np.exp(-extinction * np.where(np.isfinite(depth), ray * depth, np.inf))[..., None]
    display = frames / 255
    linear = np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)
    seen = linear * through + light * (1 - through)
    return np.rint(255 * np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055)).astype(
        np.uint8
    )
