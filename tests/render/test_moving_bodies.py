"""Moving bodies in the pictures of a clip: where they are drawn, how they flow, what they shade, and who sees them."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.weather.look import load_weather
from tasks.conventions import SemanticClass
from tasks.render.camera import world_to_camera
from tasks.render.clip import RigMotion, render_clip
from tasks.render.labels import OCCLUDED
from tasks.render.moving_bodies import BodiesInClip, MovingBody
from tasks.render.rasterise.backend import CpuBackend
from tasks.render.rasterise.placed_body import PlacedBody
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.weather.layers import ClearScene, ClipConditions, weather_scene
from tasks.render.weather.scene_light import append_gaussians
from tasks.scene.road_users.bodies import build_road_user
from tasks.scene.transform import transform_gaussians
from tasks.surface.state import SurfaceState
from tests.render.rolling_cameras import ALL, CAMERA
from tests.render.test_readout_of_clips import rig, scene
from tests.render.weather.scenes import PAVEMENT, road

STATES = {
    "dry": SurfaceState(kind="dry"),
    "rain": SurfaceState(kind="rain", precipitation_mm_h=10, film_depth_mm=1.1),
    "snow": SurfaceState(kind="snow", precipitation_mm_h=3, snow_depth_mm=30, snow_coverage=1.0),
}


@pytest.fixture(scope="module")
def street():
    return scene(road(length=60))


@pytest.fixture(scope="module")
def parameters():
    return load_weather()


def car(ways, heading=0.0, kind="car", lateral=0.0):
    """A body at ways from the start of the route, one a frame."""
    poses = np.tile(np.eye(4), (len(ways), 1, 1))
    poses[:, :2, :2] = (np.cos(heading), -np.sin(heading)), (np.sin(heading), np.cos(heading))
    poses[:, 0, 3], poses[:, 1, 3] = ways, lateral
    body = build_road_user(kind, np.array(load("road user sizes")[kind]), cell=0.12)
    still = {"velocity": np.zeros((len(ways), 3)), "braking": np.zeros(len(ways), np.bool_)}
    return MovingBody(number=1, body=body, T_world_body=poses, **still)


def film(street, parameters, bodies, camera=CAMERA, state="dry", labels=False):
    at = rig()
    poses = np.concatenate([at(k, np.zeros(1)) for k in range(3)])
    motion = RigMotion(T_world_rig=poses, frame_rate_hz=10, rig_at=at, bodies=bodies)
    conditions = ClipConditions(state=STATES[state], pavement=PAVEMENT, parameters=parameters, seed=1)
    made = render_clip(street, camera, motion, conditions, CpuBackend(), labels=labels)
    return made, poses @ camera.T_rig_camera


def test_a_placed_body_is_drawn_as_its_gaussians_in_the_world_are(street, parameters):
    moving = car(np.array([12.0]), heading=0.4)
    weathered, weather = weather_scene(
        ClearScene(gaussians=street.gaussians, environment=street.environment),
        ClipConditions(state=STATES["dry"], pavement=PAVEMENT, parameters=parameters, seed=1), 100.0,
    )  # fmt: skip
    bodies = BodiesInClip([moving], street, weathered, weather, CpuBackend(), rig()(0, np.zeros(1)))
    local = bodies.wrap(0, 0)
    view = world_to_camera(rig()(0, np.zeros(1))[0] @ CAMERA.T_rig_camera)
    size = (view, CAMERA.K, CAMERA.width, CAMERA.height)
    placed = PlacedBody(prepared=prepare_gaussians(local), T_world_body=moving.T_world_body[0], number=7)
    ours = rasterise_view(prepare_gaussians(street.gaussians), *size, bodies=[placed])
    joined = append_gaussians(street.gaussians, transform_gaussians(local, moving.T_world_body[0]))
    theirs = rasterise_view(prepare_gaussians(joined), *size)
    # discs of one depth change places
    assert np.mean(np.abs(ours.rgb - theirs.rgb) > 2e-3) < 1e-3
    assert np.mean(np.abs(ours.normal - theirs.normal) > 2e-2) < 1e-3
    assert np.mean(np.abs(ours.depth / theirs.depth - 1) > 1e-3) < 1e-3
    on_body = ours.object_id == 7
    assert on_body.sum() > 300
    assert (ours.class_id[on_body] == SemanticClass.VEHICLE).all()
    assert set(np.unique(ours.object_id)) == {0, 7}


@pytest.mark.parametrize("camera", (CAMERA, ALL), ids=("pinhole", "lens and rolling shutter"))
def test_the_flow_on_a_moving_car_is_its_projected_rigid_motion(street, parameters, camera):
    moving = car(np.array([11.0, 12.1, 13.0]))
    made, T_world_camera = film(street, parameters, [moving], camera, labels=True)
    K, points = camera.K, moving.body.body.gaussians.means
    places = []
    for k in range(2):
        world = points @ moving.T_world_body[k, :3, :3].T + moving.T_world_body[k, :3, 3]
        local = (world - T_world_camera[k, :3, 3]) @ T_world_camera[k, :3, :3]
        places.append(
            np.column_stack((local[:, :2] / local[:, 2:] * (K[0, 0], K[1, 1]) + K[:2, 2], local[:, 2]))
        )
    column, row = np.floor(places[0][:, :2]).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < camera.width) & (row < camera.height)
    column, row, here, there = column[inside], row[inside], places[0][inside], places[1][inside]
    shown = (made["instance"][0, row, column] == 1) & (
        np.abs(made["depth"][0, row, column] - here[:, 2]) < 0.05
    )
    assert shown.sum() > 30
    error = made["flow"][0, row[shown], column[shown]] - (there - here)[shown, :2]
    # the lens moves both ends of the flow alike; a row's own time adds the way of the camera in it
    assert np.median(np.linalg.norm(error, axis=1)) <= (0.1 if camera is CAMERA else 0.6)


def test_what_a_moving_car_hides_next_is_marked(street, parameters):
    moving = car(np.array([14.0, 14.0, 14.0]), lateral=-3.0)
    moving.T_world_body[1, 1, 3] = 0.0
    made, _ = film(street, parameters, [moving], labels=True)
    hidden = made["marks"][0] & OCCLUDED > 0
    next_there = (made["instance"][1] == 1) & (made["instance"][0] == 0)
    assert hidden[next_there].mean() > 0.5


@pytest.mark.parametrize("state", STATES)
def test_a_body_changes_only_its_own_pixels_and_the_ground_about_it(street, parameters, state):
    without, _ = film(street, parameters, [], state=state)
    made, _ = film(street, parameters, [car(np.array([11.0, 12.1, 13.0]))], state=state)
    changed = (made["rgb"] != without["rgb"]).any(axis=-1)
    kinds = set(np.unique(made["class"][changed & (made["instance"] == 0)]))
    assert kinds <= {SemanticClass.ROAD, SemanticClass.MARKING, SemanticClass.SKY}
    shaded = (made["class"] == SemanticClass.ROAD) & (made["instance"] == 0)
    below = shaded & (np.roll(made["instance"], 2, axis=1) == 1)
    assert below.sum() > 20
    assert made["rgb"][below].mean() < 0.8 * without["rgb"][below].mean()
    far = shaded & (made["depth"] < 5)
    if state != "rain":  # a wet road mirrors it
        np.testing.assert_array_equal(made["rgb"][far], without["rgb"][far])


def test_stop_lamps_shine_while_it_brakes(street, parameters):
    coasting = car(np.array([11.0, 12.1, 13.0]))
    braking = replace(coasting, braking=np.array([False, True, True]))
    dark, lit = (film(street, parameters, [moving])[0]["rgb"] for moving in (coasting, braking))
    np.testing.assert_array_equal(dark[0], lit[0])
    brighter = lit[1].astype(int) - dark[1]
    assert brighter[..., 0].max() > 60 > brighter[..., 1].max()
