import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tasks.errors import InputError
from tasks.scene.route import Route, extend_route, route_from_poses, route_from_positions

RADIUS = 50.0


def make_arc(count: int = 40) -> Route:
    """A left bend of 50 m radius."""
    angle = np.linspace(0, 1.2, count)
    return route_from_positions(
        np.stack([RADIUS * np.sin(angle), RADIUS * (1 - np.cos(angle)), 0 * angle], axis=1)
    )


def test_knots_are_met_exactly():
    route = make_arc()
    np.testing.assert_allclose(route.pose(route.station), route.T_world_rig, atol=1e-12)


def test_between_knots_the_pose_stays_on_the_arc_and_turns_with_it():
    route = make_arc()
    distance = np.linalg.norm(route.pose(np.linspace(0, route.length, 997))[:, :2, 3] - [0, RADIUS], axis=1)
    np.testing.assert_allclose(distance, RADIUS, atol=2e-4)
    poses = route.pose(np.linspace(5, route.length - 5, 97))
    yaw = np.arctan2(poses[:, 1, 0], poses[:, 0, 0])
    np.testing.assert_allclose(np.diff(yaw, 2), 0, atol=2e-4)


def test_a_left_bend_turns_the_rig_to_the_left():
    assert make_arc().T_world_rig[-1, 1, 0] > 0


def test_two_points_are_a_straight_route():
    route = route_from_positions(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]))
    np.testing.assert_allclose(route.T_world_rig[:, :3, 0], [[0.6, 0.8, 0.0]] * 2, atol=1e-12)
    assert route.length == pytest.approx(5.0)


def make_banked() -> Route:
    """The bend again, climbing and leaning ever more into the curve."""
    poses = make_arc().T_world_rig.copy()
    lean = np.linspace(0, 0.15, len(poses))
    poses[:, :3, :3] = (
        Rotation.from_matrix(poses[:, :3, :3]) * Rotation.from_euler("x", -lean[:, None])
    ).as_matrix()
    poses[:, 2, 3] = 2 * np.linspace(0, 1, len(poses)) ** 2
    return route_from_poses(poses)


@pytest.mark.parametrize("route", [make_arc(), make_banked()], ids=["bend", "banked bend"])
def test_projection_inverts_the_pose(route):
    draw = np.random.default_rng(1)
    station, lateral, height = (
        draw.uniform(0, route.length, 5000),
        draw.uniform(-8, 8, 5000),
        draw.uniform(-1, 3, 5000),
    )
    poses = route.pose(station)
    points = poses[:, :3, 3] + lateral[:, None] * poses[:, :3, 1] + height[:, None] * poses[:, :3, 2]
    found = route.project(points)
    np.testing.assert_allclose(found, [station, lateral, height], atol=1e-3)


def test_stations_of_neighbouring_points_do_not_jump():
    route = make_arc()
    along = np.linspace(1, route.length - 1, 20_000)
    poses = route.pose(along)
    station, _, _ = route.project(poses[:, :3, 3] - 6.0 * poses[:, :3, 1])
    np.testing.assert_allclose(np.diff(station), np.diff(along), atol=1e-4)


def test_lateral_is_positive_to_the_left():
    straight = route_from_positions(np.stack([np.arange(10.0), np.zeros(10), np.zeros(10)], axis=1))
    _, lateral, _ = straight.project(np.array([[5.0, 2.0, 0.0]]))
    assert lateral[0] == pytest.approx(2.0)


def test_points_beyond_the_ends_get_stations_beyond_them():
    straight = route_from_positions(np.stack([np.arange(10.0), np.zeros(10), np.zeros(10)], axis=1))
    station, _, _ = straight.project(np.array([[-3.0, 0, 0], [14.0, 1, 0]]))
    np.testing.assert_allclose(station, [-3, 14], atol=1e-9)


