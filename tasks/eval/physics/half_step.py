"""Forces half a tick after each tick: there the ABS may differ from both neighbouring ticks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.eval.physics.constants import (
    DT,
    Constants,
    Floats,
    find_climb,
    pressure_at,
    raised_cosine,
)
from tasks.eval.physics.implicit_step import (
    compute_wheel_rate,
    find_slowest_explicit_speed,
    solve_wheel_speed,
)
from tasks.eval.physics.tyres import find_curve

INNER_STEP = 0.0005
"""Step of the integration behind the ticks (paper, Table frozen_physical_params) [s]."""


@dataclass(frozen=True, kw_only=True)
class HalfStep:
    """State half a tick after each tick but the last, computed from the tick's own state.

    Parameters
    ----------
    acceleration : dv/dt [N - 1] [m/s2]
    rate : wheel acceleration [N - 1] of axles f and r [rad/s2]
    change : change of wheel speed over the whole tick [N - 1] of axles f and r [rad/s]
    load_uncertainty : largest error of each axle's load there, from its curvature over the ticks around [N - 1] [N]
    """

    acceleration: Floats
    rate: Mapping[str, Floats]
    change: Mapping[str, Floats]
    load_uncertainty: Mapping[str, Floats]


def follow_half_step(ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants) -> HalfStep:
    """Integrate the car half a tick on from each tick (paper, Eqs. app_abs_command to app_longitudinal_complete).

    The ABS changes from one inner step to the next, so the ticks alone do not hold all forces that act between them.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    constants : car and pavement
    """
    car, m, L = constants.car, constants.mass, constants.wheelbase
    curve = find_curve(facts, constants)
    target, width, radius = curve.target_slip, car["abs_release_width"], car["wheel_radius"]
    s, v, a = ticks["station"], ticks["speed"], ticks["longitudinal_acceleration"]
    speed = v[:-1] + INNER_STEP * a[:-1]
    station = s[:-1] + 0.5 * INNER_STEP * (v[:-1] + speed)
    time = DT * np.arange(len(s) - 1, dtype=np.float64) + INNER_STEP
    pressure = pressure_at(time - find_brake_onset(ticks, facts), *pressure_shape(facts))
    hump = facts["hazard_center_m"], facts["hazard_length_m"], facts["hazard_height_m"]
    analytic = constants.mode == "paper" and hump[2] == 0.0
    forward, rates, changes, doubts = np.zeros(len(speed)), {}, {}, {}
    climb, later_climb, open_climb = find_climb(ticks, constants)
    slowest = find_slowest_explicit_speed(facts, constants, INNER_STEP)
    first, second = (np.flatnonzero((at < slowest) & (v[1:] > 0) & (v[:-1] > 0)) for at in (speed, v[1:]))
    for axle, behind, sign in (("f", 0.0, -1.0), ("r", L, 1.0)):
        force, torque = ticks[f"tyre_force_{axle}"], ticks[f"brake_torque_{axle}"]
        before = ticks[f"wheel_speed_{axle}"][:-1]
        omega = before + INNER_STEP * (radius * force - torque)[:-1] / car[f"wheel_inertia_{axle}"]
        omega[first] = solve_wheel_speed(
            before[first], speed[first], ticks[f"tyre_load_{axle}"][first], ticks["brake_pressure_mpa"][first],
            INNER_STEP, axle, facts, constants,
        )  # fmt: skip
        slip = np.clip((speed - radius * omega) / np.maximum(speed, car["slip_speed_floor"]), 0.0, 1.0)
        load = ticks[f"tyre_load_{axle}"]
        between = 0.5 * (load[1:] + load[:-1])
        bend = np.abs(np.diff(load, 2, prepend=load[:1], append=load[-1:]))
        doubts[axle] = m * car["cg_height"] / L * open_climb if analytic else np.maximum(bend[1:], bend[:-1])
        if analytic:
            lever = car["cg_to_rear_axle" if axle == "f" else "cg_to_front_axle"]
            between = m / L * (car["gravity"] * lever + sign * (a + climb)[:-1] * car["cg_height"])
        push = curve.friction(slip, between) * between
        share = np.clip((target * (1 + width) - slip) / (width * target), 0.0, 1.0)
        brake = share * constants.brake_share(axle) * car["brake_gain"] * pressure
        rates[axle] = (radius * push - brake) / car[f"wheel_inertia_{axle}"]
        changes[axle] = omega - before + INNER_STEP * rates[axle]
        ended = ticks[f"braking_slip_{axle}"][1:][second]
        at_end = compute_wheel_rate(ended, between[second], pressure[second], axle, facts, constants)[0]
        changes[axle][second] = (omega - before)[second] + INNER_STEP * at_end
        forward -= push + between * raised_cosine(station - behind, *hump)[1]
    held = find_held_rows(time, facts, find_brake_onset(ticks, facts))
    return HalfStep(
        acceleration=np.where(held, 0.0, forward / m - car["coast_deceleration"] - later_climb),
        rate=rates,
        change=changes,
        load_uncertainty=doubts,
    )


def find_held_rows(time: Floats, facts: Mapping[str, Any], onset: float) -> NDArray[np.bool_]:
    """Return when the driver holds the speed: until the brake onset, and throughout without one [N].

    Parameters
    ----------
    time : [N] [s]
    facts : the clip's row
    onset : of the brake [s]
    """
    return (time < onset) & bool(facts["hold_speed"])


def pressure_shape(facts: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """Peak [MPa], ramp, hold and release [s] that the scenario commands.

    Parameters
    ----------
    facts : the clip's row
    """
    hold = facts["hold_s"]
    endless = hold is None or np.isnan(hold)
    return facts["peak_pressure_mpa"], facts["ramp_s"], np.inf if endless else hold, facts["release_s"]


def find_brake_onset(ticks: Mapping[str, Floats], facts: Mapping[str, Any]) -> float:
    """Brake onset [s]; infinite without one.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    """
    at_time, at_place = facts["brake_onset_s"], facts["brake_onset_m"]
    if not facts["peak_pressure_mpa"]:
        return float("inf")
    if at_time is not None and np.isfinite(at_time):
        return float(at_time)
    if at_place is None or not np.isfinite(at_place):
        return float("inf")
    passed = np.flatnonzero(ticks["station"] >= at_place)
    if passed.size == 0 or ticks["speed"][passed[0]] <= 0:
        return float("inf")
    k = int(passed[0])
    return max(1e-3 * k - float((ticks["station"][k] - at_place) / ticks["speed"][k]), 0.0)
