"""Effects that a car adds to the plain laws, written from their equations; with a value of 0 each leaves its law plain.

What an effect remembers (heat, a slip that lags) no column holds: `find_unjudged` names the laws that it takes away.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.signal import lfilter

from studies.physics_judge.laws.constants import Constants, Floats, raised_cosine
from studies.physics_judge.laws.tyres import TyreCurve

AIR_DENSITY = 1.2
"""[kg/m3]."""
LOWEST_GEAR = 12.0
"""Wheel speed below which the engine's drag falls with it [rad/s]."""
COULOMB_SPEED = 0.01
"""Strut rate over which dry friction turns [m/s]."""
RAISED = 0.5
"""Share by which effects may raise a tyre's friction above its peak [1]."""
STICK_SLIP = 0.002
"""Slip over which a sticking tyre builds up its force [1]."""

FORCE, TORQUE, SUM = "tyre force of slip and load", "brake torque of pressure", "m dv/dt is the sum of forces"
HEAVE, PITCH, AXLE = "body's heave equation", "body's pitch equation", "axle's own motion"
COMMANDED = "brake pressure as commanded"
REMEMBERED: Mapping[str, tuple[str, ...]] = {
    "relaxation_length": (FORCE,),
    "tyre_heating": (FORCE,),
    "fade": (TORQUE,),
}
"""Laws that an effect takes away because it depends on what no column holds."""
FORMS: Mapping[str, tuple[str, ...]] = {
    "longitudinal_force": (SUM,),
    "brake_torque": (TORQUE,),
    "friction": (FORCE,),
    "pitch_moment": (PITCH,),
    "suspension_force": (HEAVE, PITCH, AXLE),
}
"""Laws that a form takes away, by its port."""


STEEP = 1.0
"""Slope of a road feature above which wheels leave the road and meet it within ticks [1]."""
STEEP_LAWS = (HEAVE, PITCH, AXLE, "wheel torque balance", "speed is the integral of acceleration",
              "kinetic energy falls by the work done", "road height as commanded")  # fmt: skip
"""Laws over a tick that such a feature takes away; those at a tick stay."""


def find_unjudged(facts: Mapping[str, Any], constants: Constants) -> dict[str, str]:
    """Return the laws that are not judged for a clip, each with what takes it away.

    Parameters
    ----------
    facts : the clip's row
    constants : car and pavement
    """
    found = {}
    if facts["hazard_height_m"] and np.pi * abs(facts["hazard_height_m"]) > STEEP * facts["hazard_length_m"]:
        kept = ("road height as commanded",) if constants.mode == "coupled" else ()
        found = {law: f"road feature steeper than {STEEP:g}" for law in STEEP_LAWS if law not in kept}
    if constants.policy:
        found |= {COMMANDED: "a policy brakes"}
    found |= {law: f"effect {name}" for name in constants.effects for law in REMEMBERED.get(name, ())}
    return found | {
        law: f"form of {variable} at {port}" for port, variable in constants.forms for law in FORMS[port]
    }


def feel_road(
    station: Floats, hump: tuple[float, float, float], effects: Mapping[str, float]
) -> tuple[Floats, Floats]:
    """Return road height [m] and slope [1] that a wheel feels: of its footprint, and where a disc touches.

    Parameters
    ----------
    station : of the wheel's centre [N] [m]
    hump : middle, length and height of the road feature [m]
    effects : of the car
    """
    half, radius = 0.5 * effects.get("enveloping_length", 0.0), effects.get("contact_radius", 0.0)

    def average(at: Floats) -> tuple[Floats, Floats]:
        if half <= 0.0:
            return raised_cosine(at, *hump)
        out = np.sqrt(0.6) * half
        outer = raised_cosine(at - out, *hump)[0] + raised_cosine(at + out, *hump)[0]
        rise = raised_cosine(at + half, *hump)[0] - raised_cosine(at - half, *hump)[0]
        return (5.0 * outer + 8.0 * raised_cosine(at, *hump)[0]) / 18.0, rise / (2.0 * half)

    height, slope = average(station)
    if radius == 0.0:
        return height, slope
    touched, steep = average(station + radius * slope)
    tilted = slope != 0.0
    return np.where(tilted, touched - 0.5 * radius * steep**2, height), np.where(tilted, steep, slope)


