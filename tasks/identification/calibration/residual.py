"""Residuals of a calibration: model less reference for each response, scaled so that responses are comparable."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tasks.surface.road_profile import RoadHazard
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Controls, Mode, Rollout, simulate_scenario

Floats = NDArray[np.float64]
Response = Literal["speed", "speed_drop", "pitch", "slip", "wheel_load", "stop"]
EVERY_RESPONSE: tuple[Response, ...] = ("speed", "pitch", "slip", "wheel_load", "stop")
"""Responses that are examined jointly after each stage (paper, Appendix C.1, e_cal)."""
Phase = Literal["start", "braking", "tail", "event"]
WHEELS = {"fl": "f", "fr": "f", "rl": "r", "rr": "r"}


@dataclass(frozen=True, kw_only=True)
class CalibrationCase:
    """One reference run with its conditions and the samples that the calibration uses.

    Parameters
    ----------
    name : name of the case
    kind : flat, hump or depression
    family : name of the kind of weather
    surface_friction : mu_c [1]
    controls : initial speed and brake
    hazard : road feature
    time : times of the n samples, from the brake onset on, ascending, shape (n,) [s]
    event_start : start of the scored event; samples before it count in the start phase only [s]
    speed, pitch : at the samples, shape (n,) [m/s, deg]; pitch with its static offset
    slip, wheel_load : by wheel fl, fr, rl, rr, shape (4, n) [1, N]
    stopping_distance : stopping distance of the reference; None where it is not scored [m]
    """

    name: str
    kind: str
    family: str
    surface_friction: float
    controls: Controls
    hazard: RoadHazard
    time: Floats
    event_start: float
    speed: Floats
    pitch: Floats
    slip: Floats
    wheel_load: Floats
    stopping_distance: float | None


@dataclass(frozen=True, kw_only=True)
class Yardstick:
    """Scales that make residuals comparable.

    Parameters
    ----------
    scales : scale of each response; speed_drop is the fall of speed since its first sample [m/s, m/s, deg, 1, N,
        m]
    start_s : length of the start of braking [s]
    settle_s : time at its beginning that speed_drop leaves out, until the driver no longer holds the speed [s]
    tail_speed : speed below which the tail of a stop begins [m/s]
    slip_speed : speed above which slip counts [m/s]
    margin_s : time that the model runs past the last sample [s]
    """

    scales: Mapping[str, float]
    start_s: float
    settle_s: float
    tail_speed: float
    slip_speed: float
    margin_s: float


def simulate_case(vehicle: Vehicle, case: CalibrationCase, mode: Mode, margin_s: float) -> Rollout:
    """Return the model's run of a case, to a little past its last sample.

    Parameters
    ----------
    vehicle : the vehicle
    case : reference run, which gives the conditions
    mode : paper or coupled
    margin_s : time past the last sample [s]
    """
    duration = float(np.ceil((case.time[-1] + margin_s) * 1000) / 1000)
    surface = SurfaceState(kind=case.family, friction=case.surface_friction)
    return simulate_scenario(vehicle, surface, case.controls, case.hazard, mode=mode, duration_s=duration)


def compute_residuals(
    ride: Rollout, case: CalibrationCase, responses: Sequence[Response], phase: Phase, yardstick: Yardstick
) -> Floats:
    """Return model less reference of some responses, scaled: the square sum is the sum of (RMSE / scale)^2 [1].

    Parameters
    ----------
    ride : the model's run
    case : reference run
    responses : responses that are compared
    phase : the start of braking, braking above the tail speed, tail below it, or the whole event
    yardstick : scales and speeds
    """
    model = ride.columns
    event = case.time >= case.event_start
    counts = {
        "start": case.time <= case.time[0] + yardstick.start_s,
        "braking": event & (case.speed > yardstick.tail_speed),
        "tail": event & (case.speed <= yardstick.tail_speed),
        "event": event,
    }[phase]
    time = model["t_ns"] * 1e-9
    parts = [np.empty(0)]

    def add_residual(
        name: str, values: Floats, reference: Floats, mask: NDArray[np.bool_], share: float = 1.0
    ) -> None:
        if mask.any():
            error = np.interp(case.time[mask], time, values) - reference[mask]
            parts.append(error * np.sqrt(share / mask.sum()) / yardstick.scales[name])

    for response in responses:
        if response == "speed":
            add_residual("speed", model["speed"], case.speed, counts)
        elif response == "speed_drop":
            free = counts & (case.time >= case.time[0] + yardstick.settle_s)
            first = int(np.argmax(free))
            begin = float(np.interp(case.time[first], time, model["speed"]))
            add_residual("speed_drop", model["speed"] - begin, case.speed - case.speed[first], free)
        elif response == "pitch":
            add_residual("pitch", np.rad2deg(model["pitch"] + ride.static_pitch), case.pitch, counts)
        elif response == "slip":
            for row, axle in zip(case.slip, WHEELS.values(), strict=True):
                rolling = counts & (case.speed > yardstick.slip_speed)
                add_residual("slip", model[f"braking_slip_{axle}"], row, rolling, 0.25)
        elif response == "wheel_load":
            for row, axle in zip(case.wheel_load, WHEELS.values(), strict=True):
                add_residual("wheel_load", model[f"axle_load_{axle}"] / 2, row, counts, 0.25)
        elif case.stopping_distance is not None and phase == "event":
            distance = model["station"][-1] - np.interp(ride.brake_onset_time, time, model["station"])
            parts.append(np.array([distance - case.stopping_distance]) / yardstick.scales["stop"])
    return np.concatenate(parts)
