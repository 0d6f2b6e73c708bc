"""Forces half a tick after each tick: there the ABS may differ from both neighbouring ticks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.physics_judge.laws.constants import (
    DT,
    ClipColumns,
    Constants,
    Floats,
    find_climb,
    pressure_at,
    raised_cosine,
)
from studies.physics_judge.laws.tyres import find_curve

INNER_STEP = 0.0005
"""Step of the integration behind the ticks (paper, Table frozen_physical_params) [s]."""
MOST_ITERATIONS = 40
"""Newton steps of the rows that need most [1]."""
NEAR = 1e-13
"""Change of slip at which all rows are solved [1]."""


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


def follow_half_step(clip: ClipColumns) -> HalfStep:
    """Integrate the car half a tick on from each tick (paper, Eqs. app_abs_command to app_longitudinal_complete).

    The ABS changes from one inner step to the next, so the ticks alone do not hold all forces that act between them.

    Parameters
    ----------
    clip : what is judged
    """
    ticks, facts, constants = clip
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
    forward, rates, changes, uncertainties = np.zeros(len(speed)), {}, {}, {}
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
        uncertainties[axle] = (
            m * car["cg_height"] / L * open_climb if analytic else np.maximum(bend[1:], bend[:-1])
        )
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
        load_uncertainty=uncertainties,
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


def find_slowest_explicit_speed(facts: Mapping[str, Any], constants: Constants, step: float) -> float:
    """Return the speed below which a wheel's step is implicit, 0 where none is [m/s].

    Parameters
    ----------
    facts : the clip's row
    constants : car and pavement
    step : inner step [s]
    """
    if constants.steady_limit == 0.0:
        return 0.0
    car, curve = constants.car, find_curve(facts, constants)
    weight = constants.mass * car["gravity"] / constants.wheelbase
    moved = curve.peak * weight * car["cg_height"]
    found = [car["slip_speed_floor"]]
    for axle, lever, load in (("f", "cg_to_rear_axle", moved), ("r", "cg_to_front_axle", 0.0)):
        most = weight * car[lever] + load
        grip = car["wheel_radius"] * float(curve.slope(np.array(0.0), np.array(most))) * most
        release = constants.brake_share(axle) * car["brake_gain"] * facts["peak_pressure_mpa"]
        release /= car["abs_release_width"] * curve.target_slip
        inertia = car[f"wheel_inertia_{axle}"] * constants.steady_limit
        found.append(step * car["wheel_radius"] * max(grip, release) / inertia)
    return max(found)


def compute_wheel_rate(
    slip: Floats, load: Floats, pressure: Floats, axle: str, facts: Mapping[str, Any], constants: Constants
) -> tuple[Floats, Floats]:
    """Return a wheel's acceleration [rad/s2] at a slip, and its derivative by slip (paper, Appendix B).

    Parameters
    ----------
    slip : kappa before it is clipped [N] [1]
    load, pressure : of the step [N] [N, MPa]
    axle : f or r
    facts : the clip's row
    constants : car and pavement
    """
    car, curve = constants.car, find_curve(facts, constants)
    target, width, radius = curve.target_slip, car["abs_release_width"], car["wheel_radius"]
    felt = np.clip(slip, 0.0, 1.0)
    grip = curve.friction(felt, load)
    share = (target * (1 + width) - felt) / (width * target)
    torque = constants.brake_share(axle) * car["brake_gain"] * pressure
    steeper = radius * load * curve.slope(felt, load)
    steeper = steeper + np.where((share > 0) & (share < 1), torque / (width * target), 0.0)
    rate = radius * grip * load - np.clip(share, 0.0, 1.0) * torque
    inertia = car[f"wheel_inertia_{axle}"]
    return rate / inertia, np.where((slip >= 0) & (slip < 1), steeper, 0.0) / inertia


def solve_wheel_speed(
    omega: Floats, speed: Floats, load: Floats, pressure: Floats, step: float, axle: str, facts: Mapping[str, Any],
    constants: Constants,
) -> Floats:  # fmt: skip
    """Return wheel speeds after one implicit step each [N] [rad/s].

    Parameters
    ----------
    omega : wheel speed before the step [N] [rad/s]
    speed : after the step [N] [m/s]
    load, pressure : of the step [N] [N, MPa]
    step : inner step [s]
    axle : f or r
    facts : the clip's row
    constants : car and pavement
    """
    radius = constants.car["wheel_radius"]
    per_slip = np.maximum(speed, constants.car["slip_speed_floor"]) / radius
    free = speed / radius - omega
    low, high = np.full(len(omega), -1e3), np.full(len(omega), 1e3)
    slip = np.clip(free / per_slip, 0.0, 1.0)
    for _ in range(MOST_ITERATIONS):
        rate, slope = compute_wheel_rate(slip, load, pressure, axle, facts, constants)
        residual = free - slip * per_slip - step * rate
        low, high = np.where(residual > 0, slip, low), np.where(residual > 0, high, slip)
        following = slip + residual / np.maximum(per_slip + step * slope, 1e-9)
        following = np.where((following < low) | (following > high), 0.5 * (low + high), following)
        if not np.abs(following - slip).max(initial=0.0) > NEAR:
            break
        slip = following
    return speed / radius - following * per_slip
