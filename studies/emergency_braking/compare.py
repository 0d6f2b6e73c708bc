"""``musync lab aeb``: emergency brakes against protocols in every weather, by the speed of the impact."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, islice, product
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.entries import load
from catalogs.road_users import EGO
from catalogs.scenario import Scenario
from catalogs.scenes.opendrive import find_street, format_opendrive
from catalogs.weather.look import load_weather
from flows.driving.policy import Policy, drive_with, load_policy
from flows.driving.simulator import Observation, Simulator
from flows.making.driving import find_visual_range, surface_of, weather_of
from flows.running.progress import progress_bar
from flows.store.outputs import Outputs
from studies.emergency_braking.brakes import (
    Approach,
    BlindTrigger,
    BrakeLine,
    DriverTrigger,
    FrictionTrigger,
    Trigger,
)
from studies.emergency_braking.cases import Case, list_cases
from studies.emergency_braking.openscenario import format_openscenario, read_openscenario
from studies.emergency_braking.page import draw_page
from studies.emergency_braking.table import EmergencyBraking, load_table
from tasks.driving.outcome import (
    TICK_S,
    Outcome,
    describe_outcome,
    find_unbraked_impact,
    judge_approach,
)
from tasks.driving.stepped import DriveSettings, SteppedDrive
from tasks.driving.targets import see_targets
from tasks.errors import InputError
from tasks.studies.label_ranges import sampled_friction
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.wet_friction import ANY_SPEED, compute_wet_share
from tasks.vehicle.parameters import Vehicle, compute_surface_response

PERCENTILES = (5, 50, 95)
LONGEST_S = 30.0
"""A drive in which nothing is decided by then ends [s]."""
ROAD = "street"
"""Street of the OpenSCENARIO files."""


def compare_brakes(
    *, vehicle: str = "bmw-320i", protocol: list[str] | None = None, weather: list[str] | None = None,
    brake: list[str] | None = None, policy: str | None = None, bounds: bool = True, out: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Drive every approach of the protocols in every weather with every brake, without pictures.

    Parameters
    ----------
    vehicle : catalogue name or file of the car
    protocol, weather, brake : names of `emergency_braking.yaml`; None takes all. A protocol may also be an
        OpenSCENARIO file with one road user
    policy : ``module:function`` of a brake of the user's, as of `flows.driving.policy`, driven beside the others
    bounds : drive each of the catalogue's at the 5th, 50th and 95th percentile of friction under the surface bounds too
    out : folder for aeb.json, the page, and each approach as an OpenSCENARIO file

    Returns
    -------
    ``rows[]`` with protocol, approach, ``speed_km_h``, weather, brake, friction, ``collided``,
    ``impact_speed_km_h`` with its ``p05``, ``p50`` and ``p95``, ``min_ttc_s``, ``clearance_m``, ``avoided_km_h`` and
    ``allowed_km_h``;
    ``summary[]`` by protocol, weather and brake; ``sources`` of the protocols.

    Raises
    ------
    InputError
        For names that do not exist, or a policy that fails.
    """
    table = load_table()
    chosen = _choose(table, protocol, weather, brake)
    own = {} if policy is None else {policy: load_policy(policy)}
    cases = [case for name in chosen["protocol"] for case in _open_protocol(table, name)]
    scenarios = {f"openscenario/{_name_file(case)}": case for case in cases}
    results = Outputs(out, "lab aeb", "aeb.json", "aeb.html", *scenarios, f"openscenario/{ROAD}.xodr")
    car, pavement = load("vehicle", vehicle), load("wet friction").apply(load("surface", "dense-asphalt"))
    study = load("sensitivity study")[0]
    rows = []
    with progress_bar("weathers", len(chosen["weather"])) as advance:
        for name in chosen["weather"]:
            scenario = Scenario(**table.list_weathers()[name])
            state = surface_of(scenario, pavement)
            visual_range_m = find_visual_range(state, load_weather())
            frictions = np.percentile(sampled_friction(weather_of(scenario), pavement, study), PERCENTILES)
            for case, kind in product(cases, (*chosen["brake"], *own)):
                if kind in own:
                    outcome = _drive_policy(own[kind], case, scenario, car, pavement)
                    found = {"friction": round(state.friction, 4), **describe_outcome(outcome)}
                else:
                    spread = frictions.tolist() if bounds else []
                    found = _drive_case(car, state, case, kind, table, spread, visual_range_m)
                rows.append(
                    {
                        "protocol": case.protocol,
                        "approach": case.name,
                        "speed_km_h": round(case.speed * 3.6, 6),
                        "weather": name,
                        "brake": kind,
                    }
                    | found
                    | {"allowed_km_h": case.allowed_km_h}
                )
            advance(name)
    result = {
        "vehicle": car.name,
        "rows": rows,
        "summary": summarise(rows),
        "sources": {
            Path(name).stem: table.protocols[name].source if name in table.protocols else name
            for name in chosen["protocol"]
        },
    }
    _write_scenarios(results, scenarios, car)
    results.write_json("aeb.json", result)
    results.write("aeb.html", draw_page(result))
    return result


