"""Which surfaces bear snow: by their own normals where these are exact, by their neighbours' where they scatter."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.render.weather.scene_light import append_gaussians
from tasks.render.weather.snow.bearing import bearing_share, facing_share, normals_agree
from tests.render.weather.scenes import surfels

SPACING, SCATTER_DEG = 0.06, 30


def sheet(x, y, z, normal, kind):
    """Surfels strewn evenly over a rectangle; one of the three extents is a number."""
    axes = [np.arange(*extent, SPACING) if isinstance(extent, tuple) else [extent] for extent in (x, y, z)]
    points = np.stack([axis.ravel() for axis in np.meshgrid(*axes)], axis=1)
    return surfels(points, normal, 0.05, 0.2, kind)


def box_on_a_lawn():
    """A box of 2 m x 1.6 m x 1.4 m: roof, near side and right side, on ground about it."""
    scene = sheet((-2.0, 6.0), (-3.0, 3.0), 0.0, (0, 0, 1), SemanticClass.TERRAIN)
    for x, y, z, normal in (
        ((1.0, 3.0), (-0.8, 0.8), 1.4, (0, 0, 1)),
        (1.0, (-0.8, 0.8), (0.0, 1.4), (-1, 0, 0)),
        ((1.0, 3.0), -0.8, (0.0, 1.4), (0, -1, 0)),
    ):
        scene = append_gaussians(scene, sheet(x, y, z, normal, SemanticClass.OTHER))
    return scene


@pytest.fixture(scope="module")
def exact():
    return box_on_a_lawn()


@pytest.fixture(scope="module")
def scattered(exact):
    """The same, whose normals err by some tens of degrees and whose places by two centimetres."""
    rng = np.random.default_rng(3)
    turn = Rotation.from_rotvec(np.deg2rad(SCATTER_DEG) * rng.standard_normal((len(exact), 3)))
    moved = exact.means + 0.02 * rng.standard_normal(exact.means.shape)
    return replace(
        exact, normals=turn.apply(exact.normals).astype(np.float32), means=moved.astype(np.float32)
    )


@pytest.fixture(scope="module")
def anchors(parameters):
    return parameters.kinds["snow"].snow_cover.anchors


def test_exact_normals_are_taken_at_their_word(exact, anchors):
    assert normals_agree(exact)
    assert np.array_equal(bearing_share(exact, anchors), facing_share(exact.normals[:, 2], anchors))


def test_a_scene_of_road_alone_has_no_normals_to_doubt(exact):
    assert normals_agree(replace(exact, class_id=np.full(len(exact), SemanticClass.ROAD, np.uint8)))


def test_scattered_normals_leave_a_closed_cover_and_bare_sides(exact, scattered, anchors):
    assert not normals_agree(scattered)
    share, own = (
        f(scattered)
        for f in (lambda s: bearing_share(s, anchors), lambda s: facing_share(s.normals[:, 2], anchors))
    )
    ground = exact.class_id == SemanticClass.TERRAIN
    roof = (exact.means[:, 2] == np.float32(1.4)) & ~ground
    inner = (np.abs(exact.means[:, 1]) < 0.5) & (np.abs(exact.means[:, 0] - 2) < 0.7)
    side = ~ground & ~roof & (exact.means[:, 2] > 0.3) & (exact.means[:, 2] < 1.1)
    # specks: of the discs' own normals a fifth of the lawn would stay bare, a tenth of the sides be white
    assert np.mean(own[ground] < 0.5) > 0.1 and np.mean(own[side] > 0.5) > 0.04
    assert np.mean(share[ground] < 0.9) < 0.01
    assert share[roof & inner].min() > 0.9
    assert np.mean(share[side] > 0.3) < 0.01


def test_a_trained_cloud_whose_ground_has_no_class_is_covered_too(exact, scattered, anchors):
    kind = np.full(len(exact), SemanticClass.OTHER, np.uint8)
    share = bearing_share(replace(scattered, class_id=kind), anchors)
    lawn = (exact.class_id == SemanticClass.TERRAIN) & (np.abs(exact.means[:, 1]) > 1.3)
    assert np.mean(share[lawn] < 0.8) < 0.01


def test_the_top_of_a_wall_is_covered_whichever_way_its_discs_are_turned(anchors):
    rng = np.random.default_rng(4)
    wall = sheet(1.0, (-2.0, 2.0), (0.0, 1.4), (-1, 0, 0), SemanticClass.OTHER)
    turn = Rotation.from_rotvec(np.deg2rad(SCATTER_DEG) * rng.standard_normal((len(wall), 3)))
    share = bearing_share(replace(wall, normals=turn.apply(wall.normals).astype(np.float32)), anchors)
    assert share[wall.means[:, 2] > 1.33].min() > 0.9
    assert np.mean(share[wall.means[:, 2] < 1.1] > 0.3) < 0.01


def test_a_kerb_beside_the_road_keeps_a_bare_face_and_the_lawn_behind_it_stays_closed(anchors):
    """Of a reconstruction, whose kerb is ground like the lawn: a mean wider than its face would lay it flat."""
    scene = sheet((0.0, 6.0), (-2.0, 0.0), 0.0, (0, 0, 1), SemanticClass.ROAD)
    for y, z, normal in ((0.0, (0.02, 0.16), (0, -1, 0)), ((0.0, 3.0), 0.16, (0, 0, 1))):
        scene = append_gaussians(scene, sheet((0.0, 6.0), y, z, normal, SemanticClass.TERRAIN))
    rng = np.random.default_rng(4)
    turn = Rotation.from_rotvec(np.deg2rad(SCATTER_DEG) * rng.standard_normal((len(scene), 3)))
    rough = replace(scene, normals=turn.apply(scene.normals).astype(np.float32))
    assert not normals_agree(rough)
    share = bearing_share(rough, anchors)
    ground = scene.class_id == SemanticClass.TERRAIN
    face = ground & (scene.means[:, 2] < 0.1)
    lawn = ground & (scene.means[:, 1] > 0.8)
    assert np.median(share[face]) < 0.3
    assert np.mean(share[lawn] < 0.9) < 0.02
    # the same ground with no road beside it has no kerb
    alone = replace(rough, class_id=np.where(ground, rough.class_id, SemanticClass.TERRAIN).astype(np.uint8))
    assert np.median(bearing_share(alone, anchors)[face]) > 0.3
