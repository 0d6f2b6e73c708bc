"""Splats narrower than a pixel: antialiased clouds keep their light, and a road of small discs stays in place."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tests.render.clouds import HEIGHT, WIDTH, K, make_cloud
from tests.render.striped_road import crossing_row, striped_road, true_row

AHEAD = np.eye(4)
ANTIALIASED_VARIANCE, CLASSIC_VARIANCE = 0.1, 0.3


def light_of(radius_px: float, antialiased: bool) -> float:
    """Sum of opacity over the picture of one disc that faces the camera, over what its Gaussian holds [1]."""
    z, opacity = 5.0, 0.5
    disc = make_cloud(
        (0.0, 0, z), scales=(radius_px * z / K[0, 0], radius_px * z / K[1, 1], 1e-4), opacities=opacity
    )
    got = rasterise_view(prepare_gaussians(replace(disc, antialiased=antialiased)), AHEAD, K, WIDTH, HEIGHT)
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
    big = make_cloud((0.3, 0.2, 5.0), scales=(1.0, 0.8, 0.5), opacities=0.7)
    a, b = (
        rasterise_view(
            prepare_gaussians(replace(big, antialiased=antialiased)), AHEAD, K, WIDTH, HEIGHT
        ).alpha
        for antialiased in (False, True)
    )
    assert np.abs(a - b).max() < 0.01


def test_a_road_of_discs_below_a_pixel_moves_with_the_camera_and_does_not_slide():
    """From 18 m away to 8 m the crossing is where the pinhole has it; classic splats draw it a pixel too high."""
    road, ways = striped_road(), (0.0, 4.0, 8.0, 10.0)
    slide = [crossing_row(road, way) - true_row(way) for way in ways]
    classic = [crossing_row(replace(road, antialiased=False), way) - true_row(way) for way in ways]
    assert np.ptp(slide) < 0.25
    assert np.ptp(classic) > 2 * np.ptp(slide)
