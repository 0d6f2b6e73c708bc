"""From a scenario to the vehicle's motion: what the weather, the driver and the road are to the model."""

from dataclasses import replace
from math import inf

import numpy as np

from catalogs.scenario import Scenario
from tasks.render.weather.controls import air_controls
from tasks.render.weather.named_sky import NamedSky
from tasks.render.weather.parameters import WeatherParameters
from tasks.scene.route import Route
from tasks.scene.route_shape import find_lateral_demand
from tasks.surface.road_profile import LEVEL_ROAD, RoadGrade, RoadHazard
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Controls, Mode, Rollout, simulate_scenario


def simulate_drive(
    scenario: Scenario,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    mode: Mode,
    duration_s: float,
    steady: SteadyStop | None = None,
    grade: RoadGrade = LEVEL_ROAD,
    friction: float | None = None,
) -> tuple[SurfaceState, Rollout]:
    """Simulate a scenario: weather to surface state to motion; a friction that is given replaces the weather's [1]."""
    state = surface_of(scenario, surface)
    if friction is not None:
        state = replace(state, friction=friction)
    ride = simulate_scenario(
        vehicle, state, controls_of(scenario), hazard_of(scenario), mode=mode, duration_s=duration_s, steady=steady,
        grade=grade,
    )  # fmt: skip
    return state, ride


def surface_of(scenario: Scenario, surface: SurfaceParameters) -> SurfaceState:
    """Return the road surface that the weather of the scenario makes."""
    return surface_state(weather_of(scenario), surface)


def collect_surface_figures(state: SurfaceState, ride: Rollout) -> dict[str, float]:
    """Return what tables and receipts record of the surface that is seen, and of the friction that is driven on."""
    return collect_surface_depths(state) | {
        "surface_friction": ride.surface_friction,
        "tyre_peak": ride.tyre_peak,
    }


def collect_surface_depths(state: SurfaceState) -> dict[str, float]:
    """Return what lies on the road, of which the picture shows every part."""
    return {
        "film_depth_mm": state.film_depth_mm,
        "snow_depth_mm": state.snow_depth_mm,
        "snow_coverage": state.snow_coverage,
    }


def peak_lateral_demand(ride: Rollout, route: Route) -> float:
    """Return the most that the bends of the route ask of the car [m/s2]."""
    demand = find_lateral_demand(route, ride.columns["station"], ride.columns["speed"])
    return float(np.nanmax(demand, initial=0.0))


def collect_ranged_figures(ride: Rollout) -> dict[str, float]:
    """Return the figures of a drive that every dataset gives with their percentiles."""
    return {"stopping_distance": ride.stopping_distance, "peak_pitch": float(ride.columns["pitch"].max())}


def weather_of(scenario: Scenario) -> Weather:
    """Return the weather of the scenario."""
    return Weather(
        kind=scenario.weather,
        precipitation_mm_h=scenario.precipitation_mm_h,
        snow_accumulation_h=scenario.snow_accumulation_h,
        falling=scenario.falling,
        visual_range_m=scenario.visual_range_m or inf,
    )


def find_visual_range(state: SurfaceState, weather: WeatherParameters) -> float:
    """Return the meteorological optical range of the air over a road: of fog or haze, and of what falls [m].

    Parameters
    ----------
    state : of the road, and what falls on it
    weather : numbers of the catalogue
    """
    still = min(state.visual_range_m, weather.air.haze_visual_range_m)
    return air_controls(state.kind, state.precipitation_mm_h, weather, still).visual_range_m


def sky_of(scenario: Scenario) -> NamedSky:
    """Return what the scenario says of the sky."""
    return NamedSky(
        kind=scenario.sky,
        sun_azimuth_deg=scenario.sun_azimuth_deg,
        sun_elevation_deg=scenario.sun_elevation_deg,
    )


def controls_of(scenario: Scenario) -> Controls:
    """Return the driver's controls in the scenario."""
    return Controls(
        initial_speed=scenario.initial_speed_km_h / 3.6,
        brake=BrakeCommand(
            peak_pressure_mpa=scenario.peak_pressure_mpa,
            ramp_s=scenario.ramp_s,
            hold_s=scenario.hold_s,
            release_s=scenario.release_s,
            onset_s=scenario.brake_onset_s,
            onset_station_m=scenario.brake_onset_m,
        ),
        hold_speed_until_brake=scenario.hold_speed,
    )


def hazard_of(scenario: Scenario) -> RoadHazard:
    """The scenario's road feature."""
    return RoadHazard(
        center_m=scenario.hazard_center_m,
        length_m=scenario.hazard_length_m,
        height_m=scenario.hazard_height_m,
    )
