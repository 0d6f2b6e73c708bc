"""The sky of a drive: what stands still while the car moves, and its light in every direction."""

import numpy as np
import pytest

from tasks.reconstruction.sky import Sky, build_panorama, fit_sky, mask_sky
from tests.reconstruction.small_camera import CY, SHAPE, F, K, draw_smooth_noise

CAMERA_TO_WORLD = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]])


def drive_below_a_sky() -> tuple[list[np.ndarray], np.ndarray]:
    """Pictures with a sky above row 40 that stands still, and speckles below that change."""
    pictures = []
    elevation = np.arctan((CY - np.arange(SHAPE[0])) / F)
    for n in range(6):
        picture = np.repeat((0.4 - 0.3 * elevation)[:, None], SHAPE[1], axis=1)
        picture[40:] = draw_smooth_noise((SHAPE[0] - 40, SHAPE[1]), 20 + n) / 255
        pictures.append(np.repeat(picture[..., None], 3, axis=2).astype(np.float32))
    return pictures, np.tile(CAMERA_TO_WORLD, (6, 1, 1))


def test_what_stands_still_is_sky_and_what_moves_is_not() -> None:
    pictures, poses = drive_below_a_sky()
    sky = fit_sky(pictures, K, poses)
    assert sky is not None
    mask = mask_sky(pictures[2], sky, K, poses[2])
    assert mask[:38].mean() > 0.99
    assert not mask[52:].any()


def test_the_fitted_sky_has_the_light_of_each_direction() -> None:
    pictures, poses = drive_below_a_sky()
    sky = fit_sky(pictures, K, poses)
    assert sky is not None
    elevation = np.linspace(*sky.elevation, 7)
    found = sky.radiance_along(np.zeros(7), elevation)
    np.testing.assert_allclose(found, np.repeat((0.4 - 0.3 * elevation)[:, None], 3, axis=1), atol=0.005)


def test_a_drive_without_steady_sky_has_none() -> None:
    pictures, poses = drive_below_a_sky()
    for n, picture in enumerate(pictures):
        picture *= 1 + 0.3 * n
    assert fit_sky(pictures, K, poses) is None
    assert not mask_sky(pictures[0], None, K, poses[0]).any()


def test_panorama_puts_zenith_first_and_left_to_the_left() -> None:
    sky = Sky(
        coefficients=np.outer([0.5, 0.1, -0.2, 0, 0, 0], np.ones(3)), azimuth=(-0.5, 0.5), elevation=(0, 0.4)
    )
    pictures, poses = drive_below_a_sky()
    masks = [np.zeros(SHAPE, bool) for _ in pictures]
    out = build_panorama(sky, pictures, masks, K, poses, 64)
    assert out.shape == (64, 128, 3)
    assert out[28, 64 - 8, 0] > out[28, 64 + 8, 0]  # brighter towards +y, which is left of the centre column
    assert out[31, 64, 0] == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(out[0], 0.5 - 0.2 * 0.4 + 0.1 * 0, atol=0.06)
    assert (out[40:] == out[40, 0]).all()
