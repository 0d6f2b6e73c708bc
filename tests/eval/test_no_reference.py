"""Quality without a reference: what harms a picture harms the figure, and a moving camera does not."""

import cv2
import numpy as np
import pytest

from studies.evaluation.metrics.no_reference import piqe, temporal_error
from studies.synthetic_street import Clip


def make_noise(frames: np.ndarray, deviation: float) -> np.ndarray:
    rng = np.random.Generator(np.random.Philox(7))
    return np.clip(frames + rng.normal(0.0, deviation, frames.shape), 0, 255).astype(np.uint8)


def make_texture() -> np.ndarray:
    """A grey picture from black to white that any implementation can make: octaves of fixed noise."""
    rng = np.random.Generator(np.random.Philox(3))
    octaves = [cv2.resize(rng.random((8 << k, 12 << k)), (384, 256)) / 1.5**k for k in range(5)]
    total = np.sum(octaves, axis=0)
    grey = np.round(255 * (total - total.min()) / np.ptp(total)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


# by pypiqe 1.2, which scales every picture to its maximum and leaves out a third column of the surround
@pytest.mark.parametrize(("harm", "published"), [("none", 43.0403), ("blur", 100.0), ("noise", 56.8375)])
def test_piqe_agrees_with_another_implementation(harm: str, published: float) -> None:
    picture = make_texture()
    if harm == "blur":
        picture = cv2.GaussianBlur(picture, (0, 0), 3)
    if harm == "noise":
        picture = make_noise(picture, 20.0)
    assert piqe(picture) == pytest.approx(published, abs=0.3)


def test_a_blank_picture_has_nothing_that_is_looked_at() -> None:
    assert piqe(np.full((64, 64, 3), 128, np.uint8)) == 100.0


def test_temporal_error_sees_flicker_and_noise_and_forgives_motion(full_clip: Clip) -> None:
    frames = full_clip.frames[:9]
    flicker = frames.copy()
    flicker[1::2] = np.clip(flicker[1::2].astype(int) + 25, 0, 255)
    still = temporal_error(np.repeat(frames[:1], 9, axis=0))
    moving, noisy, unsteady = (temporal_error(clip) for clip in (frames, make_noise(frames, 12.0), flicker))
    assert still < 1e-6
    assert moving < 0.5 * min(noisy, unsteady)
    assert unsteady == pytest.approx((25 / 255) ** 2, rel=0.5)
