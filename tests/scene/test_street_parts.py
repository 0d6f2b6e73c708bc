"""The street's parts one by one: course, cells, light, sky and the reach of the view."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes.street import load_street_layout
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.street.asphalt import asphalt_albedo, paint_albedo
from tasks.scene.street.bend import integrate_course, lay_route
from tasks.scene.street.ground import bare_share
from tasks.scene.street.houses.adornments import _build_balcony
from tasks.scene.street.layout import nearest_depth
from tasks.scene.street.light import Casters, share_light, sky_share, sun_direction
from tasks.scene.street.noise import fractal_noise, named_generator
from tasks.scene.street.plan import plan_street
from tasks.scene.street.sky import draw_panorama
from tasks.scene.street.surfels import (
    OVERLAP,
    Surfels,
    build_box,
    build_panel,
    build_tube,
    graded_cells,
    join_surfels,
)

LAYOUT = load_street_layout()
OPEN = Casters(
    boxes=np.zeros((0, 2, 3)), balls=np.zeros((0, 1, 4)), footprints=np.zeros((0, 2, 2)), leaf_extinction=0.9
)


def white_floor() -> Surfels:
    """A white square metre on the lane's middle, facing up."""
    return build_panel([0, -0.5, 0], [1, 0, 0], [0, 1, 0], 1.0, SemanticClass.ROAD, [1.0, 1.0, 1.0])


def test_course_has_unit_speed_and_the_bend_its_radius() -> None:
    route = lay_route(LAYOUT, integrate_course(LAYOUT))
    poses, station = route.T_world_rig, route.station
    step = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    assert np.allclose(step, np.diff(station), rtol=1e-6)
    assert np.allclose(poses[station <= 40, :3, :3], np.eye(3), atol=1e-12)
    heading = np.unwrap(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]))
    curvature = np.gradient(heading, station)
    bent = (station > 101) & (station < LAYOUT.route_length - 1)
    assert np.allclose(1 / curvature[bent], 450, rtol=1e-4)


def test_no_tree_stands_at_a_lamp_of_its_side() -> None:
    plan = plan_street(replace(LAYOUT, tree_spacing=3.0), 1)
    assert len(plan.trees) > 50
    for tree in plan.trees:
        away = [abs(station - tree.station) for station, side in plan.lamps if side * tree.lateral > 0]
        assert min(away) >= 2.0


def test_world_position_keeps_the_lateral_offset() -> None:
    line = integrate_course(LAYOUT)
    s = np.linspace(0, LAYOUT.route_length, 50)
    left = line.to_world(np.stack([s, np.full(50, 3.0), np.full(50, 0.7)], axis=1))
    middle = line.to_world(np.stack([s, np.zeros(50), np.zeros(50)], axis=1))
    assert np.allclose(np.linalg.norm((left - middle)[:, :2], axis=1), 3.0)
    assert np.allclose(left[:, 2], 0.7)
    across = np.cross(line.to_world_directions(s, np.tile([1.0, 0, 0], (50, 1))), left - middle)
    assert (across[:, 2] > 0).all()


@pytest.mark.parametrize("fine", [0.4, 1.0])
def test_cells_tile_each_interval_and_keep_its_edges(fine: float) -> None:
    breaks = [-1.0, 0.0, 0.15, 2.0]
    centre, width, interval = graded_cells(breaks, [0.3, 0.1, 0.25], fine)
    edges = np.concatenate([[breaks[0]], breaks[0] + np.cumsum(width)])
    assert np.allclose((edges[1:] + edges[:-1]) / 2, centre)
    assert np.abs(edges[:, None] - breaks).min(axis=0).max() < 1e-12
    assert (width <= 1.2501 * np.array([0.3, 0.1, 0.25])[interval]).all()
    assert (np.diff(interval) >= 0).all()


def test_cells_are_finer_beside_an_edge() -> None:
    _, width, _ = graded_cells([0.0, 4.0], 0.8, 0.25)
    assert width[0] == width[-1] == width.min() <= 1.25 * 0.25 * 0.8
    assert width.max() > 2 * width.min()


ROAD = np.stack(np.meshgrid(np.arange(0, 150, 0.25), np.arange(-1.6, 5.2, 0.25)))
"""Station and lateral position of the middles of a carriageway's cells [m]."""


