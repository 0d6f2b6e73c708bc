"""Campaign folders of the car: session and run offsets, disturbances, every run driven and written."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from numpy.typing import NDArray

from studies.double_track.car import SENSORS, Surroundings, build_car
from studies.double_track.declared import find_surface, read_declared, values_of
from studies.double_track.draws import draw_coloured, draw_smooth, keyed_generator
from studies.double_track.drive import drive_run, start_state
from studies.double_track.effects import Truth
from studies.double_track.instruments import Channels, add_noise, read_instruments
from studies.double_track.motion import PORTS, VARIABLES, Inputs

INTERVAL = 0.01
"""Between the samples [s]."""
ONSET, RAMP, DURATION, DISC = 1.0, 0.3, 6.0, 20.0
"""Of a run whose plan says nothing else [s, s, s, K]."""
LIFT = 0.2
"""In which a driver lifts the throttle [s]."""
PULSE_RAMP = 0.06
"""In which the pressure falls and rises again, once a second [s]."""
SESSION = {
    "pressure_gain": "pressure_gain", "mass": "mass", "pitch_gain": "pitch_gain", "wheel_radius": "wheel_radius",
    "suspension_damping": "damping", "suspension_stiffness": "stiffness",
}  # fmt: skip
"""Tolerance of a session, and the change of the car that it stands for."""


@dataclass(frozen=True, kw_only=True)
class MeasuredRun:
    """A run as it is written: its row of runs.csv and its columns."""

    row: dict[str, Any]
    columns: Channels


def collect_tolerances(design: str) -> dict[str, float]:
    """Standard deviations of a session's offsets, with the grade, by tolerance.

    Parameters
    ----------
    design : of the campaign; its own come before those of all designs
    """
    designs = read_declared("designs")
    own = designs["designs"][design].get("tolerances_1sigma", {})
    return values_of(designs["tolerances_1sigma"] | own)


def draw_session(seed: int, name: str, design: str, share: float = 1.0) -> dict[str, float]:
    """Offsets of a session from the declared tolerances, with the grade, by tolerance.

    Parameters
    ----------
    seed, name, design : of the campaign
    share : of the tolerances; 0 for a car and a road that are as declared [1]
    """
    rng = keyed_generator(seed, f"{name} {design}", "session")
    return {
        key: share * sigma * float(rng.standard_normal()) for key, sigma in collect_tolerances(design).items()
    }


def brake_trace(plan: Mapping[str, Any]) -> NDArray[np.float64]:
    """Pressure of the driver over a run, float64 [N] [MPa].

    Parameters
    ----------
    plan : of the run
    """
    time = np.arange(round(plan.get("duration", DURATION) / INTERVAL)) * INTERVAL
    onset = plan.get("onset", ONSET)
    pressure = plan.get("pressure", 0.0) * np.clip((time - onset) / plan.get("ramp", RAMP), 0.0, 1.0)
    if "pulses" in plan:
        phase = np.where(time > onset + 0.5, (time - onset - 0.5) % 1.0, 1.0)
        down = np.clip(np.minimum(phase, 0.55 - phase) / PULSE_RAMP, 0.0, 1.0)
        pressure = pressure * (1.0 - (1.0 - plan["pulses"]) * down)
    trace: NDArray[np.float64] = pressure
    return trace


def drive_trace(plan: Mapping[str, Any], record: NDArray[np.void], speed: float) -> NDArray[np.float64]:
    """Torque of the engine at the front wheels, float64 [N] [N m].

    A driver who holds the speed or gains some gives what the car then needs, and lifts before he brakes. Zero where
    the plan names no driver: the car coasts.

    Parameters
    ----------
    plan : of the run; `driver` says how fast he gains speed [m/s2] and how long before the brake he lifts [s]
    record : the car
    speed : at the start [m/s]
    """
    time = np.arange(round(plan.get("duration", DURATION) / INTERVAL)) * INTERVAL
    if "driver" not in plan:
        return np.zeros(len(time))
    gains, lifts = plan["driver"]
    car = record[0]
    weight = car["gravity"] * (car["body_mass"] + car["wheel_mass"].sum())
    air = speed + car["direction"] * car["wind_speed"]
    force = 0.5 * car["air_density"] * car["drag_area"] * air * abs(air)
    force += weight * (
        car["rolling_coefficient"] + car["rolling_speed"] * speed + car["direction"] * car["grade"]
    )
    force += weight / car["gravity"] * (car["coast"] + gains)
    torque = force * car["radius"] + car["pad_drag"] + car["engine_torque"]
    torque += car["engine_viscous"] * speed / car["radius"]
    lifted = plan.get("onset", ONSET) - lifts
    trace: NDArray[np.float64] = torque * np.clip((lifted - time) / LIFT + 1.0, 0.0, 1.0)
    return trace


def measure_run(
    plan: Mapping[str, Any],
    name: str,
    truth: Truth,
    session: Mapping[str, float],
    key: tuple[str | int, ...],
    noisy: bool,
) -> MeasuredRun:
    """Drive one run and read its instruments.

    Parameters
    ----------
    plan : of the run, from designs.yaml
    name : of the run
    truth : effect of the campaign
    session : offsets of the session
    key : of the run's draws
    noisy : with offsets of the run, disturbances and noise
    """
    declared, designs = read_declared("car"), read_declared("designs")
    rng, on = keyed_generator(*key, "run"), float(noisy)
    tolerances = values_of(designs["tolerances_1sigma"]["run"])
    offset = {quantity: on * sigma * float(rng.standard_normal()) for quantity, sigma in tolerances.items()}
    direction = plan.get("direction", 1)
    effects = {k: v for k, v in truth.values.items() if k not in SENSORS and truth.form is None}
    for tolerance, change in SESSION.items():
        effects[change] = (1.0 + effects.get(change, 0.0)) * (1.0 + session[tolerance]) - 1.0
    effects["friction"] = (1.0 + effects.get("friction", 0.0)) * (1.0 + offset["friction"]) - 1.0
    weather, rate = plan.get("weather", "dry"), plan.get("rate", 0)
    surface = find_surface(weather, rate)
    center, length, height = plan.get("hazard", (0.0, 0.0, 0.0))
    hazard = (float(center), float(length), float(height))
    record = build_car(
        effects, Surroundings(surface=surface, direction=direction, grade=session["grade"], hazard=hazard)
    )
    pressure = brake_trace(plan)
    speed = plan["speed"] + offset["initial_speed_m_s"]
    inputs = _inputs(pressure, drive_trace(plan, record, speed), truth, key, on)
    controller = values_of(declared["abs"]) | {"target_slip": surface["target_slip"]}
    states, rates = drive_run(
        record, inputs, start_state(record, speed, plan.get("disc", DISC)), controller, designs["last_speed"]["value"]
    )  # fmt: skip
    count = len(states)
    faults = {k: v for k, v in truth.values.items() if k in SENSORS}
    channels = read_instruments(states, rates, record, faults, INTERVAL)
    gauge = pressure[:count]
    if noisy:
        noise = designs["noise"]["channels"]
        offsets = {
            "longitudinal_acceleration": offset["acceleration_bias_m_s2"],
            "pitch": offset["pitch_offset_deg"],
        }
        channels = add_noise(channels, offsets, noise, *key)
        own = noise["brake_pressure"]
        gauge = gauge + own["sigma"] * draw_coloured(keyed_generator(*key, "gauge"), count, own["ar1"])
        gauge = np.maximum(gauge, 0.0) if plan.get("pressure") else pressure[:count]
    row = {
        "run": name, "weather": weather, "precipitation_mm_h": float(rate),
        "snow_accumulation_h": designs["snow_accumulation_h"]["value"] if weather == "snow" else 0.0,
        "direction": direction, "disc_temperature_above_ambient_c": float(plan.get("disc", DISC)),
        "hazard_center_m": hazard[0], "hazard_length_m": hazard[1], "hazard_height_m": hazard[2],
    }  # fmt: skip
    return MeasuredRun(
        row=row,
        columns={"time": np.arange(count, dtype=np.float64) * INTERVAL, "brake_pressure": gauge} | channels,
    )


def _inputs(
    pressure: NDArray[np.float64],
    drive: NDArray[np.float64],
    truth: Truth,
    key: tuple[str | int, ...],
    on: float,
) -> Inputs:
    time = np.arange(len(pressure), dtype=np.float64) * INTERVAL
    tables = [
        on * draw_smooth(keyed_generator(*key, port), time, entry["sigma"], entry["time"])
        for port, entry in read_declared("designs")["disturbances"].items()
    ]
    keys, table = np.array([-1, 0, 0]), np.zeros(4)
    if truth.form is not None:
        form = truth.form
        keys = np.array([PORTS.index(form["port"]), VARIABLES.index(form["variable"]), int(form["wet_only"])])
        table = np.array([form["from"], form["to"], *form["at"]], dtype=np.float64)
    return Inputs(INTERVAL, pressure, tables[0], tables[1], tables[2], drive, keys, table)


def make_campaign(
    folder: Path, truth: Truth, design: str, seed: int, *, noisy: bool = True
) -> dict[str, Any]:
    """Write one campaign folder, and return its label.

    Parameters
    ----------
    folder : to make
    truth : effect of the campaign
    design : of designs.yaml
    seed : of all that is drawn
    noisy : with session and run offsets, disturbances and noise
    """
    designs = read_declared("designs")
    plans, train = designs["designs"][design]["runs"], designs["designs"][design]["train"]
    key: tuple[str | int, ...] = (seed, truth.name, design)
    session = draw_session(seed, truth.name, design, float(noisy))
    order = keyed_generator(*key, "order").permutation(len(plans))
    either = designs["designs"][design]["both_directions"]
    names = [f"run-{place + 1:02d}" for place in order]
    runs = []
    for i, (plan, name) in enumerate(zip(plans, names, strict=True)):
        own = (*key, i)
        direction = 1 if not either or keyed_generator(*own, "direction").random() < 0.5 else -1
        runs.append(measure_run({**plan, "direction": direction}, name, truth, session, own, noisy))
    _write_campaign(folder, design, runs, names[:train], names[train:])
    return {
        "effect": truth.effect, "group": truth.group, "library": truth.library, "values": truth.values,
        "size": truth.size, "sizes": truth.sizes, "same_form": truth.same_form, "form": truth.form, "design": design,
        "seed": seed, "session": session,
    }  # fmt: skip


def _write_campaign(
    folder: Path, design: str, runs: list[MeasuredRun], train: list[str], held_out: list[str]
) -> None:
    designs = read_declared("designs")
    tolerances: dict[str, Any] = dict(collect_tolerances(design))
    tolerances["run"] = values_of(designs["tolerances_1sigma"]["run"])
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    header = {
        "campaign": folder.name, "vehicle": read_declared("car")["vehicle"], "sample_rate_hz": round(1.0 / INTERVAL),
        "split": {"train": train, "held_out": held_out}, "tolerances_1sigma": tolerances,
        "notes": "A double-track car; braking starts from a rolling vehicle, and a run ends at the stop.",
    }  # fmt: skip
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header, sort_keys=False), encoding="utf-8")
    runs = sorted(runs, key=lambda run: str(run.row["run"]))
    lines = [",".join(runs[0].row), *(",".join(str(value) for value in run.row.values()) for run in runs)]
    (folder / "runs.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    units = {name: own["unit"] for name, own in designs["noise"]["channels"].items()} | {"time": "s"}
    for run in runs:
        fields = [pa.field(name, pa.float64(), metadata={"units": units[name]}) for name in run.columns]
        table = pa.table(list(run.columns.values()), schema=pa.schema(fields))
        pq.write_table(table, folder / "runs" / f"{run.row['run']}.parquet")
