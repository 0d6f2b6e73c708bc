"""The picture of a drive by steps: what its camera sees when a step begins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.scenario import Scenario
from catalogs.scenes import load_scene
from catalogs.weather.grip import WEATHER
from catalogs.weather.look import load_weather
from flows.making.bodies import build_moving_bodies
from flows.making.driving import hazard_of
from flows.making.pictures import edit_scene, shape_road
from flows.making.road_users import move_road_users
from tasks.errors import InputError
from tasks.render.camera import Camera, body_poses
from tasks.render.clip import RigMotion, render_clip
from tasks.render.rasterise.backend import select_backend
from tasks.render.weather.layers import ClipConditions
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.vehicle.parameters import Vehicle

SEED = 2025
"""Visual seed, which is that of a grid that names none [1]."""


class StepCamera:
    """A camera on the car that is stepped.

    Parameters
    ----------
    scenario, state, pavement : the drive and its road
    vehicle : that carries the camera
    scene, camera : names of the catalogue, or files
    rate_hz : of the steps [Hz]

    Raises
    ------
    InputError
        For a camera that moves while it sees a picture: a step does not know where it will be.
    """

    def __init__(
        self, scenario: Scenario, state: SurfaceState, pavement: SurfaceParameters, vehicle: Vehicle, *, scene: str,
        camera: str, rate_hz: float,
    ) -> None:  # fmt: skip
        self._scenario, self._vehicle, self._rate = scenario, vehicle, rate_hz
        self.camera: Camera = load("camera", camera)
        self._scene = load_scene(scene)
        if self.camera.moves:
            raise InputError(
                f"camera {camera}: moves while it sees a picture, which a drive by steps cannot show"
            )
        parameters = load_weather(WEATHER)
        self._relief = shape_road(self._scene, hazard_of(scenario))
        gaussians = edit_scene(self._scene, self._relief, None, parameters.sky.asphalt_albedo)
        self._edited = replace(self._scene, gaussians=gaussians)
        self._conditions = ClipConditions(state=state, pavement=pavement, parameters=parameters, seed=SEED)
        self.road_user_sizes: dict[str, tuple[float, ...]] = (
            load("road user sizes") if scenario.objects else {}
        )

    def own_body(self, name: str) -> Path:
        """Return the file of a body of the user's: the scenario's path."""
        return Path(name)

    def see(
        self, step: int, station: NDArray[np.float64], heave: NDArray[np.float64], pitch: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """Return the picture at a step, uint8 [H, W, 3] sRGB.

        Parameters
        ----------
        step : number of the step [1]
        station, heave, pitch : of the car at the step before and at this one, float64 [2] [m, m, rad]
        """
        poses = body_poses(
            self._scene.route, station, heave, pitch, cg_behind_front_axle=self._vehicle.cg_to_front_axle,
            cg_height=self._vehicle.cg_height,
        )  # fmt: skip
        time = np.maximum(np.array([step - 1, step]), 0) / self._rate
        motions = move_road_users(
            self._scenario, self.road_user_sizes, self._scene, self._conditions.state.friction, time
        )
        motion = RigMotion(
            T_world_rig=poses, frame_rate_hz=self._rate, first_frame=step - 1, shown=range(1, 2),
            bodies=build_moving_bodies(
                self._scenario, self, motions, poses @ self.camera.T_rig_camera, float(self.camera.K[0, 0])
            ),
        )  # fmt: skip
        drawn = render_clip(
            self._edited, self.camera, motion, self._conditions, select_backend("auto"), relief=self._relief
        )
        picture: NDArray[np.uint8] = drawn["rgb"][-1].astype(np.uint8, copy=False)
        return picture