def test_a_bend_goes_straight_on_beyond_its_end():
    route = make_arc()
    point = route.T_world_rig[-1] @ [7.0, -3.0, 1.0, 1.0]
    np.testing.assert_allclose(np.ravel(route.project(point[None, :3])), [route.length + 7, -3, 1], atol=1e-9)


def test_an_extension_goes_on_straight_and_keeps_what_was_there():
    route = make_arc()
    longer = extend_route(route, 30.0)
    assert longer.length == pytest.approx(route.length + 30)
    np.testing.assert_array_equal(longer.T_world_rig[: len(route.station)], route.T_world_rig)
    step = longer.pose(longer.length)[:3, 3] - route.T_world_rig[-1, :3, 3]
    np.testing.assert_allclose(step, 30 * route.T_world_rig[-1, :3, 0], atol=1e-9)


def test_standing_poses_are_dropped():
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[:, 0, 3] = [0, 1, 1, 1.001, 2, 3]
    assert route_from_poses(poses).station.tolist() == [0, 1, 2, 3]


def test_beyond_the_route_the_error_names_station_and_length():
    with pytest.raises(InputError, match=r"0 to .* m; it is 999.00 m"):
        make_arc().pose(999.0)


@pytest.mark.parametrize(
    ("station", "rule"), [([0, 1, 1], "increase"), ([1, 2, 3], "start at 0"), ([0, np.nan, 2], "finite")]
)
def test_stations_must_increase_from_zero(station, rule):
    with pytest.raises(InputError, match=rule):
        Route(station=np.array(station, float), T_world_rig=np.tile(np.eye(4), (3, 1, 1)))


def test_a_mirrored_or_stretched_pose_is_refused():
    for bad in (np.diag([1.0, 1, -1, 1]), np.diag([1.1, 1, 1, 1])):
        poses = np.stack([np.eye(4), bad])
        with pytest.raises(
            InputError, match="right-handed rotations; pose 1" if bad[0, 0] > 1 else "right-handed"
        ):
            Route(station=np.array([0.0, 1]), T_world_rig=poses)


def test_attitude_between_two_knots_is_the_shortest_turn():
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, :3] = Rotation.from_euler("z", 40, degrees=True).as_matrix()
    poses[1, 0, 3] = 10
    half = Route(station=np.array([0.0, 10]), T_world_rig=poses).pose(5.0)
    assert np.degrees(np.arctan2(half[1, 0], half[0, 0])) == pytest.approx(20)


def test_a_station_that_is_no_number_is_refused():
    with pytest.raises(InputError, match="it is nan m"):
        make_arc().pose([1.0, np.nan])


@pytest.mark.parametrize("positions", [np.zeros((5, 3)), np.zeros((0, 3))])
def test_a_recording_that_never_moves_is_no_route(positions):
    with pytest.raises(InputError, match="two points"):
        route_from_positions(positions)


def test_repeated_points_do_not_bend_a_route():
    points = np.stack([np.arange(10.0), np.zeros(10), np.zeros(10)], axis=1)
    np.testing.assert_array_equal(
        route_from_positions(np.repeat(points, 4, axis=0)).T_world_rig,
        route_from_positions(points).T_world_rig,
    )


def test_a_point_that_is_no_number_is_not_skipped():
    points = np.stack([np.arange(10.0), np.zeros(10), np.zeros(10)], axis=1)
    points[4, 1] = np.nan
    with pytest.raises(InputError, match="finite"):
        route_from_positions(points)
    poses = np.tile(np.eye(4), (10, 1, 1))
    poses[:, :3, 3] = points
    with pytest.raises(InputError, match="finite"):
        route_from_poses(poses)


def test_a_route_that_stands_upright_is_refused_with_the_point():
    points = np.stack([[0.0, 1, 2, 2, 2], np.zeros(5), [0.0, 0, 0, 1, 2]], axis=1)
    with pytest.raises(InputError, match="point 3"):
        route_from_positions(points)
