"""Snow on the ground: where it lies, how much of it, and what it looks like."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.weather.coverage_field import FieldParameters, height_field, rank_uniform
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.scene_light import append_gaussians, mean_colours, remove_gaussians
from tasks.render.weather.snow.field import (
    LyingSnow,
    coverage_rank,
    covered_share,
    edge_width,
    local_depth_mm,
    locate_snow,
    snow_field,
)
from tasks.render.weather.snow.layer import hidden_share, snow_layer, snowed_over, whiten_gaussians
from tasks.render.weather.snow.road_anchors import road_anchors
from tasks.scene.route import Route
from tasks.scene.surroundings import add_surroundings
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import ASPHALT, road, surfels

WHITE = np.full(3, ASPHALT / 0.1)
COVERAGES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)
WIDEST = 0.45


@pytest.fixture(scope="module")
def street():
    return road()


def field_of(scene, parameters, seed=5, route=None):
    p = parameters.kinds["snow"].snow_cover
    return snow_field(scene, p.patches, p.stretch, p.tracks, p.anchors, route, seed)


def lying(coverage, depth_mm, full_cover_mm=20.0):
    return LyingSnow(coverage=coverage, depth_mm=depth_mm, full_cover_mm=full_cover_mm)


def lay_at(field, x, y):
    return locate_snow(field, np.column_stack((x, y, 0 * x)))


def rank_at(field, x, y):
    return coverage_rank(field, lay_at(field, x, y))


def layer_at(street, parameters, coverage, depth_mm=None, seed=5):
    field = field_of(street, parameters, seed)
    depth_mm = 20.0 * coverage if depth_mm is None else depth_mm
    return snow_layer(street, field, WHITE, lying(coverage, depth_mm), parameters.kinds["snow"].snow_cover)


def test_ranks_by_weight_are_uniform_and_keep_the_order():
    rng = np.random.Generator(np.random.Philox(1))
    values, weights = rng.standard_normal(5000) ** 3, rng.uniform(0.1, 2, 5000)
    ranks = rank_uniform(values, weights)
    assert np.all(np.diff(ranks[np.argsort(values)]) > 0)
    for level in (0.1, 0.5, 0.9):
        assert weights[ranks <= level].sum() / weights.sum() == pytest.approx(level, abs=1e-3)


def test_fields_have_unit_variance_and_fade_under_a_wide_footprint():
    waves = FieldParameters(coarsest_m=2.0, octaves=4, roughness=0.6)
    x, y = np.meshgrid(np.arange(0, 200, 0.5), np.arange(0, 200, 0.5))
    near = height_field(x, y, waves, 1, "test")
    assert near.mean() == pytest.approx(0, abs=0.03)
    assert near.std() == pytest.approx(1, abs=0.03)
    spreads = [height_field(x, y, waves, 1, "test", footprint).std() for footprint in (0.05, 0.3, 0.8, 3.0)]
    assert np.all(np.diff(spreads) < 0)
    assert spreads[-1] == 0


@pytest.mark.parametrize("coverage", COVERAGES)
def test_as_much_of_the_road_is_covered_as_asked(street, parameters, coverage):
    field = field_of(street, parameters)
    xi = rank_at(field, street.means[:, 0], street.means[:, 1])
    assert np.mean(xi <= coverage) == pytest.approx(coverage, abs=0.005)


def test_more_coverage_adds_to_what_is_there(street, parameters):
    anchors = [set(layer_at(street, parameters, coverage).anchors.tolist()) for coverage in COVERAGES]
    for less, more in pairwise(anchors):
        assert less < more or (not less and more)


def test_local_depth_keeps_the_mean_and_the_support():
    xi = (np.arange(100000) + 0.5) / 100000
    for coverage, mean, full in (
        (0.25, 5, 20),
        (0.5, 10, 20),
        (1, 20, 20),
        (1, 30, 20),
        (0.55, 22, 40),
        (1, 44, 40),
    ):
        depth = local_depth_mm(xi, lying(coverage, mean, full), WIDEST)
        assert depth.mean() == pytest.approx(mean, rel=1e-3)
        assert np.array_equal(depth > 0, xi < coverage + edge_width(coverage, WIDEST) / 2)
        assert np.all(np.diff(depth) <= 0)
    assert local_depth_mm(xi, lying(0.0, 0.0), WIDEST).max() == 0


def test_the_soft_edge_of_snow_keeps_the_share_and_more_coverage_hides_more_everywhere():
    xi, before = (np.arange(100000) + 0.5) / 100000, 0.0
    for coverage in COVERAGES:
        share = covered_share(xi, coverage, WIDEST)
        assert share.mean() == pytest.approx(coverage, abs=1e-4)
        assert np.all(share >= before - 1e-12)
        before = share
    half = covered_share(xi, 0.5, WIDEST)
    assert ((half > 0.1) & (half < 0.9)).mean() > 0.25


def test_snow_lies_over_its_anchors_along_their_normals(street, parameters):
    snow = layer_at(street, parameters, 1.0, 30.0)
    layer, anchors = snow.gaussians, snow.anchors
    lift = layer.means - street.means[anchors]
    assert np.abs(lift[:, :2]).max() < 1e-5
    assert lift[:, 2].mean() == pytest.approx(0.030, rel=0.1)
    assert lift[:, 2].min() > 0
    assert np.array_equal(layer.class_id, street.class_id[anchors])


def test_lifting_follows_a_tilted_road(parameters):
    level = road(length=6.0)
    turn = Rotation.from_euler("y", 12, degrees=True)
    quats = np.tile(turn.as_quat(scalar_first=True).astype(np.float32), (len(level), 1))
    slope = replace(
        level, means=turn.apply(level.means).astype(np.float32), quats_wxyz=quats,
        normals=turn.apply(level.normals).astype(np.float32),
    )  # fmt: skip
    snow = layer_at(slope, parameters, 1.0, 30.0)
    layer, anchors = snow.gaussians, snow.anchors
    assert len(anchors) > 0.9 * len(slope)
    lift = layer.means - slope.means[anchors]
    lift /= np.linalg.norm(lift, axis=1, keepdims=True)
    assert lift @ turn.apply([0, 0, 1]) == pytest.approx(np.ones(len(lift)), abs=1e-3)


def test_closed_snow_buries_its_anchors_and_a_few_patches_do_not(street, parameters):
    assert len(layer_at(street, parameters, 1.0, 30.0).buried) == len(street)
    assert len(layer_at(street, parameters, 0.02, 0.02).buried) < 0.005 * len(street)
    half = layer_at(street, parameters, 0.5)
    assert 0.4 * len(half.anchors) < len(half.buried) < len(half.anchors)
    assert set(half.buried.tolist()) < set(half.anchors.tolist())


def test_what_stands_up_or_floats_is_no_anchor(street, parameters):
    kerb = surfels(np.array([[5.0, 0.0, 0.05]]), (0, 1, 0), 0.04, 0.2, SemanticClass.ROAD)
    floating = surfels(np.array([[6.0, 0.0, 0.3]]), (0, 0, 1), 0.04, 0.2, SemanticClass.ROAD)
    grass = surfels(np.array([[7.0, 0.0, 0.0]]), (0, 0, 1), 0.04, 0.2, SemanticClass.TERRAIN)
    scene = append_gaussians(append_gaussians(append_gaussians(street, kerb), floating), grass)
    anchors = road_anchors(scene, parameters.kinds["snow"].snow_cover.anchors)
    assert set(range(len(street), len(scene))).isdisjoint(anchors.index.tolist())
    assert len(anchors.index) == len(street)
    assert anchors.flat.all()
    assert anchors.normal[:, 2].min() > np.cos(np.deg2rad(30))


def test_round_gaussians_take_the_normal_of_their_neighbours(street, parameters):
    round_road = replace(street, scales=np.full_like(street.scales, 0.05))
    anchors = road_anchors(round_road, parameters.kinds["snow"].snow_cover.anchors)
    assert len(anchors.index) == len(street)
    assert not anchors.flat.any()
    assert anchors.normal[:, 2].min() > 0.99
    layer = layer_at(round_road, parameters, 1.0, 30.0).gaussians
    assert layer.scales[:, 2].max() < 0.2 * layer.scales[:, 0].min()


def test_the_picture_shows_the_coverage_asked(street, parameters):
    """Share of road pixels nearer to snow than to asphalt, from the car, by the field's share of the same pixels."""
    view = shutter(width=240, height=160, focal=200.0)
    middle = (ASPHALT * parameters.kinds["snow"].snow_cover.damp_albedo_ratio + 0.87 * WHITE[0]) / 2
    seen, expected = [], []
    for coverage in COVERAGES:
        field = field_of(street, parameters)
        amount = (lying(coverage, 20.0 * coverage), parameters.kinds["snow"].snow_cover)
        snow = snow_layer(street, field, WHITE, *amount)
        scene = append_gaussians(
            remove_gaussians(whiten_gaussians(street, field, WHITE, *amount), snow.buried), snow.gaussians
        )
        gbuffer = rasterise_view(
            prepare_gaussians(scene), np.linalg.inv(view.T_world_camera), view.K, 240, 160
        )
        inside = gbuffer.alpha > 0.9
        place = view.T_world_camera[:3, 3] + gbuffer.depth[..., None] * pixel_rays(view)
        expected.append(float((rank_at(field, place[inside, 0], place[inside, 1]) <= coverage).mean()))
        seen.append(float((gbuffer.rgb[inside].mean(axis=1) > middle).mean()))
    assert np.all(np.diff(seen) > 0)
    # half of a soft edge is nearer to asphalt
    assert seen == pytest.approx(expected, abs=0.1)


