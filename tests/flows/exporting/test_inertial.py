"""Velocity is the derivative of the exported position, and acceleration that of the velocity, for every point."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flows.exporting.inertial import compute_inertial_motion
from tasks.conventions import GRAVITY
from tasks.render.camera import body_poses
from tasks.scene.route import Route

VEHICLE = SimpleNamespace(cg_to_front_axle=1.2, cg_to_rear_axle=1.5, cg_height=0.55)
BEND_RADIUS = 40.0


def lay_route(radius: float | None) -> Route:
    station = np.linspace(0, 30, 301)
    heading = station * 0 if radius is None else station / radius
    poses = np.tile(np.eye(4), (len(station), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("Z", heading[:, None]).as_matrix()
    poses[:, 0, 3] = station if radius is None else radius * np.sin(heading)
    poses[:, 1, 3] = 0 if radius is None else radius * (1 - np.cos(heading))
    return Route(station=station, T_world_rig=poses)


def drive_over_hump(route: Route) -> SimpleNamespace:
    """A braking car with the heave and pitch of a hump, and a frame at every tick."""
    tick = np.arange(1001)
    t, beat = tick * 1e-3, 2 * np.pi * 1.5
    columns = {
        "t_ns": tick * 10**6, "tick": tick,
        "station": 12 * t - 1.5 * t**2, "speed": 12 - 3 * t, "longitudinal_acceleration": np.full(len(t), -3.0),
        "heave": 0.05 * np.sin(beat * t), "heave_rate": 0.05 * beat * np.cos(beat * t),
        "pitch": 0.06 * np.cos(beat * t), "pitch_rate": -0.06 * beat * np.sin(beat * t),
    }  # fmt: skip
    poses = body_poses(
        route, columns["station"], columns["heave"], columns["pitch"],
        cg_behind_front_axle=VEHICLE.cg_to_front_axle, cg_height=VEHICLE.cg_height,
    )  # fmt: skip
    return SimpleNamespace(frames=columns, ticks=columns, T_world_rig=poses)


@pytest.mark.parametrize("place", [(0, 0, 0), (-2.7, 0, 0), (-0.6, 0.3, 1.4)], ids=["rig", "ego", "camera"])
@pytest.mark.parametrize("radius", [None, BEND_RADIUS], ids=["straight", "bend"])
def test_velocity_and_acceleration_are_derivatives_of_the_position_over_a_hump(radius, place):
    clip = drive_over_hump(lay_route(radius))
    motion = compute_inertial_motion(clip, VEHICLE, place)
    t, within = clip.ticks["t_ns"] * 1e-9, slice(5, -5)
    position = (clip.T_world_rig @ [*place, 1.0])[:, :3]
    velocity = np.gradient(position, t, axis=0)
    np.testing.assert_allclose(motion.velocity[within], velocity[within], atol=1e-3)
    acceleration = np.gradient(motion.velocity, t, axis=0)
    felt = motion.force - [0, 0, GRAVITY]
    np.testing.assert_allclose(felt[within], acceleration[within], atol=0.02)
    assert np.abs(felt).max() > 5  # the hump is felt


def test_the_turn_rate_is_that_of_the_attitude():
    clip = drive_over_hump(lay_route(BEND_RADIUS))
    motion = compute_inertial_motion(clip, VEHICLE)
    turned = (motion.attitude[1:] * motion.attitude[:-1].inv()).as_rotvec() / 1e-3
    middle = (motion.turn_rate[1:] + motion.turn_rate[:-1]) / 2
    np.testing.assert_allclose(middle[5:-5], turned[5:-5], atol=1e-3)


def test_a_car_that_stands_in_a_bend_feels_gravity_alone():
    clip = drive_over_hump(lay_route(BEND_RADIUS))
    for name in clip.frames.keys() - {"t_ns", "tick"}:
        clip.frames[name] = np.full(1001, 5.0 if name == "station" else 0.0)
    clip.T_world_rig[:] = clip.T_world_rig[:1]
    motion = compute_inertial_motion(clip, VEHICLE)
    np.testing.assert_array_equal(motion.velocity, 0)
    np.testing.assert_array_equal(motion.turn_rate, 0)
    np.testing.assert_allclose(motion.force, np.tile([0, 0, GRAVITY], (1001, 1)))
