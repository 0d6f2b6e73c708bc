"""Picture and video quality without a reference, by methods that need no trained weights."""

import cv2
import numpy as np
from numpy.typing import NDArray

BLOCK, SEGMENT = 16, 6
"""Side of PIQE's blocks and length of the edge segments within them [px]."""
ACTIVE, FLAT = 0.1, 0.1
"""Variance from which a block is spatially active, and deviation below which a segment shows no texture [1]."""
STRIDE = 4
"""The temporal error is taken over every pair of frames with this stride [frames]."""


def piqe(picture: NDArray[np.uint8]) -> float:
    """Perception-based image quality evaluator; 0 is best, 100 worst [1].

    Share of distortion in the spatially active blocks: flat stretches along a block's edges (compression, blur) and a
    centre as rough as its surround (noise).

    Parameters
    ----------
    picture : uint8 [H, W, 3] sRGB [1]

    Source: Venkatanath et al. 2015, DOI 10.1109/NCC.2015.7084843.
    """
    luma = cv2.cvtColor(picture, cv2.COLOR_RGB2YCrCb)[..., 0].astype(np.float64)
    rows, columns = (-(-side // BLOCK) * BLOCK for side in luma.shape)
    luma = np.pad(luma, ((0, rows - luma.shape[0]), (0, columns - luma.shape[1])), mode="symmetric")
    tiles = _normalise_contrast(luma).reshape(rows // BLOCK, BLOCK, columns // BLOCK, BLOCK)
    blocks = tiles.swapaxes(1, 2).reshape(-1, BLOCK, BLOCK)
    variance = blocks.var(axis=(1, 2), ddof=1)
    active = variance > ACTIVE
    blocks, variance = blocks[active], variance[active]
    flat, noisy = _has_flat_edge(blocks), _is_noisy(blocks, np.sqrt(variance))
    distortion = np.where(flat, 1.0 - variance, 0.0) + np.where(noisy, variance, 0.0)
    return float(100.0 * (distortion.sum() + 1.0) / (active.sum() + 1.0))


def _normalise_contrast(luma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean-subtracted, contrast-normalised luma (7 x 7 Gaussian, one unit of stabilisation)."""

    def blur_luma(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return cv2.GaussianBlur(values, (7, 7), 7 / 6, borderType=cv2.BORDER_REPLICATE)

    mean = blur_luma(luma)
    spread = np.sqrt(np.abs(blur_luma(luma * luma) - mean * mean))
    return (luma - mean) / (spread + 1.0)


def _has_flat_edge(blocks: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether any segment along any of a block's four edges shows no texture, bool [N]."""
    edges = np.stack([blocks[:, 0], blocks[:, -1], blocks[:, :, 0], blocks[:, :, -1]], axis=1)
    segments = np.lib.stride_tricks.sliding_window_view(edges, SEGMENT, axis=2)
    return np.asarray((segments.std(axis=-1, ddof=1) < FLAT).any(axis=(1, 2)))


def _is_noisy(blocks: NDArray[np.float64], deviation: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether a block's deviation is above twice its distance from centre over surround, bool [N]."""
    middle = BLOCK // 2
    centre = blocks[:, :, middle - 1 : middle + 1]
    surround = np.delete(blocks, [middle - 1, middle], axis=2)
    inner, outer = (part.std(axis=(1, 2), ddof=1) for part in (centre, surround))
    ratio = inner / outer
    beta = np.abs(deviation - ratio) / np.maximum(deviation, ratio)
    return np.asarray(deviation > 2.0 * beta)


def temporal_error(frames: NDArray[np.uint8]) -> float:
    """Mean squared difference of a frame and its successor warped onto it by optical flow, occlusions left out [1].

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB, two at least [1]

    Source: Lai et al. 2018, DOI 10.1007/978-3-030-01267-0_11, eq. 9, with Farneback's flow (2003,
    DOI 10.1007/3-540-45103-X_50) in the place of a learned one and every fourth pair.
    """
    errors = []
    for k in range(0, len(frames) - 1, STRIDE):
        here, there = (cv2.cvtColor(frames[i], cv2.COLOR_RGB2GRAY) for i in (k, k + 1))
        forward, backward = _estimate_flow(here, there), _estimate_flow(there, here)
        y, x = np.mgrid[: here.shape[0], : here.shape[1]].astype(np.float32)
        at = x + forward[..., 0], y + forward[..., 1]
        back = cv2.remap(backward, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=1e3)
        gap = ((forward + back) ** 2).sum(axis=-1)
        # Sundaram et al. 2010, DOI 10.1007/978-3-642-15549-9_32: what comes back elsewhere was hidden
        seen = gap <= 0.01 * ((forward**2).sum(axis=-1) + (back**2).sum(axis=-1)) + 0.5
        warped = cv2.remap(frames[k + 1], *at, cv2.INTER_LINEAR).astype(np.float64)
        if seen.any():
            errors.append(float(np.mean(((frames[k] - warped)[seen] / 255) ** 2)))
    return float(np.mean(errors)) if errors else float("nan")


def _estimate_flow(here: NDArray[np.uint8], there: NDArray[np.uint8]) -> NDArray[np.float32]:
    guess = np.zeros((*here.shape, 2), np.float32)
    return np.asarray(cv2.calcOpticalFlowFarneback(here, there, guess, 0.5, 4, 21, 3, 7, 1.5, 0), np.float32)
