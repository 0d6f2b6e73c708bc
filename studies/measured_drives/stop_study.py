"""A stop study on a campaign: one stop predicted from another, rung by rung, with what is left over."""

from dataclasses import asdict
from math import isnan
from typing import Any

from catalogs.entries import load
from flows.store.outputs import Outputs
from studies.measured_drives.drives import read_drives
from studies.measured_drives.events import RecordedRun
from studies.measured_drives.plans import load_plan
from studies.measured_drives.stop import Stop, StopErrors, stop_of, stopping_distance
from studies.measured_drives.stop_findings import after_stop, measure_rebound, measure_saturation, slip_cycles
from studies.measured_drives.stop_ladder import RungResult, compute_uncalibrated_errors, fit_ladder
from tasks.campaign.campaign import CHANNELS
from tasks.errors import InputError

NEEDED = (*CHANNELS, "brake_pressure", "brake_torque", "engine_torque")
ERROR_UNITS = {
    "speed_rmse": "m/s", "acceleration_rmse": "m/s^2", "wheel_speed_rmse": "rad/s", "pitch_rmse": "deg",
    "distance_error": "m", "peak_pitch_error": "deg", "rebound_rmse": "deg",
    "rebound_acceleration_rmse": "m/s^2",
}  # fmt: skip


def stop_study(
    campaign: str, *, study: str = "bmw-m8", vehicle: str | None = None, out: str | None = None
) -> dict[str, Any]:
    """Calibrate on one stop of a car, predict another, and add what the model lacks step by step.

    Parameters
    ----------
    campaign : campaign folder with brake and engine torque
    study : stop study by name or YAML file
    vehicle : uncalibrated vehicle by name or YAML file; None takes the campaign's
    out : folder for ``stop_study.json``; None writes none

    Returns
    -------
    ``measured``, ``rungs[]`` with ``parameters``, ``train`` and ``held_out`` errors, ``findings`` and ``units``.

    Raises
    ------
    InputError
        If a run or a channel is missing, or a run holds no stop.
    """
    results = Outputs(out, "lab stop-study", "stop_study.json")
    plan = load_plan("stop study", study)
    recorded = read_drives(campaign)
    by_name = {drive.name: drive for drive in recorded.drives}
    problems: list[str] = []
    stops: dict[str, Stop] = {}
    for name in (plan.train, plan.held_out):
        found = _stop(by_name, name, plan.lead_s.value)
        if isinstance(found, Stop):
            stops[name] = found
        else:
            problems += found
    if problems:
        raise InputError([f"{recorded.name}: {problem}" for problem in problems])
    train, held_out = stops[plan.train], stops[plan.held_out]
    car, surface = load("vehicle", vehicle or recorded.vehicle), load("surface", "dense-asphalt")
    rungs = fit_ladder(train, held_out, plan.ladder, car, surface)
    last = rungs[-1]
    result: dict[str, Any] = {
        "campaign": recorded.name,
        "vehicle": car.name,
        "measured": [
            {"part": part, "run": stop.name, "stopping_distance_m": stopping_distance(stop, stop.columns["speed"]),
             "start_speed_m_s": float(stop.columns["speed"][stop.onset])}
            for part, stop in (("train", train), ("held_out", held_out))
        ],
        "rungs": [
            {"rung": "data sheet", "adds": "nothing fitted", "parameters": {},
             "train": _errors(compute_uncalibrated_errors(train, car, surface)),
             "held_out": _errors(compute_uncalibrated_errors(held_out, car, surface))},
            *(
                {"rung": rung.rung.name, "adds": rung.rung.adds, "parameters": _parameters(rung),
                 "train": _errors(rung.train), "held_out": _errors(rung.held_out),
                 "after_stop": asdict(after_stop(held_out, rung.predicted)),
                 "rebound": asdict(measure_rebound(held_out, rung.predicted["pitch"]))}
                for rung in rungs
            ),
        ],
        "findings": {
            "saturation": {
                "train": asdict(measure_saturation(train, car)),
                "held_out": asdict(measure_saturation(held_out, car)),
            },
            "slip": {
                "measured": asdict(slip_cycles(held_out, held_out.columns, car, last.parameters)),
                "predicted": asdict(slip_cycles(held_out, last.predicted, car, last.parameters)),
            },
            "rebound_deg": asdict(measure_rebound(held_out, held_out.columns["pitch"])),
        },
        "units": ERROR_UNITS,
    }  # fmt: skip
    results.write_json("stop_study.json", result)
    return result


def _stop(by_name: dict[str, RecordedRun], name: str, lead: float) -> Stop | list[str]:
    if name not in by_name:
        return [f"the study needs the run {name}; there are: {', '.join(by_name)}"]
    missing = [channel for channel in NEEDED if channel not in by_name[name].columns]
    if missing:
        return [f"{name}: channel {channel} is missing" for channel in missing]
    found = stop_of(by_name[name], lead)
    return found or [f"{name}: holds no stop with {lead:g} s of rolling before it"]


def _parameters(rung: RungResult) -> dict[str, float]:
    pitch = {"pitch_gain": rung.dive.pitch_gain, "pitch_stiffness": rung.dive.stiffness,
             "pitch_damping_ratio": rung.dive.damping_ratio}  # fmt: skip
    swing = rung.swing and {
        "swing_frequency_hz": rung.swing.frequency,
        "swing_damping_ratio": rung.swing.damping_ratio,
    }
    return {**rung.parameters, **pitch, **(swing or {})}


def _errors(errors: StopErrors) -> dict[str, float | None]:
    return {name: None if isnan(value) else value for name, value in asdict(errors).items()}