def asphalt(seed: int = 1, **changes: float) -> np.ndarray:
    """Logarithm of the reflectance of asphalt without grain, a row for each lateral position."""
    s, d = (axis.ravel() for axis in ROAD)
    albedo = asphalt_albedo(
        replace(LAYOUT, **changes), seed, s, d, np.full(len(s), 0.25), np.zeros((len(s), 2))
    )
    return np.log(albedo.mean(axis=1)).reshape(ROAD[0].shape)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_asphalt_is_uneven_in_brightness_and_as_dark_as_measured(seed: int) -> None:
    assert 0.2 < asphalt(seed).std() < 0.45
    assert 0.04 < np.exp(np.median(asphalt(seed))) < 0.16  # LBNL Heat Island Group, Pavement Albedo


@pytest.mark.parametrize(("trace", "across"), [("track_scale", 0.74), ("strip_scale", 0.0)])
def test_wheels_and_oil_darken_their_own_part_of_a_lane(trace: str, across: float) -> None:
    darker = (asphalt(**{trace: 0.6}) - asphalt(**{trace: 1.0})).mean(axis=1)
    lateral = np.abs(ROAD[1][:, 0])
    assert lateral[darker[lateral < 1.5].argmin() + np.argmax(lateral < 1.5)] == pytest.approx(
        across, abs=0.2
    )
    assert darker.min() < -0.25 and darker[np.abs(lateral - 1.4) < 0.15].min() > -0.1


def test_stretches_of_other_ages_differ_by_their_scale_lane_by_lane() -> None:
    even, aged = (asphalt(renewal_scale=scale, wear_scale=0.0) for scale in (0.0, 0.3))
    other = aged - even
    own, next_lane = other[ROAD[1][:, 0] < 1.4], other[ROAD[1][:, 0] > 2.0]
    assert 0.1 < other.std() < 0.5
    assert own.mean(axis=0).std() > 5 * own.std(axis=0).mean()
    assert np.abs(own.mean(axis=0) - next_lane.mean(axis=0)).mean() > 0.1


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_yellow_centre_line_crosses_no_zebra_and_leaves_the_edges_white(share: float) -> None:
    layout = replace(LAYOUT, yellow_share=share)
    s = layout.crossing_station + np.array([-5.0, 0.5 * layout.crossing_length, -5.0])
    d = np.array([layout.lane_width / 2, layout.lane_width / 2, -layout.lane_width / 2])
    red, _, blue = paint_albedo(layout, 1, s, d, np.zeros((3, 2))).T
    assert (red > 2 * blue).tolist() == [share == 1.0, False, False]


@pytest.mark.parametrize(("share", "low", "high"), [(0.0, 0.0, 0.0), (0.5, 0.4, 0.6), (1.0, 0.9, 1.0)])
def test_ground_lies_bare_by_its_share(share: float, low: float, high: float) -> None:
    s, away = (axis.ravel() for axis in np.meshgrid(np.arange(0, 300, 3.0), np.arange(3, 60, 3.0)))
    assert low <= bare_share(replace(LAYOUT, bare_share=share), 1, s, away).mean() <= high


def test_a_panel_keeps_its_area_and_ends_in_finer_cells_where_that_is_asked_for() -> None:
    plain, fine = (
        build_panel([0, 0, 0], [8, 0, 0], [0, 0, 6], 1.0, SemanticClass.BUILDING, np.ones(3), sharp=sharp)
        for sharp in (False, True)
    )
    assert len(plain) == 48
    beside_end = fine.centre[:, 0] < 0.25
    assert beside_end.any()
    assert fine.scale[beside_end, 0].max() < 0.3 * plain.scale[0, 0]
    for panel in (plain, fine):
        assert (panel.scale / OVERLAP).prod(axis=1).sum() == pytest.approx(48)