def test_snow_is_as_bright_as_its_albedo_in_the_light(street, parameters):
    layer = layer_at(street, parameters, 1.0, 80.0).gaussians
    assert mean_colours(layer).mean(axis=0) == pytest.approx(
        np.array(parameters.kinds["snow"].snow_cover.albedo) * WHITE, rel=0.02
    )
    assert hidden_share(np.array(10.0), parameters.kinds["snow"].snow_cover) > 0.97


def test_snow_settles_on_what_faces_up_and_leaves_walls_bare(street, parameters):
    flat = surfels(np.array([[5.0, 5.0, 0.1]]), (0, 0, 1), 0.1, 0.1, SemanticClass.SIDEWALK)
    wall = surfels(np.array([[5.0, 6.0, 1.0]]), (0, 1, 0), 0.1, 0.1, SemanticClass.BUILDING)
    scene = append_gaussians(append_gaussians(street, flat), wall)
    field = field_of(scene, parameters)
    colours = mean_colours(
        whiten_gaussians(scene, field, WHITE, lying(1.0, 30.0), parameters.kinds["snow"].snow_cover)
    )
    assert colours[-2].mean() > 1.0
    assert colours[-1] == pytest.approx(mean_colours(scene)[-1], rel=1e-5)


def test_under_a_roof_the_ground_is_white_and_what_stands_on_it_is_bare(street, parameters):
    x, y = (v.ravel() for v in np.meshgrid(np.arange(4.0, 6.0, 0.05), np.arange(5.0, 7.0, 0.05)))
    roof = surfels(np.column_stack((x, y, 3.0 + 0 * x)), (0, 0, 1), 0.05, 0.1, SemanticClass.BUILDING)
    table, ground = (
        surfels(np.array([[5.0, 6.0, height]]), (0, 0, 1), 0.1, 0.1, kind)
        for height, kind in ((1.0, SemanticClass.OTHER), (0.1, SemanticClass.SIDEWALK))
    )
    scene = append_gaussians(append_gaussians(append_gaussians(street, roof), table), ground)
    colours = mean_colours(
        whiten_gaussians(
            scene, field_of(scene, parameters), WHITE, lying(1.0, 30.0), parameters.kinds["snow"].snow_cover
        )
    )
    assert colours[-1].mean() > 1.0 and colours[len(street)].mean() > 1.0
    assert colours[-2].mean() < 0.2


