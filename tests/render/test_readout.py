"""Lens, rolling shutter and motion blur against closed forms, on a wall."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tasks.eval.poses.checks import correct_rolling_shutter, row_times
from tasks.render.composition import encode_8bit
from tasks.render.labels import compute_row_flow
from tasks.render.lens import distort_rays
from tasks.render.readout import read_out, sensor_field
from tasks.render.sight import row_points
from tests.render.rolling_cameras import ALL, CAMERA, LENS, ROLLING, K

WALL = 10.0


def moving_poses(camera, velocity, rate=0.0):
    """Poses [3, H, 4, 4] of the rows of a camera at the origin that goes steadily and turns about its y."""
    times = camera.row_times
    poses = np.tile(np.eye(4), (*times.shape, 1, 1))
    poses[..., :3, 3] = times[..., None] * velocity
    cos, sin = np.cos(rate * times), np.sin(rate * times)
    poses[..., 0, 0], poses[..., 0, 2], poses[..., 2, 0], poses[..., 2, 2] = cos, sin, -sin, cos
    return poses


def paint_wall(x, y):
    """Light of a wall, by its place on it."""
    grey = 0.5 + 0.3 * np.sin(4 * x) * np.cos(3 * y)
    return np.stack((grey, 0.5 * grey, 1 - grey), axis=-1).astype(np.float32)


def wide_wall(field):
    u, v = np.meshgrid(np.arange(field.width) + 0.5, np.arange(field.height) + 0.5)
    x, y = (WALL * (place - field.K[i, 2]) / field.K[i, i] for i, place in enumerate((u, v)))
    return paint_wall(x, y), np.full(x.shape, WALL, np.float32)


def wall_seen(directions, poses):
    """Return the exact light of the wall on a ray, and its z in the row's camera."""
    rays = np.concatenate((directions, np.ones((*directions.shape[:2], 1))), axis=-1)
    rays = rays @ poses[:, :3, :3].swapaxes(1, 2)
    z = (WALL - poses[:, None, 2, 3]) / rays[..., 2]
    return paint_wall(*(poses[:, None, i, 3] + z * rays[..., i] for i in range(2))), z


@pytest.mark.parametrize(
    "camera", [replace(CAMERA, lens=LENS), ROLLING, replace(ROLLING, lens=LENS)], ids=["lens", "rows", "both"]
)
def test_a_wall_is_seen_as_ray_and_row_time_say(camera):
    field = sensor_field(camera)
    poses = moving_poses(camera, np.array((3.0, 0.5, 14.0)), rate=0.4)
    seen = read_out(*wide_wall(field), field, poses, False)
    light, z = wall_seen(field.directions, poses[1])
    np.testing.assert_allclose(seen.depth, z, rtol=1e-5)
    np.testing.assert_allclose(seen.picture, light, atol=1e-3)


def test_blur_is_the_mean_of_the_light_along_the_way():
    camera = replace(ALL, exposure_s=0.03)
    field = sensor_field(camera)
    poses = moving_poses(camera, np.array((6.0, 0.0, 14.0)))
    seen = read_out(*wide_wall(field), field, poses, True)
    shares = (np.arange(32) + 0.5) / 32
    exact = np.mean(
        [wall_seen(field.directions, poses[0] + s * (poses[2] - poses[0]))[0] for s in shares], axis=0
    )
    sharp = read_out(*wide_wall(field), field, poses, False)
    assert np.abs(seen.picture - exact).max() < 6e-3
    assert np.abs(sharp.picture - exact).max() > 0.03
    # labels are those of the middle of the exposure
    np.testing.assert_array_equal(seen.depth, sharp.depth)
    np.testing.assert_array_equal(seen.source, sharp.source)


def test_a_bar_is_blurred_over_its_way_and_twice_as_wide_in_twice_the_exposure():
    widths = []
    for exposure in (0.02, 0.04):
        camera = replace(CAMERA, motion_blur=True, exposure_s=exposure)
        field = sensor_field(camera)
        picture, depth = wide_wall(field)
        picture[:] = 0
        picture[:, int(field.K[0, 2])] = 1
        seen = read_out(picture, depth, field, moving_poses(camera, np.array((20.0, 0, 0))), True).picture[
            80, :, 0
        ]
        u = np.arange(240)
        mean = (seen * u).sum() / seen.sum()
        widths.append(np.sqrt(12 * ((seen * (u - mean) ** 2).sum() / seen.sum())))
        assert seen.sum() == pytest.approx(1, abs=0.1)
    # f V t / Z = 8 and 16 px
    assert widths == pytest.approx([8, 16], rel=0.06)


def test_a_pole_before_a_wall_shears_by_speed_times_row_time_over_depth():
    field = sensor_field(ROLLING)
    pole, half = 4.0, 0.15
    u, _ = np.meshgrid(np.arange(field.width) + 0.5, np.arange(field.height) + 0.5)
    on_pole = np.abs((u - field.K[0, 2]) / 200 * pole) < half
    picture = np.where(on_pole[..., None], np.float32(1), np.float32(0.2)) * np.ones(3, np.float32)
    depth = np.where(on_pole, pole, WALL).astype(np.float32)
    speed = 25.0
    seen = read_out(picture, depth, field, moving_poses(ROLLING, np.array((speed, 0, 0))), False)
    columns = np.arange(240) + 0.5
    shear = 200 * speed * ROLLING.row_times[1] / pole
    assert np.ptp(shear) > 25
    for weights in ((seen.picture[..., 0] - 0.2) / 0.8, (seen.depth < 5) * 1.0):
        centre = (weights * columns).sum(axis=1) / weights.sum(axis=1)
        np.testing.assert_allclose(centre, 120 - shear, atol=0.6)
        assert weights.sum(axis=1) == pytest.approx(2 * half * 200 / pole, abs=1.5)