def drive_approach(
    car: Vehicle, state: SurfaceState, case: Case, trigger: Trigger, line: BrakeLine, table: EmergencyBraking,
    visual_range_m: float = inf,
) -> Outcome:  # fmt: skip
    """Drive an approach to its end and return the outcome.

    Parameters
    ----------
    car, state : the car and the road
    case : the approach
    trigger, line : when the brake is put on, and the pressure behind
    table : how often the brake looks
    visual_range_m : beyond which the air hides the target [m]
    """
    (overhang, width), track = load("road user sizes")[EGO], case.follow(state.friction)
    rate_hz = table.rate_hz.value
    drive = SteppedDrive(
        car, state,
        DriveSettings(initial_speed=case.speed, duration_s=LONGEST_S, rate_hz=rate_hz, hold_speed=True),
    )  # fmt: skip
    step = 1.0 / rate_hz
    looks = track.follow(np.arange(drive.steps, dtype=np.float64) * step)
    # until a brake acts the speed is held, and the car is where it would be: those steps are driven at once
    for held, target in enumerate(looks):
        bumper = overhang + case.speed * held * step
        unbraked = bumper >= target.station
        if unbraked or trigger.demands(
            Approach(
                time=held * step,
                bumper=bumper,
                speed=case.speed,
                width=width,
                targets=see_targets((target,), bumper, visual_range_m),
            )
        ):
            break
    drive.advance(0.0, max(held + unbraked, 1))
    line.demand(held * step)
    for seen in () if unbraked else islice(chain((target,), looks), drive.step_count - held, None):
        time, speed = drive.time, drive.read("speed")
        met = drive.read("station") + overhang >= seen.station
        if met or drive.stop_time <= time or (speed <= seen.speed and time >= track.settles_at):
            break
        # a step holds one pressure: that of its middle
        drive.advance(line.pressure_at(time + 0.5 * step))
    station, speeds, pressure = (
        drive.read_column(name) for name in ("station", "speed", "brake_pressure_mpa")
    )
    path = track.locate(TICK_S * np.arange(len(station), dtype=np.float64))
    return judge_approach(
        station, speeds, pressure, path, overhang=overhang, width=width,
        unbraked_impact=find_unbraked_impact(case.speed, overhang, track, width),
    )  # fmt: skip


def make_brake(
    kind: str, car: Vehicle, state: SurfaceState, table: EmergencyBraking
) -> tuple[Trigger, BrakeLine]:
    """Return a brake of a kind for a car on a road.

    Parameters
    ----------
    kind : blind, friction or driver
    car, state : the car and the road, of which only the one that knows friction is told
    table : numbers of the brakes
    """
    brakes, line = table.brakes, table.brake_line
    lock_mpa = car.mass * car.gravity * car.wheel_radius / car.brake_gain
    full = line.full_over_lock.value
    if kind == "driver":
        wanted = brakes.driver.deceleration.value
        return (
            DriverTrigger(looming=brakes.driver.looming_rad_s.value, reaction=brakes.driver.reaction_s.value),
            BrakeLine(full_mpa=wanted * lock_mpa, delay=0.0, build_up=brakes.driver.build_up_s.value),
        )
    pipes = BrakeLine(full_mpa=full * lock_mpa, delay=line.delay_s.value, build_up=line.build_up_s.value)
    if kind == "blind":
        return BlindTrigger(time_to_collision=brakes.blind.time_to_collision_s.value), pipes
    friction_at = find_tyre_friction(car, state)
    rise = line.build_up_s.value * min(friction_at(0.0) / full, 1.0)
    trigger = FrictionTrigger(
        friction_at, gravity=car.gravity, share=brakes.friction.share.value, margin=brakes.friction.margin_m.value,
        lost=line.delay_s.value + 0.5 * rise,
    )  # fmt: skip
    return trigger, pipes


def find_tyre_friction(car: Vehicle, state: SurfaceState) -> Callable[[float], float]:
    """Return the function of the speed [m/s] that gives the peak friction of the car's tyres on a road [1]."""
    peak, grip = compute_surface_response(car, state.kind, state.friction).tyre.peak, state.grip
    if grip == ANY_SPEED:
        return lambda speed: peak
    return lambda speed: peak * compute_wet_share(speed, grip) / grip.reference