def test_wheel_tracks_are_covered_last_and_leave_the_share_as_it_is(street, parameters):
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, 0, 3] = 18.0
    route = Route(station=np.array([0.0, 18.0]), T_world_rig=poses)
    field = field_of(street, parameters, route=route)
    x, y = street.means[:, 0], street.means[:, 1]
    xi = rank_at(field, x, y)
    assert np.mean(xi <= 0.5) == pytest.approx(0.5, abs=0.005)
    track = lay_at(field, x, y).tracks > 0.8
    assert 0.02 < track.mean() < 0.12
    assert np.abs(np.abs(y[track]) - parameters.kinds["snow"].snow_cover.tracks.gauge_m / 2).max() < 0.5
    assert np.mean(xi[track] <= 0.5) < 0.25
    snow = snow_layer(street, field, WHITE, lying(1.0, 30.0), parameters.kinds["snow"].snow_cover)
    layer, pressed = snow.gaussians, track[snow.anchors]
    assert mean_colours(layer)[pressed].mean() < 0.95 * mean_colours(layer)[~pressed].mean()
    assert lay_at(field_of(street, parameters), x, y).tracks.max() == 0


def test_another_seed_lays_other_patches_of_the_same_share(street, parameters):
    first, second = (set(layer_at(street, parameters, 0.5, seed=seed).anchors.tolist()) for seed in (1, 2))
    assert len(first) == pytest.approx(len(second), rel=0.05)
    assert len(first & second) < 0.85 * len(first)


