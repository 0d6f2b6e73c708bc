"""Paint on a hump: as the catalogue lays it out, in the light of its place, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.errors import InputError
from tasks.render.road_paint import paint_feature
from tasks.surface.road_profile import RoadHazard
from tests.render.test_road_edit import relief_of
from tests.render.weather.scenes import ASPHALT, road

HAZARD = RoadHazard(center_m=8.1, length_m=2.0, height_m=0.1)
MARKING = load("hazard marking", "zebra-yellow-black")


def read_colours(cloud):
    return cloud.sh[:, 0] * 0.28209479 + 0.5


def test_marks_and_gaps_are_as_wide_as_the_catalogue_says():
    flat = road()
    out = paint_feature(flat, relief_of(HAZARD), MARKING, 3.0, -3.0, ASPHALT)
    on = (np.abs(flat.means[:, 0] - 8.1) < 0.9) & (np.abs(flat.means[:, 1]) < 3.0)
    yellow = (read_colours(out)[:, 0] > 3 * read_colours(out)[:, 2]) & on
    place = np.unique(flat.means[on, 1].round(4))
    marked = np.array([yellow[on & (flat.means[:, 1].round(4) == y)].all() for y in place])
    edges = (place[1:] + place[:-1])[np.flatnonzero(np.diff(marked.astype(int)))] / 2
    np.testing.assert_allclose(np.diff(edges), MARKING.stripe_width, atol=0.075)
    assert len(edges) == 12
    assert marked[np.argmin(np.abs(place))]


def test_only_the_feature_within_the_carriageway_is_painted():
    flat = road()
    out = paint_feature(flat, relief_of(HAZARD), MARKING, 3.0, -2.0, ASPHALT)
    half = 1.0 + MARKING.joint_width / 2
    on = (np.abs(flat.means[:, 0] - 8.1) <= half) & (flat.means[:, 1] <= 3.0) & (flat.means[:, 1] >= -2.0)
    np.testing.assert_array_equal((out.sh != flat.sh).any(axis=(1, 2)), on)
    np.testing.assert_array_equal(out.means, flat.means)
    assert set(np.unique(out.class_id[on])) == {SemanticClass.ROAD, SemanticClass.MARKING}
    assert np.isin(out.class_id, ROAD_CLASSES).all()


def test_paint_sends_back_its_reflectance_of_the_light_on_the_road():
    """On an evenly lit road of known reflectance, paint by road is reflectance by reflectance."""
    flat = road()
    out = paint_feature(flat, relief_of(HAZARD), MARKING, 3.0, -3.0, ASPHALT)
    mark = out.class_id == SemanticClass.MARKING
    np.testing.assert_allclose(read_colours(out)[mark].mean(axis=0), MARKING.paint, rtol=0.03)


def test_paint_in_the_shade_is_as_much_darker_as_the_road_there():
    flat = road()
    shade = flat.means[:, 1] > 0
    sh = flat.sh.copy()
    sh[shade] = ((0.4 * read_colours(flat)[shade] - 0.5) / 0.28209479)[:, None]
    out = paint_feature(replace(flat, sh=sh), relief_of(HAZARD), MARKING, 3.0, -3.0, ASPHALT)
    yellow = (read_colours(out)[:, 0] > 3 * read_colours(out)[:, 2]) & (np.abs(flat.means[:, 1]) > 1.5)
    dark, bright = (read_colours(out)[yellow & side].mean(axis=0) for side in (shade, ~shade))
    np.testing.assert_allclose(dark / bright, 0.4, rtol=0.02)


def test_paint_where_the_light_is_known_has_the_colour_of_the_light_there():
    """In the shade a white surface is blue: paint keeps its reflectance, and its light can be changed."""
    daylight = np.array([[1.9, 1.8, 1.6], [0.2, 0.3, 0.5], [0.2, 0.2, 0.2]])
    flat = road()
    shares = np.zeros((len(flat), 4), np.float32)
    shares[:, 0] = flat.means[:, 1] > 0
    shares[:, 1] = 0.8
    white = shares[:, :1] * daylight[0] + 0.8 * daylight[1]
    sh = ((ASPHALT * white - 0.5) / 0.28209479)[:, None].astype(np.float32)
    lit = replace(flat, sh=sh, light=shares)
    out = paint_feature(lit, relief_of(HAZARD), MARKING, 3.0, -3.0, ASPHALT, daylight)
    mark = out.class_id == SemanticClass.MARKING
    np.testing.assert_allclose(read_colours(out)[mark], np.array(MARKING.paint) * white[mark], rtol=0.05)


def test_a_depression_is_a_patch_with_joints_under_the_road_s_own_markings():
    flat = road()
    line = np.abs(flat.means[:, 1] - 1.0) < 0.1
    flat = replace(flat, class_id=np.where(line, SemanticClass.MARKING, flat.class_id).astype(np.uint8))
    sunk = replace(HAZARD, height_m=-0.08)
    out = paint_feature(flat, relief_of(sunk), MARKING, 3.0, -3.0, ASPHALT)
    np.testing.assert_array_equal(out.class_id, flat.class_id)
    changed = (out.sh != flat.sh).any(axis=(1, 2))
    end = 1.0 + MARKING.patch_margin
    away = np.abs(flat.means[:, 0] - 8.1)
    inside = (np.abs(flat.means[:, 1]) <= 3.0) & ~line
    np.testing.assert_array_equal(changed, inside & (away <= end + MARKING.joint_width / 2))
    for colour, chosen in ((MARKING.patch, away < end - 0.05), (MARKING.joint, np.abs(away - end) < 0.04)):
        np.testing.assert_allclose(read_colours(out)[inside & chosen].mean(axis=0), colour, rtol=0.05)


def test_a_marking_without_a_patch_leaves_a_depression_as_it_is():
    flat = road()
    bare = replace(MARKING, patch=None)
    assert paint_feature(flat, relief_of(replace(HAZARD, height_m=-0.08)), bare, 3.0, -3.0, ASPHALT) is flat


def test_a_marking_that_is_not_there_lists_those_that_are():
    with pytest.raises(InputError, match="zebra-yellow-black"):
        load("hazard marking", "dragons-teeth")