def summarise(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return for each protocol, weather and brake how many approaches collide, and the mean and largest impact.

    Parameters
    ----------
    rows : of `compare_brakes`
    """
    found: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        found.setdefault((row["protocol"], row["weather"], row["brake"]), []).append(row)
    return [
        {
            "protocol": protocol, "weather": weather, "brake": brake, "approaches": len(some),
            "collided": sum(row["collided"] for row in some),
            "mean_impact_km_h": round(float(np.mean([row["impact_speed_km_h"] for row in some])), 2),
            "largest_impact_km_h": max(row["impact_speed_km_h"] for row in some),
            "beyond_rule": sum(
                row["allowed_km_h"] is not None and row["impact_speed_km_h"] > row["allowed_km_h"] for row in some
            ),
        }
        for (protocol, weather, brake), some in found.items()
    ]  # fmt: skip


def _drive_case(
    car: Vehicle,
    state: SurfaceState,
    case: Case,
    kind: str,
    table: EmergencyBraking,
    frictions: Sequence[float],
    visual_range_m: float,
) -> dict[str, Any]:
    def drive_on(road: SurfaceState) -> Outcome:
        return drive_approach(car, road, case, *make_brake(kind, car, road, table), table, visual_range_m)

    outcome = drive_on(state)
    spread = [drive_on(replace(state, friction=float(mu))).impact_speed * 3.6 for mu in frictions]
    ends = sorted(spread) if spread else []
    return {
        "friction": round(state.friction, 4),
        **describe_outcome(outcome),
        **{f"p{p:02d}": round(v, 2) for p, v in zip(PERCENTILES, ends, strict=False)},
    }


def _open_protocol(table: EmergencyBraking, name: str) -> list[Case]:
    if name in table.protocols:
        return list(list_cases(name, table.protocols[name]))
    scenario = read_openscenario(Path(name))
    if len(scenario.objects) != 1:
        raise InputError(f"{name}: must have one road user; it has {len(scenario.objects)}")
    return [Case(protocol=Path(name).stem, name=f"{scenario.initial_speed_km_h:g} km/h", scenario=scenario)]


def _name_file(case: Case) -> str:
    return re.sub(r"[^\w.-]+", "-", f"{case.protocol}-{case.name.replace('/', '')}") + ".xosc"


def _write_scenarios(results: Outputs, scenarios: Mapping[str, Case], car: Vehicle) -> None:
    street = find_street(ROAD)
    results.write(f"openscenario/{ROAD}.xodr", format_opendrive(street, ROAD))
    for file, case in scenarios.items():
        results.write(
            file,
            format_openscenario(
                case.scenario, street, name=f"{case.protocol}, {case.name}", road_file=f"{ROAD}.xodr",
                wheelbase=car.wheelbase,
            ),
        )  # fmt: skip


def _drive_policy(
    policy: Policy, case: Case, weather: Scenario, car: Vehicle, pavement: SurfaceParameters
) -> Outcome:
    """Drive an approach with a user's brake until it has an outcome."""
    asked = replace(
        weather, initial_speed_km_h=case.scenario.initial_speed_km_h, hold_speed=True, objects=case.scenario.objects
    )  # fmt: skip
    simulator = Simulator(asked, vehicle=car, surface=pavement, duration_s=LONGEST_S)
    overhang, _ = load("road user sizes")[EGO]
    track = case.follow(simulator.state.friction)

    def is_over(seen: Observation) -> bool:
        target = track.find(seen.time)
        met = seen.station + overhang >= target.station
        return met or seen.stands or (seen.speed <= target.speed and seen.time >= track.settles_at)

    drive_with(policy, simulator, f"{case.protocol}, {case.name}, {weather.weather}", is_over)
    (outcome,) = simulator.judge()
    return outcome


def _choose(
    table: EmergencyBraking, protocol: list[str] | None, weather: list[str] | None, brake: list[str] | None
) -> dict[str, list[str]]:
    known = {
        "protocol": (protocol, list(table.protocols)),
        "weather": (weather, list(table.weathers)),
        "brake": (brake, list(type(table.brakes).model_fields)),
    }
    problems = [
        f"--{name} {one}: there is none of this name; there are {', '.join(all_names)}"
        for name, (asked, all_names) in known.items()
        for one in asked or []
        if one not in all_names and not (name == "protocol" and one.endswith(".xosc"))
    ]
    if problems:
        raise InputError(problems)
    return {name: asked or all_names for name, (asked, all_names) in known.items()}