def test_scenes_that_blend_display_colours_get_the_same_snow(street, parameters):
    display = replace(street, display_encoded=True)
    layer = layer_at(display, parameters, 1.0, 30.0).gaussians
    linear = layer_at(street, parameters, 1.0, 30.0).gaussians
    assert mean_colours(layer) == pytest.approx(mean_colours(linear), rel=1e-4)


@pytest.mark.parametrize(("coverage", "depth_mm"), [(1.0, 30.0), (1.0, 1.0), (0.6, 12.0)])
def test_snow_and_ground_know_how_densely_both_together_cover(street, parameters, coverage, depth_mm):
    """Against a count of the joined cloud: thick snow alone, thin snow among the discs of the ground."""
    ground = add_surroundings(replace(street, antialiased=True))
    snow = layer_at(ground, parameters, coverage, depth_mm)
    joined = snowed_over(ground, snow)
    assert len(joined.surroundings) == len(joined) == len(ground) - len(snow.buried) + len(snow.anchors)
    counted = add_surroundings(joined).surroundings
    ratio = joined.surroundings / counted
    layer = np.arange(len(joined)) >= len(joined) - len(snow.anchors)
    assert np.median(ratio[layer, 0]) == pytest.approx(1, abs=0.15)
    under = np.isin(np.delete(np.arange(len(ground)), snow.buried), snow.anchors)
    if under.any():
        assert np.median(ratio[: len(under)][under, 0]) == pytest.approx(1, abs=0.15)
    narrow = layer.copy()
    narrow[layer] = np.sort(snow.gaussians.scales, axis=1)[:, 2] < 0.7 * np.median(ground.scales.max(axis=1))
    if narrow.any():
        assert np.median(ratio[narrow, 1]) == pytest.approx(1, abs=0.25)
    assert snowed_over(street, layer_at(street, parameters, coverage, depth_mm)).surroundings is None
