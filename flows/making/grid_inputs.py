"""A grid held against its catalogue entries and its scene: what the grid alone cannot tell to be wrong."""

from collections.abc import Set

from catalogs.entries import load
from catalogs.grids import Grid
from catalogs.physical_limits import find_limit_problem
from catalogs.road_grade import ROAD_GRADE, write_road_grade
from catalogs.scenario import find_range_problems, find_route_problems, find_scenario_problems
from catalogs.scenes import load_scene, scene_identity
from catalogs.sentences import cap_problems
from catalogs.studies.ablation import cut_coupling
from flows.making.bends import find_bend_problems
from flows.making.driving import hazard_of, surface_of
from flows.making.grid_entries import GridEntries, read_entries, recorded_reference
from flows.making.memory import find_memory_problems
from flows.making.places import remember_place
from flows.making.road_users import find_road_user_problems
from flows.making.traced import read_trace_inputs
from tasks.errors import InputError
from tasks.render.sensor import Sensor
from tasks.render.weather.snow.layer import HIGHEST_LUMP
from tasks.scene.route_shape import sample_grade
from tasks.surface.road_profile import RoadGrade
from tasks.surface.weather import WEATHERS, find_weather_problem
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.strut_travel import compute_strut_travel


def read_grid_inputs(grid: Grid, tick_rate_hz: int) -> tuple[GridEntries, dict[str, str], list[str]]:
    """Return the catalogue entries and the scene of a grid, and the problems of these and of the grid with them.

    Parameters
    ----------
    grid : read from its file
    tick_rate_hz : of the telemetry [Hz]

    Returns
    -------
    The entries, with the files that follow from scene and traces; name and hash of the scene; one sentence for each
    problem.
    """
    scenarios = [scenario for _, scenario in grid.scenarios]
    driven = [cut_coupling(scenario, grid.settings.variant) for scenario in scenarios]
    weathers = {scenario.weather for scenario in (*scenarios, *driven)}
    entries = read_entries(grid.settings, weathers)
    scene, problems = _identify_scene(grid.settings.scene)
    problems = entries.problems + problems
    if not problems:
        problems += _find_weather_problems(entries.vehicle, weathers)
        problems += _find_buried_cameras(grid, entries)
    sound = not problems
    if scene:
        problems += _find_route_problems(grid)
        if grid.poses is None and not (grade := grade_of(grid.settings.scene)).is_level:
            entries.contents[ROAD_GRADE] = write_road_grade(grade, scene["name"])
    if sound:
        problems += cap_problems(_find_feature_problems(grid, entries.vehicle))
        problems += cap_problems(find_road_user_problems(grid, entries))
    if sound and grid.poses is None:
        problems += cap_problems(find_bend_problems(grid, entries))
    if grid.poses is not None:
        traces, found = read_trace_inputs(grid, grid.poses, entries.values.get("surface.yaml"))
        entries.contents.update(traces)
        problems += found
        if grid.settings.variant != "full":
            problems.append(
                "variant must be full where --poses gives the motion, which is not driven;"
                f" it is {grid.settings.variant}"
            )
    if grid.settings.variant == "no-low-speed-rule" and not grid.settings.keeps_stops_steady:
        problems.append(
            "variant no-low-speed-rule leaves out a rule of vehicle_mode: paper with low_speed: steady; this grid"
            f" drives vehicle_mode: {grid.settings.vehicle_mode} with low_speed: {grid.settings.low_speed}"
        )
    if "camera.yaml" in entries.values:
        problems += _find_camera_problems(grid, entries, tick_rate_hz)
    return entries, scene, problems


def _identify_scene(name_or_folder: str) -> tuple[dict[str, str], list[str]]:
    """Return name and hash of a scene, and its problems."""
    try:
        scene = {"name": recorded_reference(name_or_folder), "sha256": scene_identity(name_or_folder)}
        remember_place(scene["sha256"], name_or_folder)
    except InputError as error:
        return {}, list(error.problems)
    return scene, []


def _find_weather_problems(vehicle: Vehicle, weathers: Set[str]) -> list[str]:
    """Kinds of weather in which the vehicle has no tyres."""
    problems: list[str] = []
    for kind in sorted(weathers & WEATHERS.keys()):
        try:
            vehicle.find_tyre_family(kind)
        except InputError as error:
            problems += error.problems
    return problems


def _find_buried_cameras(grid: Grid, entries: GridEntries) -> list[str]:
    """Scenarios in whose pictures the camera would look out of the snow."""
    if not grid.settings.pictures:
        return []
    height_m = float(entries.camera.T_rig_camera[2, 3])
    deepest_mm = 1e3 * height_m / HIGHEST_LUMP
    return [
        f"scenario {label}: snow must be less than {deepest_mm:g} mm deep in a picture: its lumps reach the camera"
        f" {height_m:g} m above the road; it is {depth_mm:g} mm: take a shorter snow_accumulation_h or pictures: false"
        for label, scenario in grid.scenarios
        # a faulty scenario has been told of
        if find_weather_problem(scenario.weather) is None
        and not find_range_problems(scenario)
        and (depth_mm := surface_of(scenario, entries.surface).snow_depth_mm) >= deepest_mm
    ]


def _find_camera_problems(grid: Grid, entries: GridEntries, tick_rate_hz: int) -> list[str]:
    """List settings that exceed the camera or the memory of this machine."""
    settings, camera = grid.settings, entries.camera
    ticks = round(settings.telemetry_s * tick_rate_hz) + 1
    problems = find_memory_problems(settings, camera, ticks)
    if settings.composition == "linear" or (camera.plain and camera.sensor == Sensor()):
        return problems
    return [
        *problems,
        f"composition: paper is one of finished 8-bit pictures; {camera.name} has a lens, a shutter or a sensor that"
        " needs linear light: take a plain camera or composition: linear",
    ]


def _find_feature_problems(grid: Grid, vehicle: Vehicle) -> list[str]:
    """Road features that move a strut of the vehicle beyond its stops, which the model does not have."""
    limits = load("table of physical limits")
    problems: dict[str, str] = {}
    for label, scenario in grid.scenarios:
        if scenario.hazard_height_m == 0 or find_scenario_problems(scenario):
            continue  # a faulty scenario has been told of
        travel = compute_strut_travel(vehicle, hazard_of(scenario), scenario.initial_speed_km_h / 3.6)
        rule = (
            f"strut travel on the road feature of {scenario.hazard_length_m:g} x {scenario.hazard_height_m:g} m at"
            f" {scenario.initial_speed_km_h:g} km/h"
        )
        if problem := find_limit_problem(rule, travel, limits.strut_travel):
            problems.setdefault(
                problem, f"scenario {label}: {problem}: drive more slowly, or flatten the feature"
            )
    return list(problems.values())


def grade_of(scene: str) -> RoadGrade:
    """Return the grade of the road in a scene, which is named as of `catalogs.scenes.load_scene`."""
    return sample_grade(load_scene(scene).route)


def _find_route_problems(grid: Grid) -> list[str]:
    route = load_scene(grid.settings.scene).route
    problems: dict[str, str] = {}
    steepest = max(map(abs, sample_grade(route).rise))
    if problem := find_limit_problem(
        "grade of the road", steepest, load("table of physical limits").road_grade
    ):
        problems["grade"] = (
            f"scene {grid.settings.scene}: {problem}: its z axis must point up, against gravity"
        )
    for label, scenario in grid.scenarios:
        for problem in find_route_problems(scenario, route.length, grid.settings.scene):
            problems.setdefault(problem, f"scenario {label}: {problem}")
    return list(problems.values())
