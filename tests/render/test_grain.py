"""Grain of near surfaces: fixed to the world, only where the camera resolves it, and of the mean that was there."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.grain import WAVES, add_grain
from tasks.render.rasterise.gbuffer import GBuffer

WIDTH, HEIGHT = 240, 160


def look_down(
    x: float, focal: float, height: float = 1.4, kind: int = SemanticClass.ROAD, shade: float = 0.1
):
    """A camera straight above a flat floor, its view, pose and intrinsics."""
    K = np.array([[focal, 0, WIDTH / 2], [0, focal, HEIGHT / 2], [0, 0, 1]])
    pose = np.array([[0.0, -1, 0, x], [-1, 0, 0, 0], [0, 0, -1, height], [0, 0, 0, 1]])
    depth = np.full((HEIGHT, WIDTH), height, np.float32)
    view = GBuffer(
        rgb=np.full((HEIGHT, WIDTH, 3), shade, np.float32), depth=depth, expected_depth=depth,
        alpha=np.ones_like(depth), normal=np.zeros((HEIGHT, WIDTH, 3), np.float32),
        class_id=np.full((HEIGHT, WIDTH), kind, np.uint8), object_id=np.zeros((HEIGHT, WIDTH), np.uint16),
    )  # fmt: skip
    return view, pose, K


def test_grain_moves_with_the_world_and_not_with_the_camera():
    step = 10 * 1.4 / 200
    here, there = (add_grain(*look_down(x, 200.0)).rgb[..., 0] for x in (3.0, 3.0 + step))
    # the picture's upper edge points to +x
    np.testing.assert_allclose(there[10:], here[:-10], atol=1e-3)
    assert here.std() > 0.01


def test_a_longer_lens_sees_finer_grain_and_a_far_surface_none():
    strengths = [add_grain(*look_down(3.0, focal)).rgb.std() for focal in (50.0, 200.0, 800.0)]
    assert strengths[0] < strengths[1] < strengths[2]
    view, pose, K = look_down(3.0, 200.0, height=200.0 * WAVES[-1])
    np.testing.assert_array_equal(add_grain(view, pose, K).rgb, view.rgb)


def test_grain_keeps_the_mean_and_leaves_bright_and_other_surfaces():
    assert add_grain(*look_down(3.0, 400.0)).rgb.mean() == pytest.approx(0.1, rel=0.02)
    for kind, shade in ((SemanticClass.ROAD, 0.6), (SemanticClass.VEHICLE, 0.1), (SemanticClass.SKY, 0.1)):
        view, pose, K = look_down(3.0, 400.0, kind=kind, shade=shade)
        np.testing.assert_array_equal(add_grain(view, pose, K).rgb, view.rgb)


def test_neighbouring_pixels_do_not_alias():
    """The finest wave in a picture is two pixels or more, so that neighbours are alike."""
    grain = add_grain(*look_down(3.0, 100.0)).rgb[..., 0]
    away = grain - grain.mean()
    assert (away[:, 1:] * away[:, :-1]).mean() > 0.3 * (away**2).mean()


def test_a_road_at_a_flat_angle_does_not_alias_along_its_length():
    """Pixels one above the other share a part of the road, also where each covers many waves of its length."""
    view, _, K = look_down(3.0, 400.0)
    pose = np.array([[0.0, 0, 1, 3], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1]])
    K[1, 2] = 0.5 - 70  # the horizon lies 70 rows above the picture: the road from 8 to 2.4 m
    depth = np.repeat(1.4 * 400 / (np.arange(HEIGHT) + 0.5 - K[1, 2])[:, None], WIDTH, axis=1)
    grain = add_grain(replace(view, depth=depth.astype(np.float32)), pose, K).rgb[..., 0]
    for rows in np.split(grain - grain.mean(), 8):
        assert (rows[1:] * rows[:-1]).mean() > 0.1 * (rows**2).mean() > 0
