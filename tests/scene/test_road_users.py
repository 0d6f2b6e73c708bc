"""Road users: their tracks under one friction, their bodies, and what they meet."""

import numpy as np
import pytest

from catalogs.entries import load
from tasks.errors import InputError
from tasks.scene.road_users.bodies import build_road_user, measure_extent
from tasks.scene.road_users.ground import find_meeting, find_obstacle
from tasks.scene.road_users.motion import move_on_track
from tasks.scene.road_users.track import GRAVITY, Track, drive_track
from tasks.scene.route import route_from_positions
from tests.toy_street import toy_street

LINE = np.linspace(0, 120, 121)
STRAIGHT = route_from_positions(np.stack([LINE, 0 * LINE, 0 * LINE], axis=1))
ANGLE = LINE / 60
BEND = route_from_positions(60 * np.stack([np.sin(ANGLE), 1 - np.cos(ANGLE), 0 * ANGLE], axis=1))
TIME = np.linspace(0, 4, 401)
BRAKING = Track(start=(20.0, 0.0), speed=15.0, change_at=1.0, acceleration=-6.0)


def test_a_braking_car_follows_the_closed_form():
    way, speed, rate = drive_track(BRAKING, TIME, friction=0.9)
    since = np.clip(TIME - 1, 0, 2.5)
    np.testing.assert_allclose(way, 15 * np.minimum(TIME, 1) + 15 * since - 3 * since**2, atol=1e-12)
    np.testing.assert_allclose(speed, 15 - 6 * since, atol=1e-12)
    assert way[-1] == pytest.approx(15 + 15**2 / 12)
    assert set(np.unique(rate)) == {-6.0, 0.0}


@pytest.mark.parametrize("friction", (0.1, 0.28))
def test_no_road_user_brakes_harder_than_its_surface_allows(friction):
    _, speed, rate = drive_track(BRAKING, TIME, friction)
    assert rate.min() == pytest.approx(-friction * GRAVITY)
    assert speed[-1] == pytest.approx(max(15 - 3 * friction * GRAVITY, 0))


@pytest.mark.parametrize("lateral", (-3.5, 0.0, 3.5))
def test_a_body_beside_a_bend_moves_at_its_own_speed(lateral):
    motion = move_on_track(Track(start=(10.0, lateral), speed=10.0), BEND, TIME, friction=0.9)
    moved = np.diff(motion.T_world_body[:, :3, 3], axis=0) / TIME[1]
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 10.0, rtol=2e-3)
    np.testing.assert_allclose(moved, motion.velocity[1:], atol=0.05)


def test_a_crossing_road_user_keeps_its_station():
    track = Track(start=(30.0, -4.0), heading=np.pi / 2, speed=1.5)
    place = move_on_track(track, STRAIGHT, TIME, friction=0.9).T_world_body[-1]
    np.testing.assert_allclose(place[:3, 3], (30, 2, 0), atol=1e-9)
    np.testing.assert_allclose(place[:3, 0], (0, 1, 0), atol=1e-9)


def test_a_track_in_the_world_is_the_same_as_along_a_straight_road():
    world = Track(start=(30.0, -4.0), heading=0.3, speed=5.0, in_world=True)
    along = Track(start=(30.0, -4.0), heading=0.3, speed=5.0)
    places = [move_on_track(track, STRAIGHT, TIME, 0.9).T_world_body for track in (world, along)]
    np.testing.assert_allclose(*places, atol=1e-6)


@pytest.mark.parametrize("track", (Track(start=(130.0, 0.0)), Track(start=(100.0, 0.0), speed=10.0)))
def test_a_track_beyond_the_route_is_refused(track):
    with pytest.raises(InputError, match=r"must (stay|begin) on the route"):
        move_on_track(track, STRAIGHT, TIME, 0.9)


@pytest.mark.parametrize("kind", ("car", "van", "truck", "adult", "child", "bicycle"))
def test_each_body_fills_the_box_of_its_kind_and_vehicles_have_stop_lamps(kind):
    size = np.array(load("road user sizes")[kind])
    body = build_road_user(kind, size, cell=0.06)
    low, high = measure_extent(body.body)
    np.testing.assert_allclose((high - low)[[0, 2]], size[[0, 2]], atol=0.15)
    assert 0.98 < (high - low)[1] / size[1] < 1.25, "mirrors stand out of a vehicle's width"
    np.testing.assert_allclose(low[2], 0, atol=0.06)
    assert body.stop_lamps.any() == (kind in ("car", "van", "truck"))


def test_bodies_that_overlap_meet_and_bodies_side_by_side_do_not():
    size = np.array((4.0, 1.8, 1.4))
    first = np.tile(np.eye(4), (3, 1, 1))
    second = first.copy()
    second[:, :2, 3] = ((10, 0), (5, 0), (3.5, 0))
    assert find_meeting(first, size, second, size) == 2
    second[:, :2, 3] = (2.0, 1.9)
    assert find_meeting(first, size, second, size) is None


def test_a_way_into_a_thing_of_the_street_is_found():
    cloud = toy_street().gaussians
    walls = np.unique(cloud.class_id[cloud.means[:, 2] > 1])
    pose = np.tile(np.eye(4), (2, 1, 1))
    pose[:, :3, 3] = ((20, 0, 0), (20, cloud.means[cloud.means[:, 2] > 1, 1].max(), 0))
    number, kind = find_obstacle(pose, np.array((4.0, 1.8, 1.4)), cloud)
    assert (number, kind in walls) == (1, True)
    assert find_obstacle(pose[:1], np.array((4.0, 1.8, 1.4)), cloud) is None
