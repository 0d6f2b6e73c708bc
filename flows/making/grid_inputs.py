"""The catalogue files and the scene that a grid uses: found, read, and checked together with the grid."""

from collections.abc import Callable, Collection, Mapping, Set
from functools import partial
from pathlib import Path
from typing import Any

from catalogs.cameras import load_camera
from catalogs.entries import find_entry
from catalogs.gates import GATES
from catalogs.grids import Grid, GridFile
from catalogs.hazard_markings import load_marking
from catalogs.low_speed import LOW_SPEED, NO_LOW_SPEED_RULE, is_rule_applied, load_low_speed
from catalogs.physical_limits import find_limit_problem, load_physical_limits
from catalogs.road_grade import ROAD_GRADE, write_road_grade
from catalogs.scenario import find_range_problems, find_route_problems, find_scenario_problems
from catalogs.scenes import load_scene, scene_identity
from catalogs.sentences import cap_problems
from catalogs.studies import SENSITIVITY
from catalogs.studies.ablation import ABLATION, cut_coupling, load_families
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle, vehicle_content, vehicle_tyre_source
from catalogs.weather.grip import FOLDER as WEATHER_FOLDER
from flows.making.bends import find_bend_problems
from flows.making.driving import hazard_of, surface_of
from flows.making.memory import find_memory_problems
from flows.making.places import remember_place
from flows.making.traced import read_trace_inputs
from tasks.errors import InputError
from tasks.render.sensor import Sensor
from tasks.render.weather.snow.layer import HIGHEST_LUMP
from tasks.scene.route_shape import sample_grade
from tasks.surface.road_profile import RoadGrade
from tasks.surface.weather import WEATHERS, find_weather_problem
from tasks.vehicle.strut_travel import compute_strut_travel

LOADERS: Mapping[str, Callable[[Path], Any]] = {
    "vehicle.yaml": load_vehicle,
    "surface.yaml": load_surface,
    "camera.yaml": load_camera,
    "hazard_marking.yaml": load_marking,
    "low_speed.yaml": load_low_speed,
    "ablation.yaml": load_families,
    NO_LOW_SPEED_RULE.name: is_rule_applied,
}
"""Loaders that check the catalogue entries that a user may bring."""
READERS: Mapping[str, Callable[[Path], bytes]] = {"vehicle.yaml": vehicle_content}
"""Entries that need other files: a dataset keeps these whole, and of any other the file's bytes."""
OWN_ENTRIES = ("vehicle", "surface", "camera", "hazard_marking")
"""Settings that name a catalogue entry, which may be a file of the user's."""


def input_sources(settings: GridFile) -> dict[str, Callable[[], Path]]:
    """Return the catalogue files that a grid can use, every kind of weather among them: name under ``inputs/`` to the
    function that finds it."""
    marking = settings.hazard_marking
    weather = {f"weather/{path.name}": path for path in sorted(WEATHER_FOLDER.glob("*.yaml"))}
    return {
        "vehicle.yaml": partial(find_entry, "vehicle", settings.vehicle),
        "surface.yaml": partial(find_entry, "surface", settings.surface),
        "camera.yaml": partial(find_entry, "camera", settings.camera),
        "gates.yaml": lambda: GATES,
        "study.yaml": lambda: SENSITIVITY,
        **{name: partial(Path, path) for name, path in weather.items()},
        **(
            {} if marking is None else {"hazard_marking.yaml": partial(find_entry, "hazard marking", marking)}
        ),
        **({"low_speed.yaml": lambda: LOW_SPEED} if settings.keeps_stops_steady else {}),
        **({"ablation.yaml": lambda: ABLATION} if settings.variant == "fixed-mu" else {}),
        **(
            {NO_LOW_SPEED_RULE.name: lambda: NO_LOW_SPEED_RULE}
            if settings.variant == "no-low-speed-rule"
            else {}
        ),
        **({} if (tyre := _tyre_behind(settings)) is None else {tyre.name: partial(Path, tyre)}),
    }


def _tyre_behind(settings: GridFile) -> Path | None:
    """The tyre's file; None where there is none, or where the vehicle is faulty, which its own lookup tells."""
    try:
        return vehicle_tyre_source(settings.vehicle)
    except InputError:
        return None


def find_private_entries(settings: GridFile) -> list[str]:
    """Return a sentence for each catalogue file whose path is not recorded, so that a record cannot lead to it."""
    return [
        f"{name} must be a name of the catalogue or a path below the working folder, which can be recorded; it is"
        f" {value}: copy the file there and name it so"
        for name in OWN_ENTRIES
        if (value := getattr(settings, name)) is not None and recorded_reference(value) != value
    ]


def recorded_settings(settings: GridFile) -> GridFile:
    """The settings as a dataset records them: with files by their name alone where their path is a private matter.

    Parameters
    ----------
    settings : as asked for
    """
    references = {
        name: recorded_reference(value)
        for name in ("scene", *OWN_ENTRIES)
        if (value := getattr(settings, name)) is not None
    }
    return settings.model_copy(update=references)


def recorded_reference(reference: str) -> str:
    """A catalogue name, or a path below the folder of the run, as it is; of any other path the last part."""
    path = Path(reference)
    return path.name if path.is_absolute() or path.parts[:1] == ("~",) or ".." in path.parts else reference


