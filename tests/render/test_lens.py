"""The lens: OpenCV's own formula, its inverse, and lenses that no camera has."""

import cv2
import numpy as np
import pytest
import yaml

from catalogs.entries import find_entry, load
from tasks.errors import InputError
from tasks.eval.poses.resampling import undistort_frames as seen_by_pinhole
from tasks.render.lens import Lens, distort_rays, pixel_directions, undistort_points

LENS = Lens(k1=-0.37, k2=0.197, p1=1.4e-3, p2=5.7e-4, k3=-0.068)
K = np.array([[400.0, 0, 240], [0, 400, 160], [0, 0, 1]])


def test_rays_land_where_opencv_puts_them():
    rays = np.random.default_rng(1).uniform((-0.8, -0.6, 1), (0.8, 0.6, 1), (500, 3))
    ours = np.stack(distort_rays(rays[:, 0], rays[:, 1], LENS.coefficients), axis=-1) * 400 + (240, 160)
    theirs, _ = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), K, LENS.coefficients)
    np.testing.assert_allclose(ours, theirs[:, 0], atol=1e-9)


def test_undistortion_is_the_inverse_and_agrees_with_opencv():
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, 31), np.linspace(-0.4, 0.4, 21))
    back_x, back_y = undistort_points(x, y, LENS)
    again = distort_rays(back_x, back_y, LENS.coefficients)
    np.testing.assert_allclose(again, (x, y), atol=1e-12)
    places = np.stack((x, y), axis=-1).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    theirs = cv2.undistortPointsIter(places, np.eye(3), LENS.coefficients, np.eye(3), np.eye(3), criteria)
    np.testing.assert_allclose(np.stack((back_x, back_y), axis=-1).reshape(-1, 1, 2), theirs, atol=1e-8)


def test_a_lens_of_zeros_is_a_pinhole():
    np.testing.assert_array_equal(pixel_directions(K, 48, 32, Lens()), pixel_directions(K, 48, 32, None))


def test_a_polynomial_that_turns_back_inside_the_picture_is_refused(tmp_path):
    with pytest.raises(InputError, match="must spread the whole picture"):
        pixel_directions(K, 480, 320, Lens(k1=-0.9))
    entry = yaml.safe_load(find_entry("camera", "dashcam-480x320").read_text())
    entry["k1"] = {"value": -0.9, "unit": "1", "source": "none"}
    (tmp_path / "bent.yaml").write_text(yaml.safe_dump(entry))
    with pytest.raises(InputError, match="must spread the whole picture"):
        load("camera", tmp_path / "bent.yaml")


def test_only_the_camera_that_asks_for_it_has_lens_and_shutter():
    for name in ("dashcam-480x320", "dashcam-480x320-noisy", "dashcam-1280x720"):
        assert load("camera", name).plain
    rolling = load("camera", "dashcam-480x320-rolling")
    assert rolling.lens == Lens(k1=-0.3691481, k2=0.1968681, p1=1.353473e-3, p2=5.677587e-4, k3=-0.06770705)
    # 45 full frames a second
    assert rolling.line_delay_s * rolling.height == pytest.approx(1 / 45, rel=1e-3)
    assert rolling.motion_blur and rolling.exposure_s == load("camera", "dashcam-480x320").exposure_s


def test_the_judges_take_the_lens_out_again():
    """A plane's inverse depth is linear in a pinhole's picture, and a straight line is straight."""
    x, y = np.moveaxis(pixel_directions(K, 480, 320, LENS), -1, 0)
    depth = (1 / (0.05 + 0.1 * (y + 0.5) + 0.02 * x)).astype(np.float32)
    line = np.exp(-0.5 * ((x - 0.4 - 0.2 * y) * 400 / 3) ** 2)
    rgb = np.repeat((255 * line)[..., None], 3, axis=2).astype(np.uint8)
    seen = seen_by_pinhole({"rgb": rgb[None], "depth": depth[None]}, K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]],
                           LENS.coefficients)  # fmt: skip
    u, v = np.meshgrid(np.arange(480) + 0.5, np.arange(320) + 0.5)
    plane = 0.05 + 0.1 * ((v - 160) / 400 + 0.5) + 0.02 * (u - 240) / 400
    np.testing.assert_allclose(1 / seen["depth"][0], plane, rtol=2e-3)
    weights = seen["rgb"][0, :, :, 0].astype(float)
    found = (weights * u).sum(axis=1) / weights.sum(axis=1)
    np.testing.assert_allclose(found, 240 + 400 * (0.4 + 0.2 * (v[:, 0] - 160) / 400), atol=0.1)
