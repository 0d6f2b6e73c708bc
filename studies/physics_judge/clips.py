"""Random clips of both modes within the physical limits, as a dataset stores them."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import find_entry, load
from catalogs.scenario import Scenario, find_scenario_problems
from catalogs.tyres import tyre_entries
from flows.making.clip import collect_motion_figures
from flows.making.driving import collect_surface_figures, simulate_drive
from studies.physics_judge.frozen_constants import make_constants
from studies.physics_judge.laws.constants import Constants
from tasks.render.camera import body_poses
from tasks.scene.route import Route, route_from_positions
from tasks.scene.route_shape import sample_grade
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import EFFECT_UNITS, PARAMETERS
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Mode

CARS = ("paper-reference", "bmw-m8", "multibody-staged", "multibody-grown")
TYRE = "pacejka-205-60r15"
LIKELY = {
    "drag_area": 0.7, "wind_speed": 5.0, "rolling_coefficient": 0.012, "rolling_speed": 2e-4, "ploughing": 15.0,
    "engine_torque": 60.0, "engine_power": 6.0, "engine_viscous": 1.0, "pad_drag": 20.0, "lag": 0.06, "dead_time": 0.04,
    "push_out": 0.05, "pressure_curve": 0.02, "fade": 0.05, "pad_speed": 0.004, "bias_pressure": 0.01,
    "abs_cutoff": 1.5, "slope_moment": 2.0, "radius_by_load": 1.5, "relaxation_length": 0.3, "load_sensitivity": 0.1,
    "tyre_heating": 0.2, "wet_speed": 0.005, "friction_speed": 0.002, "tread_stiffness": 20.0, "damper_asymmetry": 0.3,
    "coulomb_friction": 60.0, "progressive_rate": 1e6, "anti_dive": 0.2, "anti_lift": 0.2, "scrub_stiffness": 0.05,
    "aero_lift": 0.3, "aero_pitch": 0.1, "enveloping_length": 0.2, "contact_radius": 0.3, "force_tilt": 1.0,
    "tyre_damping": 100.0, "pitch_gain": 0.05,
}  # fmt: skip
"""Size of each effect that a random car may have [units of the table]."""
ROAD_CLASS = {
    "hump": (0.05, 0.12, 1.0, 5.0),
    "deep": (0.05, 0.3, 0.3, 1.5),
    "long": (0.1, 1.0, 5.0, 60.0),
    "extreme": (0.2, 1.0, 0.1, 1.0),
}
"""Least and largest height and length of each class of road feature [m]."""


@dataclass(frozen=True, kw_only=True)
class StudyClip:
    """One clip as a dataset stores it.

    Parameters
    ----------
    name : car, mode, road and weather in words
    ticks, frames : columns of the two tables
    facts : the clip's row
    constants : frozen car and pavement, as the judge reads them
    route : poses of the reference route
    rides : scenario, vehicle and mode, from which the clip can be made again
    """

    name: str
    ticks: dict[str, NDArray[Any]]
    frames: dict[str, NDArray[Any]]
    facts: dict[str, Any]
    constants: Constants
    route: Route
    rides: tuple[Scenario, Vehicle, Mode]


def draw_clip(draw: np.random.Generator) -> StudyClip:
    """Return a random clip.

    Parameters
    ----------
    draw : source of the numbers
    """
    mode: Mode = ("paper", "coupled")[int(draw.random() < 0.6)]
    while find_scenario_problems(scenario := _draw_scenario(draw)):
        pass
    vehicle = draw_vehicle(draw, mode)
    return make_clip(scenario, vehicle, mode, duration_s=round(draw.uniform(1.5, 6.0), 3))


def make_clip(scenario: Scenario, vehicle: Vehicle, mode: Mode, *, duration_s: float) -> StudyClip:
    """Return the clip that a generator makes of a scenario.

    Parameters
    ----------
    scenario : its controls
    vehicle : the car
    mode : paper or coupled
    duration_s : length [s]
    """
    pavement, steady = _read_pavement(mode), load("low-speed rule")
    route = make_route(scenario.initial_speed_km_h / 3.6 * duration_s + 30.0)
    state, ride = simulate_drive(scenario, vehicle, pavement, mode, duration_s, steady, sample_grade(route))
    ticks = ride.columns
    tick = np.arange(0, len(ticks["speed"]), 100)
    poses = body_poses(
        route, ticks["station"][tick], ticks["heave"][tick], ticks["pitch"][tick],
        cg_behind_front_axle=vehicle.cg_to_front_axle, cg_height=vehicle.cg_height,
    )  # fmt: skip
    figures = collect_surface_figures(state, ride)
    nothing = np.full(len(tick), np.nan)
    frames = {"frame": np.arange(len(tick)), "tick": tick, "T_world_rig": poses.reshape(-1, 16)}
    frames |= {"recovered_pitch": nothing, "recovered_progress": nothing}
    frames |= {name: column[tick] for name, column in ticks.items()}
    frames |= {name: np.full(len(tick), value) for name, value in figures.items()}
    facts = {key: np.nan if value is None else value for key, value in scenario.as_row().items()} | figures
    facts |= {"stop_time": ride.stop_time, "stopping_distance": ride.stopping_distance}
    facts |= {"static_pitch": ride.static_pitch, **collect_motion_figures(ticks)}
    name = f"{vehicle.name} {mode} {scenario.weather} {scenario.initial_speed_km_h:.0f} km/h"
    if scenario.hazard_height_m:
        name += f" {scenario.hazard_height_m:.2f} m over {scenario.hazard_length_m:.2f} m"
    return StudyClip(
        name=name, ticks=ticks, frames=frames, facts=facts, constants=_read_constants(vehicle, mode), route=route,
        rides=(scenario, vehicle, mode),
    )  # fmt: skip


def make_route(length: float) -> Route:
    """Return a route that winds, rises and falls.

    Parameters
    ----------
    length : at least [m]
    """
    x = np.arange(0.0, length * 1.05 + 10.0, 1.0)
    return route_from_positions(np.column_stack([x, 5.0 * np.sin(x / 60.0), 0.5 * np.sin(x / 40.0)]))


def _read_pavement(mode: Mode) -> SurfaceParameters:
    pavement: SurfaceParameters = load("surface", "dense-asphalt")
    return load("wet friction").apply(pavement) if mode == "coupled" else pavement


def _read_constants(vehicle: Vehicle, mode: Mode) -> Constants:
    car = {
        f.name: value for f in fields(vehicle) if isinstance(value := getattr(vehicle, f.name), float | int)
    }
    steady = load("low-speed rule")
    tyre = None if vehicle.tyre is None else tyre_entries(find_entry("tyre", TYRE).read_bytes())
    return make_constants(
        car, vehicle, _read_pavement(mode), mode=mode, ticks_per_frame=100.0, steady=steady, tyre=tyre
    )  # fmt: skip


def draw_vehicle(draw: np.random.Generator, mode: Mode) -> Vehicle:
    """Return a catalogue car, half of them calibrated otherwise, some on the Magic Formula, some with effects."""
    names = CARS if mode == "coupled" else CARS[:1]
    vehicle = load("vehicle", str(draw.choice(names)))
    if draw.random() < 0.5:
        kept = ("gravity", "slip_speed_floor", "stop_speed", "lock_speed", "name", "static_pitch")
        scaled = {
            f.name: getattr(vehicle, f.name) * float(draw.uniform(0.9, 1.1))
            for f in fields(vehicle) if f.name not in kept and isinstance(getattr(vehicle, f.name), float)
        }  # fmt: skip
        vehicle = replace(vehicle, **{k: v for k, v in scaled.items() if not k.startswith("abs_")})
    if draw.random() < 0.3:
        vehicle = replace(vehicle, tyre=load("tyre", TYRE))
    if mode == "coupled" and draw.random() < 0.2:
        vehicle = replace(vehicle, abs_build_rate=8.0, abs_release_rate=25.0)
    if mode == "coupled" and draw.random() < 0.6:
        some = [name for name in LIKELY if draw.random() < 0.15]
        found = {name: LIKELY[name] * float(draw.uniform(0.5, 1.5)) for name in some if name in EFFECT_UNITS}
        if "wet_speed" in found:
            found["wet_threshold"] = 8.0
        if "pad_speed" in found:
            found["pad_speed_reference"] = PARAMETERS["pad_speed_reference"].start
        vehicle = replace(vehicle, effects={**vehicle.effects, **found})
    return vehicle


def _draw_scenario(draw: np.random.Generator) -> Scenario:
    weather = str(draw.choice(["dry", "rain", "snow", "ice"]))
    rain = float(np.exp(draw.uniform(np.log(0.5), np.log(200.0))))
    fall = {"rain": rain, "snow": float(draw.uniform(0.2, 10.0))}.get(weather, 0.0)
    speed = float(np.exp(draw.uniform(np.log(10.0), np.log(160.0))))
    given: dict[str, Any] = {}
    if draw.random() < 0.85:
        by_time = draw.random() < 0.6
        onset = float(draw.uniform(0.0, 1.5))
        given = {
            "peak_pressure_mpa": float(draw.uniform(0.2, 12.0)),
            "ramp_s": float(draw.choice([0.0, 0.05, 0.2, 0.5])),
            "hold_s": None if draw.random() < 0.6 else float(draw.uniform(0.1, 1.0)),
            "release_s": float(draw.choice([0.0, 0.1, 0.5])),
            "brake_onset_s" if by_time else "brake_onset_m": onset if by_time else onset * speed / 3.6,
        }
    road = str(draw.choice(["flat", *ROAD_CLASS], p=[0.35, 0.2, 0.25, 0.1, 0.1]))
    if road != "flat":
        low, high, short, long = ROAD_CLASS[road]
        length = float(draw.uniform(short, long))
        given |= {
            "hazard_center_m": length / 2 + float(draw.uniform(0.0, 2.0)) * speed / 3.6,
            "hazard_length_m": length,
            "hazard_height_m": float(draw.uniform(low, high)) * (1.0 if draw.random() < 0.4 else -1.0),
        }
    return Scenario(
        weather=weather, precipitation_mm_h=fall,
        snow_accumulation_h=float(draw.uniform(0.2, 4.0)) if weather == "snow" else 0.0,
        initial_speed_km_h=speed, hold_speed=bool(draw.random() < 0.3), **given,
    )  # fmt: skip