def share_sticking(speed: Floats, effects: Mapping[str, float]) -> Floats:
    """Return the share of a tyre that sticks, 1 at low speed and smoothly down to 0 [N] [1].

    Parameters
    ----------
    speed : [N] [m/s]
    effects : of the car
    """
    above, below = effects.get("stick_above", 0.0), effects.get("stick_below", 0.0)
    u = np.clip((above - speed) / max(above - below, 1e-300), 0.0, 1.0)
    return np.where(speed >= above, 0.0, np.where(speed <= below, 1.0, u**2 * (3.0 - 2.0 * u)))


def bound_lateral_hold(
    load: Floats, travel: Floats, speed: Floats, peak: float, effects: Mapping[str, float]
) -> Floats:
    """Return the largest vertical force that links make of a sticking tyre's lateral force [N] [N].

    How far the tyre is deflected no column holds; its force stays within the friction of the axle, which no other
    effect raises by more than `RAISED`.

    Parameters
    ----------
    load, travel : of the axle [N] [N, m]
    speed : of the car [N] [m/s]
    peak : of the tyre on the surface [1]
    effects : of the car
    """
    if effects.get("lateral_stiffness", 0.0) <= 0.0:
        return np.zeros(len(speed))
    incline = effects.get("track_change", 0.0) + effects.get("track_change_by_travel", 0.0) * travel
    return share_sticking(speed, effects) * (1.0 + RAISED) * peak * load * np.abs(incline)


def compute_friction(
    slip: Floats, load: Floats, speed: Floats, load_ratio: Floats, *, wet: bool, curve: TyreCurve,
    effects: Mapping[str, float],
) -> Floats:  # fmt: skip
    """Return braking force over load, odd in slip [N] [1].

    Parameters
    ----------
    slip : braking slip, signed [N] [1]
    load : of the axle [N] [N]
    speed : of the car [N] [m/s]
    load_ratio : load over that at rest [N] [1]
    wet : whether water lies on the road
    curve : the tyre on the surface
    effects : of the car
    """
    e, kappa = effects.get, np.abs(slip)
    friction = curve.friction(kappa, load)
    stiffness = e("tread_stiffness", 0.0)
    if stiffness > 0.0:
        u = kappa / curve.target_slip
        steep = max(stiffness * curve.target_slip / curve.peak, 2.0)
        friction = np.where(u < 1.0, curve.peak * steep * u / (1.0 + u * (u + steep - 2.0)), friction)
    sticks = share_sticking(speed, effects)
    held = max(e("stick_ratio", 0.0) * curve.peak - e("stick_loss", 0.0), 0.0)
    friction = (1.0 - sticks) * friction + sticks * held * kappa / np.hypot(STICK_SLIP, kappa)
    factor = 1.0 - e("load_sensitivity", 0.0) * (load_ratio - 1.0)
    if wet:
        factor = factor * (1.0 - e("wet_speed", 0.0) * np.maximum(speed - e("wet_threshold", 0.0), 0.0))
    factor = factor * (1.0 - e("friction_speed", 0.0) * speed)
    return np.asarray(np.sign(slip) * friction * np.maximum(factor, 0.0))


def compute_resistance(speed: Floats, snow_mm: float, effects: Mapping[str, float]) -> Floats:
    """Return the force of air and snow against the motion [N] [N].

    Parameters
    ----------
    speed : [N] [m/s]
    snow_mm : depth of the snow [mm]
    effects : of the car
    """
    air = speed + effects.get("wind_speed", 0.0)
    force = 0.5 * AIR_DENSITY * effects.get("drag_area", 0.0) * air * np.abs(air)
    return np.where(speed > 0.0, force + effects.get("ploughing", 0.0) * snow_mm, 0.0)