def test_a_straight_line_bends_as_the_formula_says():
    camera = replace(CAMERA, lens=LENS)
    field = sensor_field(camera)
    u, _ = np.meshgrid(np.arange(field.width) + 0.5, np.arange(field.height) + 0.5)
    x0 = 0.45
    line = np.exp(-0.5 * ((u - field.K[0, 2] - 200 * x0) / 1.5) ** 2).astype(np.float32)
    picture = np.repeat(line[..., None], 3, axis=2)
    still = np.broadcast_to(np.eye(4), (3, 160, 4, 4))
    seen = read_out(picture, np.full(u.shape, WALL, np.float32), field, still, False).picture[..., 0]
    columns = np.arange(240) + 0.5
    found = (seen * columns).sum(axis=1) / seen.sum(axis=1)
    y = np.linspace(-0.55, 0.55, 2001)
    bent_x, bent_y = distort_rays(np.full_like(y, x0), y, LENS.coefficients)
    rows = np.arange(160) + 0.5
    expected = 120 + 200 * np.interp((rows - 80) / 200, bent_y, bent_x)
    assert np.ptp(expected) > 3
    np.testing.assert_allclose(found, expected, atol=0.05)


def test_a_camera_that_stands_still_sees_what_is_drawn_bit_for_bit():
    camera = replace(ROLLING, motion_blur=True)
    field = sensor_field(camera)
    picture, depth = wide_wall(field)
    seen = read_out(picture, depth, field, np.broadcast_to(np.eye(4), (3, 160, 4, 4)), True)
    left, top = (int(field.K[i, 2] - K[i, 2]) for i in range(2))
    inside = np.s_[top : top + 160, left : left + 240]
    np.testing.assert_array_equal(seen.picture, picture[inside])
    np.testing.assert_array_equal(seen.depth, depth[inside])


def test_flow_leads_to_the_pixel_that_sees_the_same_point():
    field = sensor_field(ALL)
    now = moving_poses(ALL, np.array((3.0, 0.5, 14.0)), rate=0.4)[1]
    later = now.copy()
    later[:, :3, 3] += (0.2, 0.05, 1.0)
    depth, next_depth = (wall_seen(field.directions, poses)[1].astype(np.float32) for poses in (now, later))
    flow, occluded = compute_row_flow(depth, next_depth, field.directions, ALL, now, later)
    points, next_points = (
        row_points(field.directions, depth, now),
        row_points(field.directions, next_depth, later),
    )
    there = np.moveaxis(flow, -1, 0) + np.meshgrid(np.arange(240), np.arange(160))
    inside = ~occluded & (there[0] > 1) & (there[0] < 238) & (there[1] > 1) & (there[1] < 158)
    assert inside.mean() > 0.7
    column, row = (np.floor(place[inside]).astype(int) for place in there)
    tx, ty = there[0][inside] - column, there[1][inside] - row
    met = sum(
        ((tx if i else 1 - tx) * (ty if j else 1 - ty))[:, None] * next_points[row + j, column + i]
        for i in (0, 1)
        for j in (0, 1)
    )
    # a pixel is 5 cm of the wall
    np.testing.assert_allclose(met, points[inside], atol=2e-3)


def test_a_frame_s_time_is_that_of_the_middle_of_the_picture_and_of_its_exposure():
    """Rows 79 and 80 of 160 lie half a line delay to either side."""
    begin, middle, end = replace(ROLLING, motion_blur=True).row_times
    assert middle[[0, 79, 80, 159]] == pytest.approx(1.5e-4 * np.array((-79.5, -0.5, 0.5, 79.5)))
    np.testing.assert_allclose(middle - begin, 0.005)
    np.testing.assert_allclose(end - middle, 0.005)
    assert not CAMERA.row_times.any()


def test_the_judge_takes_rows_back_to_one_shutter():
    """Told the line delay and roughly the motion, its own code gives the picture and depth of the middle row's pose."""
    still = sensor_field(CAMERA).directions
    rolled, ahead = [], np.array((3.0, 0.5, 14.0))
    for k in range(3):
        poses = moving_poses(ROLLING, ahead)[1]
        poses[:, :3, 3] += 0.01 * k * ahead
        light, z = wall_seen(still, poses)
        rolled.append((encode_8bit(light), z.astype(np.float32)))
    rgb, depth = (np.stack(part) for part in zip(*rolled, strict=True))
    way = np.tile(np.eye(4), (3, 1, 1))
    way[:, :3, 3] = 0.01 * np.arange(3)[:, None] * ahead
    pinhole = K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    told = {"rgb": rgb, "depth": depth, "class": np.zeros(depth.shape, np.uint8)}
    times = row_times(pinhole, (160, 240), None, ROLLING.line_delay_s)
    seen = correct_rolling_shutter(told, pinhole, times, SimpleNamespace(T_rig0_rig=way), np.eye(4), 0.01)
    middle = np.broadcast_to(np.eye(4), (160, 4, 4)).copy()
    middle[:, :3, 3] = way[1, :3, 3]
    light, z = wall_seen(still, middle)
    inside = np.s_[4:-4, 8:-8]
    np.testing.assert_allclose(seen["depth"][1][inside], z[inside], rtol=1e-4)
    apart = np.abs(seen["rgb"][1].astype(int) - encode_8bit(light))[inside]
    assert apart.max() <= 3
    assert np.abs(rgb[1].astype(int) - encode_8bit(light))[inside].max() > 20
