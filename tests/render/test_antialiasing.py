"""Splats narrower than a pixel: antialiased clouds keep their light, and a road of small discs stays in place."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.camera import viewmat
from tasks.render.rasteriser import prepare, rasterise
from tasks.render.spherical_harmonics import C0
from tasks.scene.gaussians import Gaussians
from tests.render.clouds import HEIGHT, WIDTH, K, cloud

AHEAD = np.eye(4)
ANTIALIASED_VARIANCE, CLASSIC_VARIANCE = 0.1, 0.3


def light_of(radius_px: float, antialiased: bool) -> float:
    """Sum of opacity over the picture of one disc that faces the camera, over what its Gaussian holds [1]."""
    z, opacity = 5.0, 0.5
    disc = cloud(
        (0.0, 0, z), scales=(radius_px * z / K[0, 0], radius_px * z / K[1, 1], 1e-4), opacities=opacity
    )
    got = rasterise(prepare(replace(disc, antialiased=antialiased)), AHEAD, K, WIDTH, HEIGHT)
    return float(got.alpha.sum()) / (opacity * 2 * np.pi * radius_px**2)


@pytest.mark.parametrize("radius_px", [0.4, 1.0, 4.0])
def test_an_antialiased_splat_holds_its_light_whatever_its_size(radius_px):
    # what falls below 1/255 of opacity is cut off, 2 to 3 % here
    assert light_of(radius_px, antialiased=True) == pytest.approx(1, abs=0.05)


def test_a_classic_splat_grows_by_a_pixels_variance():
    radius = 0.4
    grown = (radius**2 + CLASSIC_VARIANCE) / radius**2
    assert light_of(radius, antialiased=False) == pytest.approx(grown, rel=0.05)


def test_splats_much_larger_than_a_pixel_are_drawn_alike():
    big = cloud((0.3, 0.2, 5.0), scales=(1.0, 0.8, 0.5), opacities=0.7)
    a, b = (
        rasterise(prepare(replace(big, antialiased=antialiased)), AHEAD, K, WIDTH, HEIGHT).alpha
        for antialiased in (False, True)
    )
    assert np.abs(a - b).max() < 0.01


def striped_road() -> Gaussians:
    """A level road with a bright crossing from 18 to 19 m, in cells of 4 cm."""
    x, y = np.meshgrid(np.arange(6, 32, 0.04), np.arange(-0.3, 0.3, 0.04), indexing="ij")
    means = np.column_stack((x.ravel(), y.ravel(), 0 * x.ravel()))
    bright = ((means[:, 0] > 18) & (means[:, 0] < 19)).astype(np.float32)
    n = len(means)
    return Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        scales=np.tile(np.array([0.03, 0.03, 0.001], np.float32), (n, 1)),
        opacities=np.full(n, 0.9, np.float32),
        sh=((0.1 + 0.8 * bright - 0.5) / C0)[:, None, None].repeat(3, axis=2).astype(np.float32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (n, 1)),
        class_id=np.full(n, SemanticClass.ROAD, np.uint8),
        antialiased=True,
    )


def crossing_row(road: Gaussians, advance: float) -> float:
    """Picture row of the crossing's middle, by the first moment of its light [px]."""
    pose = np.array([[0.0, 0, 1, advance], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1]])
    lens = np.array([[400.0, 0, 8], [0, 400.0, 20], [0, 0, 1]])
    got = rasterise(prepare(road), viewmat(pose), lens, 16, 100)
    column = got.rgb[:, 8, 0] / np.maximum(got.alpha[:, 8], 1e-6)
    light = np.clip(column - 0.12, 0, None)
    return float((light * (np.arange(100) + 0.5)).sum() / light.sum())


def true_row(advance: float) -> float:
    edges = 20 + 400 * 1.4 / (np.array([18.0, 19.0]) - advance)
    return float(edges.mean())


def test_a_road_of_discs_below_a_pixel_moves_with_the_camera_and_does_not_slide():
    """From 18 m away to 8 m the crossing is where the pinhole has it; classic splats draw it a pixel too high."""
    road, ways = striped_road(), (0.0, 4.0, 8.0, 10.0)
    slide = [crossing_row(road, way) - true_row(way) for way in ways]
    classic = [crossing_row(replace(road, antialiased=False), way) - true_row(way) for way in ways]
    assert np.ptp(slide) < 0.25
    assert np.ptp(classic) > 2 * np.ptp(slide)