def compute_engine_torque(omega: Floats, radius: float, effects: Mapping[str, float]) -> Floats:
    """Return the engine's torque against the rotation of the driven wheels [N] [N m].

    Parameters
    ----------
    omega : of these wheels [N] [rad/s]
    radius : of a wheel [m]
    effects : of the car
    """
    e = effects.get
    torque = e("engine_torque", 0.0) + e("engine_viscous", 0.0) * omega
    torque = torque + 1e3 * e("engine_power", 0.0) * omega / (omega**2 + LOWEST_GEAR**2)
    if e("creep_force", 0.0):
        slow = np.maximum(1.0 - radius * omega / e("creep_speed", 4.0), 0.0)
        torque = torque - e("creep_force", 0.0) * radius * slow
    return torque


def delay_pressure(commanded: Floats, step: float, effects: Mapping[str, float]) -> Floats:
    """Return the pressure at the pads, which follows the commanded one by a first-order lag [N] [MPa].

    Parameters
    ----------
    commanded : at equal steps, linear between them [N] [MPa]
    step : between them [s]
    effects : of the car
    """
    lag = effects.get("lag", 0.0)
    if lag <= 0.0:
        return commanded
    keeps = np.exp(-step / lag)
    behind = np.concatenate([[0.0], -np.diff(commanded) / step * lag * (1.0 - keeps)])
    return commanded + lfilter([1.0], [1.0, -keeps], behind)


def compute_pad_pressure(line: Floats, speed: Floats, effects: Mapping[str, float]) -> Floats:
    """Return the pressure that would give the same torque by the linear law [N] [MPa].

    Parameters
    ----------
    line : pressure at the pads [N] [MPa]
    speed : of the car [N] [m/s]
    effects : of the car
    """
    e = effects.get
    factor = 1.0 + e("pressure_curve", 0.0) * line
    factor = factor * (1.0 - e("pad_speed", 0.0) * (speed - e("pad_speed_reference", 0.0)))
    return np.maximum(line - e("push_out", 0.0), 0.0) * np.maximum(factor, 0.0)


def compute_strut_force(
    travel: Floats, rate: Floats, stiffness: float, damping: float, effects: Mapping[str, float]
) -> Floats:
    """Return the force of spring, damper, dry friction and bump stop, positive in extension [N] [N].

    Parameters
    ----------
    travel, rate : of the strut [N] [m, m/s]
    stiffness, damping : of its spring and damper [N/m, N s/m]
    effects : of the car
    """
    e = effects.get
    force = stiffness * travel + damping * rate * (
        1.0 + e("damper_asymmetry", 0.0) * np.where(rate > 0.0, 1.0, -1.0)
    )
    if e("coulomb_friction", 0.0):
        force = force + e("coulomb_friction", 0.0) * np.tanh(np.clip(rate / COULOMB_SPEED, -20.0, 20.0))
    force = force + e("progressive_rate", 0.0) * travel**3
    if e("stop_stiffness", 0.0):
        force = force + e("stop_stiffness", 0.0) * np.minimum(travel + e("stop_clearance", 0.03), 0.0)
    return np.asarray(force)


def compute_links(
    tyre_force: Floats,
    load: Floats,
    travel: Floats,
    speed: Floats,
    axle: str,
    curve: TyreCurve,
    constants: Constants,
) -> Floats:
    """Return the vertical force of an axle's links, which lifts a braking nose and holds a braking tail [N] [N].

    Parameters
    ----------
    tyre_force, load, travel : of the axle [N] [N, N, m]
    speed : of the car [N] [m/s]
    axle : f or r
    curve : the tyre on the surface
    constants : car and pavement
    """
    e, car = constants.effects.get, constants.car
    sticks = share_sticking(speed, constants.effects) * (speed > 0)
    name, sign = ("anti_dive", -1.0) if axle == "f" else ("anti_lift", 1.0)
    share = e(name, 0.0) + sticks * e(f"stick_{name}", 0.0)
    force = share * tyre_force * car["cg_height"] / constants.wheelbase
    with np.errstate(invalid="ignore", divide="ignore"):
        used = np.where(load > 0.0, tyre_force / load / curve.peak, 1.0)
    left = np.sqrt(np.maximum(1.0 - used**2, 0.0)) * (speed > 0)
    scrub = e("scrub_stiffness", 0.0) * (1.0 - sticks) * car[f"suspension_stiffness_{axle}"] * travel
    return np.asarray(force + sign * scrub * left)
