"""The frames of a clip: where the rig is at each, and what its camera sees there."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.grids.form import TICK_RATE_HZ
from catalogs.scenario import Scenario
from flows.making.bodies import build_moving_bodies
from flows.making.catalogue import Catalogue
from flows.making.driving import hazard_of, sky_of, weather_of
from flows.making.plan import Plan, frame_ticks
from flows.making.road_users import move_road_users
from tasks.render.camera import Camera, RigAt, body_poses, continuous_rig
from tasks.render.clip import RigMotion, render_clip
from tasks.render.feature_sign import add_sign
from tasks.render.kerb_face import extend_kerbs
from tasks.render.rasterise.backend import select_backend
from tasks.render.road_edit import RoadRelief, apply_road_profile
from tasks.render.road_paint import HazardMarking, paint_feature
from tasks.render.road_refinement import refine_road
from tasks.render.weather.layers import ClipConditions
from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene
from tasks.scene.street.cars.near import detail_cars
from tasks.scene.street.houses.near import detail_fronts
from tasks.surface.anchors import adjacent_anchors
from tasks.surface.road_profile import RoadHazard, road_elevation, road_slope
from tasks.surface.state import SurfaceState
from tasks.vehicle.rollout import Rollout


def frame_rows(ride: Rollout, plan: Plan, catalogue: Catalogue) -> dict[str, NDArray[Any]]:
    """The tick that each frame shows, and the rig pose at it."""
    frame = np.arange(plan.settings.frames)
    tick = frame_ticks(plan.settings.frames, plan.settings.frame_rate_hz)
    rows = {"frame": frame, "tick": tick} | {name: column[tick] for name, column in ride.columns.items()}
    vehicle = catalogue.vehicle
    poses = body_poses(
        catalogue.scene.route, rows["station"], rows["heave"], rows["pitch"],
        cg_behind_front_axle=vehicle.cg_to_front_axle, cg_height=vehicle.cg_height,
    )  # fmt: skip
    return rows | {"T_world_rig": poses.reshape(len(frame), 16)}


def rig_of(ride: Rollout, frames: Mapping[str, NDArray[Any]], catalogue: Catalogue) -> RigAt:
    """Rig poses about every frame, for a camera that moves while it sees one."""
    vehicle, tick_s = catalogue.vehicle, 1 / TICK_RATE_HZ
    time_s = np.arange(len(ride.columns["station"]), dtype=np.float64) * tick_s
    return continuous_rig(
        catalogue.scene.route, time_s,
        ride.columns["station"], ride.columns["heave"], ride.columns["pitch"], frames["tick"] * tick_s,
        cg_behind_front_axle=vehicle.cg_to_front_axle, cg_height=vehicle.cg_height,
    )  # fmt: skip


def render_frames(
    scenario: Scenario,
    state: SurfaceState,
    frames: Mapping[str, NDArray[Any]],
    plan: Plan,
    catalogue: Catalogue,
    seed: int,
    rig_at: RigAt,
    shown: range | None = None,
) -> dict[str, NDArray[Any]]:
    """Render the clip's finished frames, depth and class; ``shown`` is that of `RigMotion`."""
    camera = catalogue.camera_of(seed)
    motion = gather_motion(scenario, state, frames, plan, catalogue, camera, rig_at)
    relief = shape_road(catalogue.scene, hazard_of(scenario))
    buffers = render_clip(
        # no name is given to it here: the renderer frees the clear scene when the weather is in it
        _make_clear_scene(catalogue, relief, camera, motion.T_world_rig),
        camera,
        replace(motion, shown=shown),
        ClipConditions(
            state=state,
            pavement=catalogue.surface,
            parameters=catalogue.weather_parameters,
            seed=seed,
            sky=sky_of(scenario),
            anchors=_anchors_of(scenario, plan, catalogue),
            refracts=plan.settings.composition == "paper",
        ),
        select_backend(plan.backend),
        relief=relief,
        labels=plan.settings.labels,
        composition=plan.settings.composition,
    )
    if plan.settings.has_objects and not scenario.objects:
        buffers["instance"] = np.zeros(buffers["class"].shape, np.uint16)
    return buffers


