"""Lens, rolling shutter and motion blur in clips, against the renders that they stand for."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.weather.look import load_weather
from tasks.errors import InputError
from tasks.eval.image_quality import psnr
from tasks.render.camera import body_poses, continuous_rig, world_to_camera
from tasks.render.clip import RigMotion, render_clip
from tasks.render.composition import compose_over_sky, encode_8bit
from tasks.render.environment import environment_view
from tasks.render.rasterise.backend import CpuBackend
from tasks.render.readout import sensor_field
from tasks.render.sight import row_points
from tasks.render.weather.attribution import LAYER_BITS
from tasks.render.weather.layers import ClipConditions
from tasks.render.weather.scene_light import append_gaussians
from tasks.scene.route import route_from_positions
from tasks.scene.scene import Scene
from tasks.surface.state import SurfaceState
from tests.render.rolling_cameras import ALL, CAMERA, ROLLING
from tests.render.weather.scenes import PAVEMENT, clear_sky, road, surfels

ROUTE = route_from_positions(np.stack([np.arange(100.0), np.zeros(100), np.zeros(100)], axis=1))
TICKS = np.arange(201) * 1e-3


def rig(speed=16.0):
    return continuous_rig(
        ROUTE, TICKS, 1.0 + speed * TICKS, 0.02 * np.sin(9 * TICKS), 0.03 * np.sin(7 * TICKS),
        np.array((0.0, 0.1, 0.2)), cg_behind_front_axle=1.2, cg_height=0.55,
    )  # fmt: skip


def test_poses_between_ticks_meet_those_of_the_frames_and_go_on_beyond_the_ends():
    at = rig()
    exact = body_poses(
        ROUTE, np.array([2.6]), np.array([0.02 * np.sin(0.9)]), np.array([0.03 * np.sin(0.7)]),
        cg_behind_front_axle=1.2, cg_height=0.55,
    )  # fmt: skip
    np.testing.assert_allclose(at(1, np.zeros(1)), exact, atol=1e-12)
    before, first, after = at(0, np.array((-0.01, 0.0, 0.01)))
    np.testing.assert_allclose(before[:3, 3], 2 * first[:3, 3] - after[:3, 3], atol=1e-3)
    np.testing.assert_allclose(first @ np.linalg.inv(after) @ first, before, atol=1e-12)
    assert at(2, np.array((0.015,)))[0, 0, 3] == pytest.approx(at(2, np.zeros(1))[0, 0, 3] + 0.24, abs=2e-3)


@pytest.fixture(scope="module")
def parameters():
    return load_weather()


@pytest.fixture(scope="module")
def street():
    """A road with a striped wall beside it and posts before the wall."""
    x, z = (part.ravel() for part in np.meshgrid(np.arange(3, 24, 0.08), np.arange(0, 4, 0.08)))
    stripes = 0.15 + 0.5 * ((np.floor(2 * x) + np.floor(2 * z)) % 2)
    wall = surfels(
        np.column_stack((x, np.full(x.size, 4.0), z)), (0, -1, 0), 0.06, stripes[:, None] * np.ones(3), 6
    )
    foot, height = (part.ravel() for part in np.meshgrid(np.arange(8.0, 20, 3), np.arange(0, 3, 0.05)))
    post = surfels(np.column_stack((foot, np.full(foot.size, 2.5), height)), (-1, 0, 0), 0.05, 0.8, 8)
    return append_gaussians(append_gaussians(road(length=22), wall), post)


def clip(street, camera, parameters, state=None, **more):
    at = rig()
    poses = np.concatenate([at(k, np.zeros(1)) for k in range(3)])
    state = state or SurfaceState(kind="dry")
    motion = RigMotion(T_world_rig=poses, frame_rate_hz=10, rig_at=at)
    return render_clip(scene(street), camera, motion, under(state, parameters), CpuBackend(), **more)


def scene(street):
    return Scene(
        name="street", gaussians=street, route=ROUTE, environment=clear_sky(), carriageway_left=3.0,
        carriageway_right=-3.0,
    )  # fmt: skip


def under(state, parameters):
    return ClipConditions(state=state, pavement=PAVEMENT, parameters=parameters, seed=1)


def drawn(street, camera, pose):
    backend = CpuBackend()
    gbuffer = backend.rasterise_view(
        backend.prepare_gaussians(street), world_to_camera(pose), camera.K, camera.width, camera.height
    )
    sky = environment_view(clear_sky(), world_to_camera(pose), camera.K, camera.width, camera.height)
    return compose_over_sky(gbuffer, sky, street.display_encoded), gbuffer


def test_with_all_three_off_the_bytes_are_those_of_the_plain_composition(street, parameters):
    assert CAMERA.plain
    made = clip(street, CAMERA, parameters)
    for k in range(3):
        picture, gbuffer = drawn(street, CAMERA, rig()(k, np.zeros(1))[0] @ CAMERA.T_rig_camera)
        assert made["rgb"][k].tobytes() == encode_8bit(picture).tobytes()
        assert made["class"][k].tobytes() == gbuffer.class_id.tobytes()


def test_the_paper_s_composition_changes_only_pixels_of_falling_rain(street, parameters):
    """Elsewhere the 8-bit difference is none, and the picture is the linear one; dry weather has no particles."""
    state = SurfaceState(kind="rain", precipitation_mm_h=50, film_depth_mm=1.263)
    ours, theirs = (
        clip(street, CAMERA, parameters, state, composition=name, labels=True) for name in ("linear", "paper")
    )
    differs = (ours["rgb"] != theirs["rgb"]).any(axis=-1)
    assert 0 < differs.mean() < 0.5
    # a mark says half a grey level on the wet street; the residual is taken off the street before it is wet
    falls = ours["marks"] & LAYER_BITS["particles"] > 0
    assert np.abs(ours["rgb"].astype(int) - theirs["rgb"])[~falls].max() <= 4
    assert ours["marks"].tobytes() == theirs["marks"].tobytes()
    dry = [
        clip(street, CAMERA, parameters, composition=name)["rgb"].tobytes() for name in ("linear", "paper")
    ]
    assert dry[0] == dry[1]


def test_rows_and_blur_are_near_the_renders_that_they_stand_for(street, parameters):
    """Rolling rows against a render for every sixteenth pose, blur against 16 renders; ignoring them is far off."""
    at, plain = rig(), clip(street, CAMERA, parameters)["rgb"][1]

    def pose(time):
        return at(1, np.array([time]))[0] @ CAMERA.T_rig_camera

    rows = np.arange(8, 160, 16)
    exact = np.stack([drawn(street, CAMERA, pose(ROLLING.row_times[1][r]))[0][r] for r in rows])
    seen = clip(street, ROLLING, parameters)["rgb"][1]
    rolled = psnr(encode_8bit(exact), seen[rows])
    assert rolled > 33
    assert rolled > psnr(encode_8bit(exact), plain[rows]) + 10
    shares = (np.arange(16) + 0.5) / 16 - 0.5
    blurred = replace(CAMERA, motion_blur=True)
    exact = np.mean(
        [drawn(street, CAMERA, pose(s * CAMERA.exposure_s))[0] for s in shares], axis=0, dtype=np.float32
    )
    found = psnr(encode_8bit(exact), clip(street, blurred, parameters)["rgb"][1])
    assert found > 38
    assert found > psnr(encode_8bit(exact), plain) + 4


def test_blur_of_a_camera_that_stands_leaves_falling_snow_as_it_is(street, parameters):
    """A streak has its exposure already: it is not blurred again, and nothing else moves."""
    pose = ROUTE.pose(np.array((5.0, 5.0)))
    state = SurfaceState(kind="snow", precipitation_mm_h=2, snow_depth_mm=20, snow_coverage=1.0)
    motion = RigMotion(
        T_world_rig=pose, frame_rate_hz=10, rig_at=lambda k, t: np.repeat(pose[:1], len(t), axis=0)
    )
    plain, blurred = (
        render_clip(scene(street), camera, motion, under(state, parameters), CpuBackend())["rgb"]
        for camera in (CAMERA, replace(CAMERA, motion_blur=True))
    )
    apart = np.abs(blurred.astype(int) - plain)
    # the wide picture has other tiles, whose places are rounded differently: a value on the edge between two steps
    # may take the other one
    assert apart.max() <= 1
    assert (apart > 0).mean() < 1e-4
    assert plain[0].tobytes() != plain[1].tobytes()


def test_labels_follow_rows_and_lens(street, parameters):
    """Station and height of what a pixel sees come from its own ray and time: road pixels lie on the road."""
    made = clip(street, ALL, parameters, labels=True)
    field, poses = sensor_field(ALL), rig()(1, ALL.row_times[1]) @ ALL.T_rig_camera
    points = row_points(field.directions, made["depth"][1], poses)
    on_road = np.isfinite(made["road"][1][..., 0])
    assert on_road.mean() > 0.2
    assert np.quantile(np.abs(points[on_road][:, 2]), 0.99) < 0.01
    np.testing.assert_allclose(made["road"][1][on_road], points[on_road][:, :2], atol=5e-3)
    assert clip(street, ALL, parameters, labels=True)["flow"].tobytes() == made["flow"].tobytes()


def test_a_camera_that_moves_during_a_frame_needs_poses_between_frames(street, parameters):
    with pytest.raises(InputError, match="needs rig poses between frames"):
        motion = RigMotion(T_world_rig=np.eye(4)[None].repeat(2, 0), frame_rate_hz=10)
        render_clip(scene(street), ALL, motion, under(SurfaceState(kind="dry"), parameters), CpuBackend())