def test_a_balcony_ends_at_its_slab_and_its_slab_has_an_underside() -> None:
    """Seen to three standard deviations, the bars stay within a hand's breadth of slab and handrail."""
    house = replace(plan_street(LAYOUT, 1).buildings[0], side=1, start=0.0)
    parts = _build_balcony(house, 4.0, 6.0, 5.0, 2.0, np.ones(3))
    standing = [part for part in parts if abs(part.axes[0, 2, 2]) < 0.5]
    bars = join_surfels([part for part in standing if part.scale[0, 0] < 0.03])
    assert np.abs(bars.centre[:, 2] - 5.475).max() + 3 * bars.scale[:, 1].min() < 0.475 + 0.2
    (underside,) = [part for part in parts if part.axes[0, 2, 2] < -0.99]
    assert underside.centre[:, 2] == pytest.approx(5.0 - 0.16)
    assert underside.centre[:, 1].max() < 6.0


def test_box_and_tube_face_outward() -> None:
    block = build_box([0, 0, 0], [1, 2, 3], 0.5, SemanticClass.OTHER, [0.5, 0.5, 0.5])
    assert (np.einsum("ij,ij->i", block.axes[:, 2], block.centre - [0.5, 1.0, 1.5]) > 0).all()
    pole = build_tube(np.linspace(0, 3, 5)[:, None] * [0, 0, 1], 0.1, 8, SemanticClass.POLE, [0.5, 0.5, 0.5])
    outward = pole.centre * [1, 1, 0]
    assert (np.einsum("ij,ij->i", pole.axes[:, 2], outward) > 0).all()


def test_sky_share_in_mid_street_is_the_closed_form() -> None:
    # Oke 1987, Boundary Layer Climates: the floor's middle sees cos(arctan(2 H / W)) of the sky
    width = LAYOUT.front_position(1) - LAYOUT.front_position(-1)
    middle = np.array([[50.0, (LAYOUT.front_position(1) + LAYOUT.front_position(-1)) / 2, 0.0]])
    share = sky_share(middle, np.array([[0.0, 0.0, 1.0]]), LAYOUT)
    assert share[0] == pytest.approx(np.cos(np.arctan(2 * 12.0 / width)), rel=1e-9)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_facade_sees_the_sky_above_the_row_across_the_street(side: int) -> None:
    # view factor of a half plane above an angle, for a wall that faces it: (1 - sin) / 2
    width = LAYOUT.front_position(1) - LAYOUT.front_position(-1)
    wall = np.array([[50.0, LAYOUT.front_position(side), 3.0]])
    share = sky_share(wall, np.array([[0.0, -side, 0.0]]), LAYOUT)
    assert share[0] == pytest.approx((1 - np.sin(np.arctan((12.0 - 3.0) / width))) / 2, rel=1e-9)


def test_a_row_of_houses_hides_no_sky_from_open_ground_behind_it() -> None:
    field = np.array([[50.0, LAYOUT.front_position(1) + 40.0, 0.0]])
    behind = sky_share(field, np.array([[0.0, 0.0, 1.0]]), LAYOUT)
    assert behind[0] > 0.9


def test_sky_share_above_the_roofs_is_whole_and_half() -> None:
    high = np.array([[50.0, 0.0, 30.0]] * 3)
    normals = np.array([[0.0, 0, 1], [0, 1, 0], [0, 0, -1]])
    assert np.allclose(sky_share(high, normals, LAYOUT), [1.0, 0.5, 0.0], atol=1e-9)


def test_open_floor_is_lit_by_lamberts_law_and_loses_the_sun_under_a_roof() -> None:
    line, floor = integrate_course(LAYOUT), white_floor()
    lit = share_light(floor, LAYOUT, line, OPEN)[0]
    roof = np.array([[[-30.0, -30.0, 8.0], [30.0, 30.0, 9.0]]])
    shaded = share_light(floor, LAYOUT, line, replace(OPEN, boxes=roof))[0]
    assert lit - shaded == pytest.approx([sun_direction(LAYOUT)[2], 0, 0], abs=1e-12)
    assert (shaded[1:] > 0.1).all()