def gather_motion(
    scenario: Scenario,
    state: SurfaceState,
    frames: Mapping[str, NDArray[Any]],
    plan: Plan,
    catalogue: Catalogue,
    camera: Camera,
    rig_at: RigAt,
) -> RigMotion:
    """Return the motion of rig and road users at a clip's frames."""
    sizes, time = catalogue.road_user_sizes, frames["tick"] / TICK_RATE_HZ
    motions = move_road_users(scenario, sizes, catalogue.scene, state.friction, time)
    T_world_rig = frames["T_world_rig"].reshape(-1, 4, 4)
    T_world_camera = T_world_rig @ camera.T_rig_camera
    return RigMotion(
        T_world_rig=T_world_rig,
        frame_rate_hz=plan.settings.frame_rate_hz,
        rig_at=rig_at,
        bodies=build_moving_bodies(scenario, catalogue, motions, T_world_camera, float(camera.K[0, 0])),
    )


def _make_clear_scene(
    catalogue: Catalogue, relief: RoadRelief | None, camera: Camera, T_world_rig: NDArray[np.float64]
) -> Scene:
    """Return the scene with near cars and fronts in detail and the road feature in it."""
    scene = catalogue.scene
    if (street := catalogue.street) is not None:
        seen = *street, T_world_rig @ camera.T_rig_camera, float(camera.K[0, 0])
        scene = replace(scene, gaussians=detail_fronts(detail_cars(scene.gaussians, *seen), *seen))
    albedo = catalogue.weather_parameters.sky.asphalt_albedo
    return replace(scene, gaussians=edit_scene(scene, relief, catalogue.marking, albedo))


def shape_road(scene: Scene, hazard: RoadHazard) -> RoadRelief | None:
    """Return a road feature as the renderer takes it; None on a flat road.

    Parameters
    ----------
    scene : whose route the feature lies on
    hazard : road feature; height 0 is a flat road
    """
    if hazard.height_m == 0:
        return None
    return RoadRelief(
        route=scene.route,
        elevation=lambda station: road_elevation(station, hazard),
        slope=lambda station: road_slope(station, hazard),
        near=hazard.center_m - hazard.length_m / 2,
        far=hazard.center_m + hazard.length_m / 2,
    )


def edit_scene(
    scene: Scene, relief: RoadRelief | None, marking: HazardMarking | None, asphalt_albedo: float
) -> Gaussians:
    """Return the Gaussians of a scene with a road feature.

    Parameters
    ----------
    scene : without the feature
    relief : road feature; None leaves the scene as it is
    marking : finish of the feature; None leaves it plain
    asphalt_albedo : share of the light that the pavement sends back [1]
    """
    if relief is None:
        return scene.gaussians
    carriageway = scene.carriageway_left, scene.carriageway_right
    gaussians = refine_road(scene.gaussians, relief)
    if marking is not None:
        gaussians = paint_feature(gaussians, relief, marking, *carriageway, asphalt_albedo, scene.daylight)
        if marking.sign is not None:
            gaussians = add_sign(
                gaussians, relief, marking.sign, scene.carriageway_right, asphalt_albedo, scene.daylight
            )
    return extend_kerbs(apply_road_profile(gaussians, relief, *carriageway)[0], relief)


def _anchors_of(scenario: Scenario, plan: Plan, catalogue: Catalogue) -> tuple[SurfaceState, ...]:
    """Return the anchors about the clip's rate that the paper's composition blends."""
    look = catalogue.weather_parameters.find_look(scenario.weather)
    if plan.settings.composition != "paper" or look.anchors_mm_h is None or not scenario.falling:
        return ()
    return adjacent_anchors(weather_of(scenario), look.anchors_mm_h, catalogue.surface)
