"""A grid held against its catalogue entries and its scene: faults that the grid alone does not show."""

from collections.abc import Set
from typing import Any

from catalogs.entries import load
from catalogs.grids import Grid
from catalogs.physical_limits import find_limit_problem
from catalogs.road_grade import name_grade_file, write_road_grade
from catalogs.scenario import find_range_problems, find_route_problems, find_scenario_problems
from catalogs.scenes import is_built_in, load_route, load_scene, scene_identity
from catalogs.sentences import cap_problems
from catalogs.street_names import parse_street_name
from catalogs.studies.ablation import cut_coupling
from flows.making.bends import find_bend_problems
from flows.making.driving import hazard_of, surface_of
from flows.making.grid_entries import GridEntries, read_entries, recorded_reference
from flows.making.locations import note_location
from flows.making.memory import find_memory_problems
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

Scenes = dict[str | None, dict[str, Any]]
"""Name, hash, and of a drawn street kind and seed, by the name that scenarios call a scene: None is the grid's one."""


def read_grid_inputs(grid: Grid, tick_rate_hz: int) -> tuple[GridEntries, Scenes, list[str]]:
    """Return the catalogue entries and the scenes of a grid, and the problems of these and of the grid with them.

    Parameters
    ----------
    grid : read from its file
    tick_rate_hz : of the telemetry [Hz]

    Returns
    -------
    The entries, with the files that follow from scenes and traces; the scenes; one sentence for each problem.
    """
    scenarios = [scenario for _, scenario in grid.scenarios]
    driven = [cut_coupling(scenario, grid.settings.variant) for scenario in scenarios]
    weathers = {scenario.weather for scenario in (*scenarios, *driven)}
    entries = read_entries(grid.settings, weathers)
    scenes, problems = _identify_scenes(grid)
    problems = entries.problems + problems
    if not problems:
        problems += _find_weather_problems(entries.vehicle, weathers)
        problems += _find_buried_cameras(grid, entries)
    sound = not problems
    if scenes:
        problems += _find_route_problems(grid, scenes)
        problems += cap_problems(_find_sky_problems(grid, scenes))
        if grid.poses is None:
            entries.contents.update(_list_grades(grid, scenes))
    if sound:
        problems += cap_problems(_find_feature_problems(grid, entries.vehicle))
        problems += cap_problems(find_road_user_problems(grid, entries))
    if sound and grid.poses is None:
        problems += cap_problems(find_bend_problems(grid, entries))
    entries.contents.update(grid.driven)
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
    return entries, scenes, problems


def _identify_scenes(grid: Grid) -> tuple[Scenes, list[str]]:
    """Return the scenes of a grid's clips, and their problems; no scene where one has any."""
    scenes: Scenes = {}
    problems: list[str] = []
    for named in dict.fromkeys(scenario.scene for _, scenario in grid.scenarios) or [None]:
        try:
            scenes[named] = _identify_scene(grid.settings.scene if named is None else named)
        except InputError as error:
            problems += error.problems
            continue
        if named is not None and named != scenes[named]["name"]:
            problems.append(
                f"scene {named}: a level must name a street or a folder below the working folder, which can be"
                " recorded: copy it there and name it so"
            )
    files = [name_grade_file(name) for name in scenes]
    problems += [
        f"scene {name}: must differ from the others in letters, digits or one of . = _ -; another is so named"
        for name, file in zip(scenes, files, strict=True)
        if files.count(file) > 1
    ]
    return ({} if problems else scenes), problems


def _identify_scene(name_or_folder: str) -> dict[str, Any]:
    """Return name and hash of a scene, and kind and seed of a street that is drawn."""
    scene: dict[str, Any] = {
        "name": recorded_reference(name_or_folder),
        "sha256": scene_identity(name_or_folder),
    }
    note_location(scene["sha256"], name_or_folder)
    street = parse_street_name(name_or_folder)
    return scene if street is None else scene | {"kind": street.kind, "seed": street.seed}


def _list_grades(grid: Grid, scenes: Scenes) -> dict[str, bytes]:
    """Return the files with the grade of each scene that is not level."""
    grades = {named: grade_of(named or grid.settings.scene) for named in scenes}
    return {
        name_grade_file(named): write_road_grade(grade, scenes[named]["name"])
        for named, grade in grades.items()
        if not grade.is_level
    }


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
    camera = entries.camera
    height_m = camera.spread.get("height_above_road", camera.T_rig_camera[2:3, 3])[0]
    deepest_mm = 1e3 * height_m / HIGHEST_LUMP
    return [
        f"scenario {label}: snow must be less than {deepest_mm:g} mm deep in a picture: its lumps reach the camera"
        f" {height_m:g} m above the road; it is {depth_mm:g} mm: take a shorter snow_accumulation_h or pictures: false"
        for label, scenario in grid.scenarios
        # a faulty scenario has been reported
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
            continue  # a faulty scenario has been reported
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
    return sample_grade(load_route(scene))


def _find_route_problems(grid: Grid, scenes: Scenes) -> list[str]:
    problems: dict[str, str] = {}
    limit = load("table of physical limits").road_grade
    for named in scenes:
        scene = named or grid.settings.scene
        route = load_route(scene)
        steepest = max(map(abs, sample_grade(route).rise))
        if problem := find_limit_problem("grade of the road", steepest, limit):
            problems[scene] = f"scene {scene}: {problem}: its z axis must point up, against gravity"
        for label, scenario in grid.scenarios:
            for problem in (
                find_route_problems(scenario, route.length, scene) if scenario.scene == named else ()
            ):
                problems.setdefault(problem, f"scenario {label}: {problem}")
    return list(problems.values())


def _find_sky_problems(grid: Grid, scenes: Scenes) -> list[str]:
    """Scenarios that name a sky over a scene whose light is not known, so that no other can be put on."""
    lit = {
        named: is_built_in(scene) or load_scene(scene).daylight is not None
        for named in scenes
        if (scene := named or grid.settings.scene)
    }
    return [
        f"scenario {label}: sky {scenario.sky} needs a scene that knows its own light, as the built-in streets do"
        for label, scenario in grid.scenarios
        if scenario.sky is not None and not lit[scenario.scene]
    ]
