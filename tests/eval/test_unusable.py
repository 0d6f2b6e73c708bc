"""Pixels that the pose checks may not read."""

import numpy as np

from tasks.conventions import SemanticClass
from tasks.eval.poses.checks import glossy_pixels, unusable_pixels

CLASSES = np.array(
    [
        [
            [
                SemanticClass.SKY,
                SemanticClass.ROAD,
                SemanticClass.MARKING,
                SemanticClass.BUILDING,
                SemanticClass.VEGETATION,
            ]
        ]
    ],
    np.uint8,
)


def test_dry_roads_and_snow_are_looked_at_and_the_sky_and_crowns_are_not():
    assert unusable_pixels(CLASSES, 0.0).tolist() == [[[True, False, False, False, True]]]


def test_a_wet_road_is_a_mirror_and_is_left_out():
    assert unusable_pixels(CLASSES, 0.1).tolist() == [[[True, True, True, False, True]]]


def test_paint_and_panes_mirror_whatever_the_weather():
    kinds = np.array([[[SemanticClass.VEHICLE, SemanticClass.BUILDING, SemanticClass.ROAD]]], np.uint8)
    assert glossy_pixels(kinds).tolist() == [[[True, False, False]]]