@pytest.mark.parametrize(("azimuth", "distance", "radius"), [(35.0, 10.0, 1.5), (-100.0, 2.0, 0.5)])
def test_leaves_dim_the_sun_by_the_length_of_the_path_through_them(
    azimuth: float, distance: float, radius: float
) -> None:
    layout = replace(LAYOUT, sun_azimuth_deg=azimuth)
    line, floor = integrate_course(layout), white_floor()
    on_the_way = floor.centre[0] + distance * sun_direction(layout)
    ball = np.array([[[*on_the_way, radius]]])
    full = share_light(floor, layout, line, OPEN)[:, 0]
    dimmed = share_light(floor, layout, line, replace(OPEN, balls=ball))[:, 0]
    assert np.allclose(dimmed / full, np.exp(-0.9 * 2 * radius), rtol=2e-3)


def test_parked_car_darkens_the_ground_beside_it() -> None:
    line, floor = integrate_course(LAYOUT), white_floor()
    beside = replace(OPEN, footprints=np.array([[[-2.0, 0.6], [3.0, 2.4]]]))
    less, more = (share_light(floor, LAYOUT, line, one)[0, 1:] for one in (beside, OPEN))
    assert less[0] < more[0]
    assert less.sum() < more.sum()


def test_crossing_beyond_the_route_is_refused() -> None:
    with pytest.raises(InputError, match="crossing must lie on the route of 30 m"):
        replace(LAYOUT, route_length=30.0)


def test_nearest_depth_is_where_the_point_enters_the_picture() -> None:
    # half the picture is 0.6 wide and 0.4 high at unit depth; the eye is 1.4 m above the road
    assert nearest_depth(LAYOUT, 50.0, 0.0) == pytest.approx(3.5)
    assert nearest_depth(LAYOUT, 50.0, 0.0, 1.4) == pytest.approx(3.5)  # no cell is smaller than the road's
    assert nearest_depth(LAYOUT, 50.0, -6.0) == pytest.approx(10.0)
    assert nearest_depth(LAYOUT, 50.0, 0.0, 9.4) == pytest.approx(20.0)
    assert nearest_depth(LAYOUT, LAYOUT.route_length + 40, 1.0) == pytest.approx(40.0)


def test_brightest_sky_is_where_the_sun_stands() -> None:
    picture = draw_panorama(LAYOUT, 2025)
    height, width = picture.shape[:2]
    row, column = np.unravel_index(np.argmax(picture.sum(axis=2)), (height, width))
    elevation = 90 - (row + 0.5) / height * 180
    azimuth = 180 - (column + 0.5) / width * 360
    assert elevation == pytest.approx(LAYOUT.sun_elevation_deg, abs=1)
    assert azimuth == pytest.approx(LAYOUT.sun_azimuth_deg, abs=1)


def test_panorama_closes_on_itself() -> None:
    picture = draw_panorama(LAYOUT, 2025)
    seam = np.abs(picture[:500, 0] - picture[:500, -1]).mean()
    beside = np.abs(picture[:500, 1] - picture[:500, 0]).mean()
    assert seam < 3 * beside + 1e-3


def test_named_streams_are_independent_and_noise_is_smooth() -> None:
    assert not np.array_equal(named_generator(1, "a").random(4), named_generator(1, "b").random(4))
    assert np.array_equal(named_generator(1, "a").random(4), named_generator(1, "a").random(4))
    x = np.linspace(0, 500, 40_001)
    noise = fractal_noise(named_generator(1, "a"), x, 0.3 * x, 2.0, 3)
    assert abs(noise.mean()) < 0.2
    assert noise.std() == pytest.approx(1.0, abs=0.25)
    assert np.abs(np.diff(noise)).max() < 0.2


@pytest.mark.parametrize("seed", [0, 1, 2025])
def test_nothing_that_stands_is_on_the_lanes(seed: int) -> None:
    plan = plan_street(LAYOUT, seed)
    for tree in plan.trees:
        assert tree.lateral > LAYOUT.carriageway_left or tree.lateral < LAYOUT.carriageway_right
    for car in plan.cars:
        assert car.lateral - 1.0 > 1.5 * LAYOUT.lane_width or car.lateral + 1.0 < -LAYOUT.lane_width / 2
        beyond = car.station - LAYOUT.crossing_station
        assert not -2.5 <= beyond <= LAYOUT.crossing_length + 2.5
    for side in (-1, 1):
        on_side = sorted(car.station for car in plan.cars if car.lateral * side > 0)
        assert np.diff(on_side).min() > 5.0
