"""What the bends of a route ask of each clip's tyres, held against what its surface gives, before anything is made."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from catalogs.grids import Grid
from catalogs.scenario import find_scenario_problems
from catalogs.scenes import load_route
from catalogs.sentences import name_some
from catalogs.studies.ablation import cut_coupling
from flows.making.driving import simulate_drive, surface_of
from flows.making.grid_entries import GridEntries
from tasks.scene.route import Route
from tasks.scene.route_shape import find_lateral_demand, sample_curvature, sample_grade
from tasks.surface.road_profile import RoadGrade
from tasks.surface.weather import find_weather_problem

WARNED_SHARE = 0.5
"""Share of the grip that a bend may ask before a warning: beyond it the car's brake and the bend share one tyre [1]."""


@dataclass(frozen=True, kw_only=True)
class Bend:
    """Where a clip asks most of its tyres.

    Parameters
    ----------
    label : of the scenario
    station, speed : there [m, m/s]
    demand : v^2 x curvature [m/s2]
    available : surface friction times g [m/s2]
    """

    label: str
    station: float
    speed: float
    demand: float
    available: float


def find_bend_problems(grid: Grid, entries: GridEntries) -> list[str]:
    """Return a sentence for each clip that no tyre could keep on its route.

    Parameters
    ----------
    grid : whose entries and scene are sound
    entries : of the grid
    """
    return [
        f"scenario {bend.label}: the bend at station {bend.station:.0f} m asks {bend.demand:.2f} m/s2 at"
        f" {bend.speed * 3.6:.0f} km/h, and the road gives {bend.available:.2f} (surface friction times g): drive more"
        " slowly, brake before the bend or take a straighter scene"
        for bend in list_tight_bends(grid, entries)
        if bend.demand > bend.available
    ]


def warn_of_bends(grid: Grid, entries: GridEntries) -> str | None:
    """Return a sentence that names the clips whose bends ask more than half of the grip; None without any.

    Parameters
    ----------
    grid : whose entries and scene are sound
    entries : of the grid
    """
    bends = list(list_tight_bends(grid, entries))
    if not bends:
        return None
    worst = max(bends, key=lambda bend: bend.demand / bend.available)
    return (
        f"scenario {name_some([bend.label for bend in bends])} asks more than half of the grip in a bend:"
        f" {worst.label} {worst.demand:.2f} of {worst.available:.2f} m/s2 at station {worst.station:.0f} m; the model"
        " brakes with all of it (column lateral_demand)"
    )


def list_tight_bends(grid: Grid, entries: GridEntries) -> Iterator[Bend]:
    """Yield the clips whose bends ask more than `WARNED_SHARE` of the grip, in the order of the grid.

    A clip is driven only where the speed that it begins with, or gains downhill, could ask so much of the sharpest bend
    that it can reach: a grid without such clips costs nothing.

    Parameters
    ----------
    grid : whose entries and scene are sound
    entries : of the grid
    """
    settings = grid.settings
    vehicle, surface, steady = entries.vehicle, entries.surface, entries.steady
    roads: dict[str | None, tuple[Route, RoadGrade]] = {}
    for label, seen in grid.scenarios:
        if seen.scene not in roads:
            found = load_route(seen.scene or settings.scene)
            roads[seen.scene] = found, sample_grade(found)
        route, grade = roads[seen.scene]
        scenario = cut_coupling(seen, settings.variant)
        if find_weather_problem(scenario.weather) is not None or find_scenario_problems(scenario):
            continue
        available = surface_of(scenario, surface).friction * vehicle.gravity
        fastest = _bound_speed(route, scenario.initial_speed_km_h / 3.6, vehicle.gravity)
        if _bound_demand(route, fastest, settings.telemetry_s) <= WARNED_SHARE * available:
            continue
        _, ride = simulate_drive(
            scenario, vehicle, surface, settings.vehicle_mode, settings.telemetry_s, steady, grade
        )
        demand = find_lateral_demand(route, ride.columns["station"], ride.columns["speed"])
        tick = int(np.argmax(demand))
        if demand[tick] > WARNED_SHARE * available:
            yield Bend(
                label=label,
                station=float(ride.columns["station"][tick]),
                speed=float(ride.columns["speed"][tick]),
                demand=float(demand[tick]),
                available=available,
            )


def _bound_speed(route: Route, initial_speed: float, gravity: float) -> float:
    """Return a speed [m/s] that a car without an engine does not exceed: the route's fall is all that it can gain."""
    height = route.T_world_rig[:, 2, 3]
    return float(np.sqrt(initial_speed**2 + 2 * gravity * max(float(height[0] - height.min()), 0.0)))


def _bound_demand(route: Route, fastest: float, duration_s: float) -> float:
    """Return what the sharpest bend within reach asks at most [m/s2]."""
    station, curvature = sample_curvature(route)
    within = station <= fastest * duration_s
    return float(fastest**2 * np.abs(curvature[within]).max())
