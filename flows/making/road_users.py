"""The road users of a clip: what their tracks and the surface make of them, and what stands against that."""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray

from catalogs.grids import Grid
from catalogs.road_users import EGO, ROAD_USERS
from catalogs.scenario import Scenario, find_scenario_problems
from catalogs.scenes import load_scene
from flows.making.driving import hazard_of, surface_of
from flows.making.grid_entries import GridEntries
from tasks.driving.outcome import TICK_S, find_unbraked_impact, join_outcomes, judge_approach
from tasks.driving.targets import follow_track, locate_body
from tasks.errors import InputError
from tasks.scene.road_users.ground import find_meeting, find_obstacle, measure_ground
from tasks.scene.road_users.motion import Motion, move_on_track
from tasks.scene.route import Route
from tasks.scene.scene import Scene
from tasks.surface.road_profile import road_elevation

Sizes = Mapping[str, tuple[float, ...]]

OUTCOMES = ("collided", "impact_speed", "min_ttc", "clearance", "avoided_speed")
"""Columns of clips that say what became of the approach to road users."""
RANGED = OUTCOMES[1:]
"""Those of them that are given with their percentiles."""
CHECK_STEP_S = 0.05
"""Time between the poses that are held against the street [s]."""


def move_road_users(
    scenario: Scenario, sizes: Sizes, scene: Scene, friction: float, time: NDArray[np.float64]
) -> list[Motion]:
    """Return the motion of each road user of a scenario at some times, on the ground of the scene.

    Parameters
    ----------
    scenario : of the clip
    sizes : kind to length, width and height [m]
    scene : its route and its ground
    friction : mu of the scenario's surface, which bounds every change of speed [1]
    time : float64 [N] since the start of the clip [s]

    Raises
    ------
    InputError
        If a track leaves the route: one sentence each.
    """
    motions, problems = [], []
    for number, user in enumerate(scenario.objects, start=1):
        try:
            motion = move_on_track(user.build_track(user.choose_size(sizes)), scene.route, time, friction)
        except InputError as error:
            problems += [f"object {number} ({user.kind}) {problem}" for problem in error.problems]
            continue
        poses = motion.T_world_body.copy()
        rise = measure_ground(poses[:, :3, 3], scene)
        if scenario.hazard_height_m:
            station, lateral, _ = scene.route.project(poses[:, :3, 3])
            on_road = (lateral < scene.carriageway_left) & (lateral > scene.carriageway_right)
            rise += np.where(on_road, road_elevation(station, hazard_of(scenario)), 0.0)
        poses[:, 2, 3] += rise
        motions.append(replace(motion, T_world_body=poses))
    if problems:
        raise InputError(problems)
    return motions


def judge_road_users(
    scenario: Scenario, sizes: Sizes, route: Route, friction: float, ticks: Mapping[str, NDArray[np.float64]]
) -> dict[str, float | bool]:
    """Return what became of a clip's approach to its road users, by the columns of clips; NaN without any.

    Parameters
    ----------
    scenario, sizes, friction : as of `move_road_users`
    route : of the scene
    ticks : station [m], speed [m/s] and brake_pressure_mpa [MPa] of the car at every millisecond, [N] each
    """
    if not scenario.objects:
        return dict.fromkeys(OUTCOMES, nan)
    overhang, width = sizes[EGO]
    station, speed, pressure = (ticks[name] for name in ("station", "speed", "brake_pressure_mpa"))
    time = TICK_S * np.arange(len(station), dtype=np.float64)
    found = []
    for user in scenario.objects:
        track = user.build_track(size := user.choose_size(sizes))
        unbraked = nan
        if not track.in_world:
            straight = follow_track(track, size, friction)
            unbraked = find_unbraked_impact(float(speed[0]), float(station[0]) + overhang, straight, width)
        path = locate_body(move_on_track(track, route, time, friction), size, route, time)
        found.append(
            judge_approach(
                station, speed, pressure, path, overhang=overhang, width=width, unbraked_impact=unbraked
            )
        )
    joined = join_outcomes(found)
    figures = {name: getattr(joined, name) for name in OUTCOMES}
    return {name: value if isfinite(value) else nan for name, value in figures.items()}


def find_road_user_problems(grid: Grid, entries: GridEntries) -> list[str]:
    """Return a sentence for each road user that leaves the route, drives into something, or stands where another does.

    Parameters
    ----------
    grid : whose entries and scene are sound
    entries : of the grid
    """
    problems: dict[str, str] = {}
    for label, scenario in grid.scenarios:
        if scenario.objects and not find_scenario_problems(scenario):
            for problem in _find_problems(scenario, grid, entries):
                problems.setdefault(problem, f"scenario {label}: {problem}")
    return list(problems.values())


def _find_problems(scenario: Scenario, grid: Grid, entries: GridEntries) -> list[str]:
    sizes, scene = entries.values[ROAD_USERS], load_scene(scenario.scene or grid.settings.scene)
    friction = surface_of(scenario, entries.surface).friction
    time = np.arange(0.0, grid.settings.telemetry_s + CHECK_STEP_S, CHECK_STEP_S)
    time[-1] = grid.settings.telemetry_s
    try:
        motions = move_road_users(scenario, sizes, scene, friction, time)
    except InputError as error:
        return list(error.problems)
    names = [f"object {number} ({user.kind})" for number, user in enumerate(scenario.objects, start=1)]
    boxes = [np.array(user.choose_size(sizes)) for user in scenario.objects]
    problems = []
    for name, motion, size in zip(names, motions, boxes, strict=True):
        if (met := find_obstacle(motion.T_world_body, size, scene.gaussians)) is not None:
            moment, kind = met
            station, lateral, _ = scene.route.project(motion.T_world_body[moment, None, :3, 3])
            problems.append(
                f"{name} must keep clear of the street; at {time[moment]:g} s, station {station[0]:.1f} m and"
                f" {lateral[0]:.1f} m to the left, it is in something of class {kind.name.lower()}: move its track"
            )
        ego, ego_size = _place_ego(scene, entries)
        if find_meeting(motion.T_world_body[:1], size, ego, ego_size) is not None:
            problems.append(f"{name} must not stand where the ego vehicle starts: begin farther ahead")
        for other, theirs, their_size in zip(names, motions, boxes, strict=True):
            if other == name:
                break
            met_at = find_meeting(motion.T_world_body, size, theirs.T_world_body, their_size)
            if met_at is not None:
                problems.append(
                    f"{other} and {name} must not be in one place; they are at {time[met_at]:g} s: move one of them"
                )
    return problems


def _place_ego(scene: Scene, entries: GridEntries) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the pose [1, 4, 4] of the ego vehicle's middle at its start, and its size [3] [m]."""
    overhang, width = entries.values[ROAD_USERS][EGO]
    wheelbase = entries.vehicle.cg_to_front_axle + entries.vehicle.cg_to_rear_axle
    pose = scene.route.pose(np.zeros(1))
    pose[:, :3, 3] -= pose[:, :3, 0] * wheelbase / 2
    return pose, np.array((wheelbase + 2 * overhang, width, 1.5))
