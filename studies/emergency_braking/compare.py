"""``musync lab aeb``: emergency brakes against protocols in every weather, by the speed of the impact."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, islice, product
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from tasks.studies.label_ranges import PERCENTILES, label_ranges, sampled_friction
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.wet_friction import ANY_SPEED, compute_wet_share
from tasks.vehicle.parameters import Vehicle, compute_surface_response

RANGED = ("impact_speed_km_h", "min_ttc_s", "clearance_m", "avoided_km_h")
"""Figures that are given with their percentiles under the surface bounds."""
PICTURE = "picture"
"""The brake that reads the friction from a picture; it drives where it is named."""
LONGEST_S = 30.0
"""A drive in which nothing is decided by then ends [s]."""
ROAD = "street"
"""Street of the OpenSCENARIO files."""


def compare_brakes(
    *, vehicle: str = "bmw-320i", protocol: list[str] | None = None, weather: list[str] | None = None,
    brake: list[str] | None = None, policy: str | None = None, bounds: bool = True, out: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Drive every approach of the protocols in every weather with every brake.

    Parameters
    ----------
    vehicle : catalogue name or file of the car
    protocol, weather, brake : names of `emergency_braking.yaml`; None takes all, but of the brakes not ``picture``,
        for which each approach is drawn once. A protocol may also be an OpenSCENARIO file with one road user
    policy : ``module:function`` of a brake of the user's, as of `flows.driving.policy`, driven beside the others
    bounds : drive each again at percentiles of friction under the surface bounds (`tasks.studies.label_ranges`)
    out : folder for aeb.json, the page, and each approach as an OpenSCENARIO file

    Returns
    -------
    ``rows[]`` with protocol, approach, ``speed_km_h``, weather, brake, friction, ``friction_seen`` by ``picture``,
    ``collided``, ``impact_speed_km_h`` with its ``p05``, ``p50`` and ``p95``, ``min_ttc_s``, ``clearance_m`` and
    ``avoided_km_h`` with theirs (``clearance_m_p05``), and ``allowed_km_h``; ``summary[]`` by protocol, weather and
    brake; ``sources`` of the protocols; ``sha256`` of the network's weights and the policy's source.

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
    study, hashes = load("sensitivity study")[0], {name: one.source_sha256 for name, one in own.items()}
    if PICTURE in chosen["brake"]:
        from studies.emergency_braking.seeing import load_reader  # torch is slow to load

        reader = load_reader()
        hashes[PICTURE] = reader.sha256
    rows = []
    with progress_bar("weathers", len(chosen["weather"])) as advance:
        for name in chosen["weather"]:
            scenario = Scenario(**table.list_weathers()[name])
            state = surface_of(scenario, pavement)
            visual_range_m = find_visual_range(state, load_weather())
            sampled = sampled_friction(weather_of(scenario), pavement, study) if bounds else None
            for case, kind in product(cases, (*chosen["brake"], *own)):
                asked = replace(
                    scenario, initial_speed_km_h=case.scenario.initial_speed_km_h, hold_speed=True,
                    objects=case.scenario.objects,
                )  # fmt: skip
                found: dict[str, Any] = {"friction": round(state.friction, 4)}
                if kind in own:
                    drive = partial(_drive_policy, own[kind], case, asked, car, pavement)
                else:
                    seen = reader.look(asked, car, pavement) if kind == PICTURE else None
                    if seen is not None:
                        found["friction_seen"] = round(seen, 4)
                    drive = partial(_drive_brake, car, state, case, kind, table, visual_range_m, seen)
                found |= describe_outcome(drive(state.friction))
                if sampled is not None:
                    found |= find_bounds(sampled, drive)
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
        "sha256": hashes,
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
    kind: str, car: Vehicle, friction_at: Callable[[float], float], table: EmergencyBraking
) -> tuple[Trigger, BrakeLine]:
    """Return a brake of a kind for a car on a road.

    Parameters
    ----------
    kind : blind, friction, picture or driver
    car : that it brakes
    friction_at : speed [m/s] to the tyres' friction [1], as far as ``friction`` and ``picture`` know it
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


def find_bounds(sampled: NDArray[np.float64], drive: Callable[[float], Outcome]) -> dict[str, float | None]:
    """Return percentiles of the figures of an outcome under the surface bounds; those of the impact as ``p05``.

    Parameters
    ----------
    sampled : friction under the bounds, float64 [N] [1]
    drive : friction [1] to the outcome there
    """

    def measure(friction: float) -> dict[str, float]:
        found = describe_outcome(drive(friction))
        return {name: nan if found[name] is None else found[name] for name in RANGED}

    found = label_ranges(sampled, measure, PERCENTILES)
    return {
        name.removeprefix("impact_speed_km_h_"): round(value, 3) if np.isfinite(value) else None
        for name, value in found.items()
        if not name.startswith("surface_friction")
    }


def _drive_brake(
    car: Vehicle, state: SurfaceState, case: Case, kind: str, table: EmergencyBraking, visual_range_m: float,
    seen: float | None, friction: float,
) -> Outcome:  # fmt: skip
    """Drive an approach with a brake of the catalogue on a road of some friction [1]."""
    road = replace(state, friction=friction)
    friction_at = find_tyre_friction(car, road) if seen is None else lambda _: seen
    return drive_approach(car, road, case, *make_brake(kind, car, friction_at, table), table, visual_range_m)


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
    policy: Policy, case: Case, asked: Scenario, car: Vehicle, pavement: SurfaceParameters, friction: float
) -> Outcome:
    """Drive an approach with a user's brake on a road of some friction [1] until it has an outcome."""
    simulator = Simulator(asked, vehicle=car, surface=pavement, duration_s=LONGEST_S, camera=policy.camera)
    simulator.take_road(replace(simulator.state, friction=friction))
    overhang, _ = load("road user sizes")[EGO]
    track = case.follow(simulator.state.friction)

    def is_over(seen: Observation) -> bool:
        target = track.find(seen.time)
        met = seen.station + overhang >= target.station
        return met or seen.stands or (seen.speed <= target.speed and seen.time >= track.settles_at)

    drive_with(policy, simulator, f"{case.protocol}, {case.name}, {asked.weather}", is_over)
    (outcome,) = simulator.judge()
    return outcome


def _choose(
    table: EmergencyBraking, protocol: list[str] | None, weather: list[str] | None, brake: list[str] | None
) -> dict[str, list[str]]:
    brakes = list(type(table.brakes).model_fields)
    known = {
        "protocol": (protocol, list(table.protocols)),
        "weather": (weather, list(table.weathers)),
        "brake": (brake, [*brakes, PICTURE]),
    }
    problems = [
        f"--{name} {one}: there is none of this name; there are {', '.join(all_names)}"
        for name, (asked, all_names) in known.items()
        for one in asked or []
        if one not in all_names and not (name == "protocol" and one.endswith(".xosc"))
    ]
    if problems:
        raise InputError(problems)
    chosen = {name: asked or all_names for name, (asked, all_names) in known.items()}
    return chosen | {"brake": brake or brakes}
