"""Ground truth of pixels: flow from depth and poses, road coordinates, and what changed a pixel."""

from types import SimpleNamespace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.labels import HAZARD, compute_clip_flow, compute_flow, locate_road_pixels, mark_hazard
from tasks.render.sight import take_drawn_frame
from tasks.scene.route import Route
from tests.render.weather.scenes import flat_gbuffer
from tests.render.weather.test_wet_road import VIEW

K = np.array([[100.0, 0, 40], [0, 100.0, 30], [0, 0, 1]])
SHAPE = (60, 80)
STILL = np.eye(4)


def advanced_pose(way: float) -> np.ndarray:
    pose = np.eye(4)
    pose[2, 3] = way
    return pose


def test_a_camera_at_rest_sees_no_flow_and_hides_nothing():
    depth = np.full(SHAPE, 7.0, np.float32)
    flow, occluded = compute_flow(depth, depth, K, STILL, STILL)
    assert np.abs(flow).max() < 1e-4
    assert not occluded.any()


def test_flow_towards_a_wall_is_the_pinhole_s():
    """A point at (u, v) of depth z moves from the principal point by z / (z - way)."""
    wall, way = np.full(SHAPE, 10.0, np.float32), 2.0
    flow, occluded = compute_flow(wall, wall - np.float32(way), K, STILL, advanced_pose(way))
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]] + 0.5
    np.testing.assert_allclose(flow[..., 0], (u - 40) * (10 / 8 - 1), atol=1e-4)
    np.testing.assert_allclose(flow[..., 1], (v - 30) * (10 / 8 - 1), atol=1e-4)
    leaves = (np.abs(u - 40) * 10 / 8 > 40) | (np.abs(v - 30) * 10 / 8 > 30)
    assert (occluded == leaves).mean() > 0.99


def test_what_a_nearer_thing_covers_in_the_next_frame_is_occluded():
    far = np.full(SHAPE, 20.0, np.float32)
    later = far.copy()
    later[20:40, 30:50] = 5.0
    _, occluded = compute_flow(far, later, K, STILL, STILL)
    expected = np.zeros(SHAPE, bool)
    expected[20:40, 30:50] = True
    assert np.array_equal(occluded, expected)


def test_the_sky_has_no_flow_and_the_last_frame_none_at_all():
    depth = np.full((3, *SHAPE), 9.0, np.float32)
    depth[:, :10] = np.nan
    flow, marks = compute_clip_flow(
        depth,
        lambda k: compute_flow(
            depth[k], depth[k + 1], K, advanced_pose(0.5 * k), advanced_pose(0.5 * k + 0.5)
        ),
    )
    assert np.isnan(flow[:2, :10]).all() and np.isfinite(flow[:2, 10:]).all()
    assert np.isnan(flow[2]).all() and not marks[2].any()
    assert not marks[:, :10].any()


def test_two_steps_of_flow_lead_where_one_long_step_does():
    depth = np.full(SHAPE, 12.0, np.float32)
    first, _ = compute_flow(depth, depth - 1, K, STILL, advanced_pose(1))
    both, _ = compute_flow(depth, depth - 3, K, STILL, advanced_pose(3))
    u = np.arange(SHAPE[1]) + 0.5
    landed_u = u + first[..., 0]
    second_u = (landed_u - 40) * (11 / 9 - 1)
    np.testing.assert_allclose(first[..., 0] + second_u, both[..., 0], atol=1e-3)


def test_road_pixels_know_their_station_and_side(monkeypatch):
    view = VIEW
    _, gbuffer = flat_gbuffer(view, wall_x=15.0)
    station = np.linspace(-50, 300, 351)
    poses = np.tile(np.eye(4), (351, 1, 1))
    poses[:, 0, 3] = station
    route = Route(station=station + 50, T_world_rig=poses)
    monkeypatch.setattr("tasks.render.sight.attribute_pixels", lambda *drawn: None)
    points = take_drawn_frame(None, SimpleNamespace(picture=None), gbuffer, view, True).points
    place = locate_road_pixels(gbuffer.class_id, points, route)
    road = gbuffer.class_id == SemanticClass.ROAD
    assert np.isfinite(place[road]).all() and np.isnan(place[~road]).all()
    np.testing.assert_allclose(place[road], points[road][:, :2] + (50, 0), atol=2e-3)
    np.testing.assert_allclose(points[road][:, 2], 0, atol=1e-4)
    np.testing.assert_allclose(points[~road & np.isfinite(gbuffer.depth)][:, 0], 15, atol=1e-4)


@pytest.mark.parametrize(("low", "high"), [(5.0, 8.0), (20.0, 22.0)])
def test_the_hazard_is_marked_where_the_profile_is_not_level(low, high):
    place = np.stack(np.broadcast_arrays(np.linspace(0, 30, 61)[:, None], np.zeros((61, 4))), axis=-1)
    place[:, 3] = np.nan
    marks = mark_hazard(place.astype(np.float32), lambda s: np.where((s > low) & (s < high), 0.1, 0.0))
    inside = (place[:, 0, 0] > low) & (place[:, 0, 0] < high)
    assert np.array_equal(marks[:, 0] == HAZARD, inside)
    assert not marks[:, 3].any()
