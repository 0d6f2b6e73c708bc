"""Halved pictures show what the whole ones show, to the camera that goes with them."""

import numpy as np

from tasks.eval.poses.checks import JudgeCamera
from tasks.eval.poses.resampling import halve_camera, halve_frames
from tasks.eval.poses.rigid import viewing_rays

CAMERA = JudgeCamera(
    K=np.array(((50.0, 0, 19.5), (0, 50, 14.5), (0, 0, 1))), T_rig_camera=np.eye(4), distortion=None, line_delay_s=1e-5
)  # fmt: skip
HEIGHT, WIDTH = 31, 41
PLANE = np.array((0.02, -0.03, 0.1))
"""Points x with PLANE . x = 1 [m-1]."""


def draw_plane(camera, shape):
    """Camera z of the plane at every pixel [H, W]."""
    rows, columns = np.indices(shape)
    rays = viewing_rays(np.stack((columns, rows), axis=-1).reshape(-1, 2), camera.K)
    return (1 / (rays @ PLANE)).reshape(shape).astype(np.float32)


def halve_plane(depth, rgb=None):
    buffers = {
        "rgb": np.zeros((1, *depth.shape, 3), np.uint8) if rgb is None else rgb[None],
        "depth": depth[None],
        "class": np.arange(depth.size, dtype=np.uint8).reshape(1, *depth.shape),
    }
    return {name: values[0] for name, values in halve_frames(buffers).items()}


def test_a_plane_keeps_its_depth_as_the_halved_camera_sees_it():
    halved = halve_plane(draw_plane(CAMERA, (HEIGHT, WIDTH)))
    np.testing.assert_allclose(
        halved["depth"], draw_plane(halve_camera(CAMERA), (HEIGHT // 2, WIDTH // 2)), rtol=1e-5
    )


def test_pixels_of_two_surfaces_or_without_depth_have_none():
    depth = np.full((HEIGHT, WIDTH), 10, np.float32)
    depth[:, 5:] = 12
    depth[8, 20] = np.nan
    found = np.argwhere(np.isnan(halve_plane(depth)["depth"]))
    assert {(row, column) for row, column in found.tolist()} == {(row, 2) for row in range(15)} | {(4, 10)}


def test_colours_are_means_the_class_is_that_of_the_upper_left_pixel_and_two_rows_take_twice_as_long():
    rgb = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    rgb[0, 1], rgb[1, 0] = 100, 60
    halved = halve_plane(np.ones((HEIGHT, WIDTH), np.float32), rgb)
    assert halved["rgb"][0, 0].tolist() == [40, 40, 40]
    assert halved["class"][1, 2] == (2 * WIDTH + 4) % 256
    assert halve_camera(CAMERA).line_delay_s == 2e-5