def read_grid_inputs(grid: Grid, tick_rate_hz: int) -> tuple[dict[str, bytes], dict[str, str], list[str]]:
    """Return the catalogue files and the scene of a grid, and the problems of these and of the grid with them.

    Parameters
    ----------
    grid : read from its file
    tick_rate_hz : of the telemetry [Hz]

    Returns
    -------
    Name under ``inputs/`` to the file's bytes; name and hash of the scene; one sentence for each problem.
    """
    scenarios = [scenario for _, scenario in grid.scenarios]
    driven = [cut_coupling(scenario, grid.settings.variant) for scenario in scenarios]
    weathers = {scenario.weather for scenario in (*scenarios, *driven)}
    inputs, scene, problems = _read_entries(grid.settings, weathers)
    if not problems:
        problems += _find_weather_problems(grid.settings, weathers)
        problems += _find_buried_cameras(grid)
    sound = not problems
    if scene:
        problems += _find_route_problems(grid)
        if grid.poses is None and not (grade := grade_of(grid.settings.scene)).is_level:
            inputs[ROAD_GRADE] = write_road_grade(grade, scene["name"])
    if sound:
        problems += cap_problems(_find_feature_problems(grid))
    if sound and grid.poses is None:
        problems += cap_problems(find_bend_problems(grid))
    if grid.poses is not None:
        traces, found = read_trace_inputs(grid, grid.poses)
        inputs, problems = inputs | traces, problems + found
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
    return inputs, scene, problems + _find_camera_problems(grid.settings, tick_rate_hz)


def _read_entries(
    settings: GridFile, weathers: Collection[str]
) -> tuple[dict[str, bytes], dict[str, str], list[str]]:
    """Return the catalogue files that a grid names or whose weather it has, its scene, and their problems."""
    inputs: dict[str, bytes] = {}
    scene: dict[str, str] = {}
    problems: list[str] = []
    needed = {row.tyre_family for kind in weathers if (row := WEATHERS.get(kind))} | set(weathers)
    unasked = {f"weather/{kind}.yaml" for kind in WEATHERS if kind not in needed}
    for name, lookup in input_sources(settings).items():
        if name in unasked:
            continue
        try:
            source = lookup()
            LOADERS.get(name, Path.stat)(source)
            inputs[name] = READERS.get(name, Path.read_bytes)(source)
        except InputError as error:
            problems += error.problems
    try:
        scene = {"name": recorded_reference(settings.scene), "sha256": scene_identity(settings.scene)}
        remember_place(scene["sha256"], settings.scene)
    except InputError as error:
        problems += error.problems
    return inputs, scene, problems


def _find_weather_problems(settings: GridFile, weathers: Set[str]) -> list[str]:
    """Kinds of weather in which the vehicle has no tyres."""
    vehicle = load_vehicle(settings.vehicle)
    problems: list[str] = []
    for kind in sorted(weathers & WEATHERS.keys()):
        try:
            vehicle.find_tyre_family(kind)
        except InputError as error:
            problems += error.problems
    return problems


def _find_buried_cameras(grid: Grid) -> list[str]:
    """Scenarios in whose pictures the camera would look out of the snow."""
    if not grid.settings.pictures:
        return []
    surface, camera = load_surface(grid.settings.surface), load_camera(grid.settings.camera)
    height_m = float(camera.T_rig_camera[2, 3])
    deepest_mm = 1e3 * height_m / HIGHEST_LUMP
    return [
        f"scenario {label}: snow must be less than {deepest_mm:g} mm deep in a picture: its lumps reach the camera"
        f" {height_m:g} m above the road; it is {depth_mm:g} mm: take a shorter snow_accumulation_h or pictures: false"
        for label, scenario in grid.scenarios
        # a faulty scenario has been told of
        if find_weather_problem(scenario.weather) is None
        and not find_range_problems(scenario)
        and (depth_mm := surface_of(scenario, surface).snow_depth_mm) >= deepest_mm
    ]


def _find_camera_problems(settings: GridFile, tick_rate_hz: int) -> list[str]:
    """List settings that exceed the camera or the memory of this machine; a faulty camera is reported elsewhere."""
    try:
        camera = load_camera(settings.camera)
    except InputError:
        return []
    ticks = round(settings.telemetry_s * tick_rate_hz) + 1
    problems = find_memory_problems(settings, camera, ticks)
    if settings.composition == "linear" or (camera.plain and camera.sensor == Sensor()):
        return problems
    return [
        *problems,
        f"composition: paper is one of finished 8-bit pictures; {camera.name} has a lens, a shutter or a sensor that"
        " needs linear light: take a plain camera or composition: linear",
    ]


def _find_feature_problems(grid: Grid) -> list[str]:
    """Road features that move a strut of the vehicle beyond its stops, which the model does not have."""
    vehicle, limit = load_vehicle(grid.settings.vehicle), load_physical_limits().strut_travel
    problems: dict[str, str] = {}
    for label, scenario in grid.scenarios:
        if scenario.hazard_height_m == 0 or find_scenario_problems(scenario):
            continue  # a faulty scenario has been told of
        travel = compute_strut_travel(vehicle, hazard_of(scenario), scenario.initial_speed_km_h / 3.6)
        rule = (
            f"strut travel on the road feature of {scenario.hazard_length_m:g} x {scenario.hazard_height_m:g} m at"
            f" {scenario.initial_speed_km_h:g} km/h"
        )
        if problem := find_limit_problem(rule, travel, limit):
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
    if problem := find_limit_problem("grade of the road", steepest, load_physical_limits().road_grade):
        problems["grade"] = (
            f"scene {grid.settings.scene}: {problem}: its z axis must point up, against gravity"
        )
    for label, scenario in grid.scenarios:
        for problem in find_route_problems(scenario, route.length, grid.settings.scene):
            problems.setdefault(problem, f"scenario {label}: {problem}")
    return list(problems.values())
