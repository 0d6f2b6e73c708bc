"""Forces of the physical model at the ticks, each from the recorded columns that it depends on (docs, equations)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from studies.physics_judge.laws.constants import (
    DT,
    ClipColumns,
    Constants,
    Floats,
    compute_wet_friction,
    grips_by_speed,
    pressure_at,
    read_grade,
)
from studies.physics_judge.laws.effects import (
    bound_lateral_hold,
    compute_engine_torque,
    compute_friction,
    compute_links,
    compute_pad_pressure,
    compute_resistance,
    compute_strut_force,
    delay_pressure,
    feel_road,
)
from studies.physics_judge.laws.half_step import INNER_STEP, find_brake_onset, find_held_rows, pressure_shape
from studies.physics_judge.laws.tyres import TyreCurve, find_curve

WET = ("rain",)
"""Kinds of weather in which water lies on the road."""


HIT = 0.2
"""Change of an axle's load within a tick, over its load at rest, that no hop of the wheel makes [1]."""


@dataclass(frozen=True, kw_only=True)
class AxleForces:
    """One axle at the ticks, [N] each.

    Parameters
    ----------
    height, slope : of the road that the wheel feels [m, 1]
    rate, rate_error : of the unsprung heave, and its largest error by differences [m/s]
    load : contact load [N]
    vertical : force of the road upwards [N]
    tyre_force : against the motion [N]
    torque, torque_error : of the brake, and what the time of the onset, known to an inner step, makes of it [N m]
    spin : acceleration of the wheel [rad/s2]
    hidden : largest change of the tyre force that a tick can hide [N]
    linked : the same of the force that links and a tilted tyre force pass on [N]
    strut : force of spring, damper and links [N]
    strut_error : what the error of the rate makes of it [N]
    """

    height: Floats
    slope: Floats
    rate: Floats
    rate_error: Floats
    load: Floats
    vertical: Floats
    tyre_force: Floats
    torque: Floats
    torque_error: Floats
    spin: Floats
    hidden: Floats
    linked: Floats
    strut: Floats
    strut_error: Floats


@dataclass(frozen=True, kw_only=True)
class Forces:
    """The whole car at the ticks.

    Parameters
    ----------
    moves, held, hits : the car rolls; the driver holds its speed; a wheel leaves the road or meets it [N]
    axles : by f and r
    road : force of the road's slope, forward positive [N] [N]
    acceleration : dv/dt [N] [m/s2]
    heave, pitch : accelerations of the body [N] [m/s2, rad/s2]
    hidden : largest change of the forces along the road that a tick can hide [N] [N]
    """

    moves: NDArray[np.bool_]
    held: NDArray[np.bool_]
    hits: NDArray[np.bool_]
    axles: Mapping[str, AxleForces]
    road: Floats
    acceleration: Floats
    heave: Floats
    pitch: Floats
    hidden: Floats


def compute_forces(clip: ClipColumns) -> Forces:
    """Return what acts on the car at each tick.

    Parameters
    ----------
    clip : what is judged
    """
    ticks, facts, constants = clip
    car, m, e = constants.car, constants.mass, constants.effects.get
    curve, v = find_curve(facts, constants), ticks["speed"]
    moves = v > 0
    held = find_held_rows(DT * np.arange(len(v), dtype=np.float64), facts, find_brake_onset(ticks, facts))
    climb = car["gravity"] * read_grade(ticks)
    line = _act_on_pads(clip)
    front, rear = (constants.brake_share(axle) * car["brake_gain"] for axle in "fr")
    moved = np.clip(e("bias_pressure", 0.0) * line * (front + rear), -front, rear)
    gains = {"f": front + moved, "r": rear - moved}
    axles = {axle: _compute_axle(clip, axle, gains[axle], line, climb, curve) for axle in "fr"}
    along = {axle: ticks[f"tyre_load_{axle}"] * axles[axle].slope for axle in "fr"}
    force = ticks["tyre_force_f"] + ticks["tyre_force_r"]
    drag = m * (car["coast_deceleration"] + climb)
    drag = drag + compute_resistance(v, facts["snow_depth_mm"], constants.effects)
    road = -along["f"] - along["r"]
    acceleration = np.where(moves & ~held, (road - force - drag) / m, 0.0)
    total_height = m * car["cg_height"] - (m - car["sprung_mass"]) * car["wheel_radius"]
    lever = total_height / car["sprung_mass"] - car["wheel_radius"]
    passed = sum(
        ticks[f"tyre_force_{axle}"] + along[axle]
        + car[f"unsprung_mass_{axle}"] * (ticks["longitudinal_acceleration"] + climb)
        for axle in "fr"
    )  # fmt: skip
    braking = passed * lever + ticks["brake_torque_f"] + ticks["brake_torque_r"]
    braking = braking + _drag_shaft(ticks, moves, constants)
    # what holds the speed on a hill drives at the ground
    braking = braking - np.where(held, m * climb * (lever + car["wheel_radius"]), 0.0)
    moment = braking * (1.0 + e("pitch_gain", 0.0)) + e("aero_pitch", 0.0) * v**2
    strut_f, strut_r = axles["f"].strut, axles["r"].strut
    hidden = sum(axles[axle].hidden for axle in "fr")
    # load and slope may both change within a tick, and their product at its ends does not show it
    changes = [
        np.abs(np.diff(ticks[f"tyre_load_{axle}"], prepend=0.0) * np.diff(axles[axle].slope, prepend=0.0))
        for axle in "fr"
    ]
    met = spread(changes[0], 1) + spread(changes[1], 1)
    return Forces(
        moves=moves, held=held, hits=find_hits(ticks, constants), axles=axles, road=road, acceleration=acceleration,
        heave=(e("aero_lift", 0.0) * v**2 - strut_f - strut_r) / car["sprung_mass"],
        hidden=np.asarray(hidden + met),
        pitch=(car["cg_to_front_axle"] * strut_f - car["cg_to_rear_axle"] * strut_r + moment) / car["pitch_inertia"],
    )  # fmt: skip


def _compute_axle(
    clip: ClipColumns, axle: str, gain: Floats, line: Floats, climb: Floats, curve: TyreCurve
) -> AxleForces:
    ticks, facts, constants = clip
    car, e = constants.car, constants.effects.get
    v, omega, q = ticks["speed"], ticks[f"wheel_speed_{axle}"], ticks[f"abs_scale_{axle}"]
    u, load, kappa = (ticks[f"{name}_{axle}"] for name in ("unsprung_heave", "tyre_load", "braking_slip"))
    force, height = ticks[f"tyre_force_{axle}"], ticks[f"road_height_{axle}"]
    moves, static, stiff = v > 0, constants.static_load(axle), car[f"tyre_stiffness_{axle}"]
    hump = facts["hazard_center_m"], facts["hazard_length_m"], facts["hazard_height_m"]
    behind = 0.0 if axle == "f" else constants.wheelbase
    felt, slope = feel_road(ticks["station"] - behind, hump, constants.effects)
    rate, rate_error = differentiate(u)
    squeeze = static + np.maximum(stiff * (height - u), -static)
    damped = np.maximum(squeeze + e("tyre_damping", 0.0) * (v * slope - rate), 0.0)
    ratio, wet = load / static, facts["weather"] in WET
    by_speed = _compare_with_reference(v, facts, constants)

    def grip(slip: Floats) -> Floats:
        friction = compute_friction(slip, load, v, ratio, wet=wet, curve=curve, effects=constants.effects)
        return load * friction * by_speed

    # what holds a standing car is what its weight asks for
    rest = -load * slope - static / sum(map(constants.static_load, "fr")) * constants.mass * climb
    turning = np.clip(omega / car["lock_speed"], -1.0, 1.0)
    rubbing = e("pad_drag", 0.0) / car["brake_gain"]
    torque = gain * (compute_pad_pressure(line, v, constants.effects) * q + rubbing) * turning
    radius = car["wheel_radius"]
    lever = radius - e("radius_by_load", 0.0) * (load - static) / stiff
    rolling = (e("rolling_coefficient", 0.0) + e("rolling_speed", 0.0) * v) * turning
    offset = load * lever * (rolling - e("slope_moment", 0.0) * slope)
    shaft = compute_engine_torque(omega, radius, constants.effects) * turning if axle == "f" else 0.0
    inertia, band = car[f"wheel_inertia_{axle}"], car["abs_release_width"] * curve.target_slip
    torque_at_wheel = lever * force - ticks[f"brake_torque_{axle}"] - offset - shaft
    spin = np.where(moves, torque_at_wheel / inertia, 0.0)
    per_slip = np.maximum(v, car["slip_speed_floor"]) / radius
    room = np.where(spread((q < 1.0).astype(float), 2) > 0, np.minimum(np.abs(kappa), band), np.abs(kappa))
    sways = 3.0 * spread(np.abs(np.diff(kappa, prepend=kappa[:1])), 2)
    sways = np.maximum(sways, 0.1 * band)
    # the ABS may give this between ticks, where the slip meets an edge of its band
    meets = [np.abs(kappa - edge) < sways for edge in (curve.target_slip, curve.target_slip + band)]
    flips = np.where(meets[0] | meets[1], gain * line / inertia * np.minimum(sways / band, 1.0), 0.0)
    # its acceleration would carry the slip through 0, or through the ABS's band, within half a tick
    turns = spread((np.abs(spin) * DT >= 0.5 * room * per_slip).astype(float), 2) > 0
    arm = -car["cg_to_front_axle"] if axle == "f" else car["cg_to_rear_axle"]
    travel = ticks["heave"] - u + arm * ticks["pitch"]
    speed = ticks["heave_rate"] - rate + arm * ticks["pitch_rate"]
    spring, damper = car[f"suspension_stiffness_{axle}"], car[f"suspension_damping_{axle}"]
    strut = compute_strut_force(travel, speed, spring, damper, constants.effects)
    links = compute_links(force, load, travel, v, axle, curve, constants)
    dry, tilt = e("coulomb_friction", 0.0) / 0.01, e("force_tilt", 0.0)
    hidden = np.where(turns, 2.0 * np.abs(force), inertia / radius * spread(np.abs(spin), 2))
    hidden = hidden + flips * inertia / radius
    name = "anti_dive" if axle == "f" else "anti_lift"
    passes = abs(e(name, 0.0)) + abs(e(f"stick_{name}", 0.0))
    linked = hidden * (passes * car["cg_height"] / constants.wheelbase + tilt * np.abs(slope))
    return AxleForces(
        height=felt, slope=slope, rate=rate, rate_error=rate_error,
        load=np.where(squeeze > 0.0, damped, 0.0),
        vertical=load - tilt * force * slope,
        tyre_force=np.where(moves, grip(kappa), rest),
        torque=np.where(moves, torque, radius * force),
        torque_error=_bound_line_error(line, facts, constants) * gain,
        spin=spin, hidden=hidden, linked=linked + bound_lateral_hold(load, travel, v, curve.peak, constants.effects),
        strut=strut - links if axle == "f" else strut + links,
        strut_error=(damper * (1.0 + abs(e("damper_asymmetry", 0.0))) + dry) * rate_error,
    )  # fmt: skip


def _compare_with_reference(v: Floats, facts: Mapping[str, Any], constants: Constants) -> Floats:
    """Wet friction at each speed over that for which the clip's mu_c holds [1]."""
    surface = constants.surface
    if facts["weather"] not in WET or not grips_by_speed(surface):
        return np.ones(len(v))
    film = facts["film_depth_mm"]
    reference = compute_wet_friction(surface["wet_reference_speed"], film, surface)
    return compute_wet_friction(v, film, surface) / reference


def _drag_shaft(ticks: Mapping[str, Floats], moves: NDArray[np.bool_], constants: Constants) -> Floats:
    omega = ticks["wheel_speed_f"]
    turning = np.clip(omega / constants.car["lock_speed"], -1.0, 1.0)
    torque = compute_engine_torque(omega, constants.car["wheel_radius"], constants.effects) * turning
    return np.where(moves, torque, 0.0)


def _bound_line_error(line: Floats, facts: Mapping[str, Any], constants: Constants) -> Floats:
    """Error of the pressure at the pads: none where it is recorded, else an inner step's where the onset is a place."""
    if not (constants.effects.get("dead_time") or constants.effects.get("lag")):
        return np.zeros(len(line))
    by_place = constants.policy or (
        facts["brake_onset_m"] is not None and np.isfinite(facts["brake_onset_m"])
    )
    change = spread(np.abs(np.diff(line, prepend=line[:1])), 1)
    return np.asarray((0.5 if by_place else 1e-6) * change + 1e-9)


def _act_on_pads(clip: ClipColumns) -> Floats:
    """Pressure at the pads at each tick: the recorded one, or what a line with dead time and lag makes of it [MPa]."""
    ticks, facts, constants = clip
    dead = constants.effects.get("dead_time", 0.0)
    if dead == 0.0 and constants.effects.get("lag", 0.0) <= 0.0:
        return ticks["brake_pressure_mpa"]
    time = INNER_STEP * np.arange(2 * len(ticks["speed"]) - 1, dtype=np.float64)
    if constants.policy:
        recorded = ticks["brake_pressure_mpa"]
        commanded = np.interp(time - dead, DT * np.arange(len(recorded)), recorded)
        return delay_pressure(commanded, INNER_STEP, constants.effects)[::2]
    commanded = pressure_at(time - find_brake_onset(ticks, facts) - dead, *pressure_shape(facts))
    return delay_pressure(commanded, INNER_STEP, constants.effects)[::2]


def differentiate(values: Floats) -> tuple[Floats, Floats]:
    """Return the rate of a column at the ticks by differences, and the largest error that it may have [any/s].

    Parameters
    ----------
    values : [N], five ticks or more [any]
    """
    wide, near = np.gradient(values, DT), np.gradient(values, DT)
    wide[2:-2] = (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * DT)
    return wide, spread(np.abs(wide - near), 2)


def find_hits(ticks: Mapping[str, Floats], constants: Constants) -> NDArray[np.bool_]:
    """Return the ticks about which a wheel leaves the road or meets it within a tick, [N].

    Parameters
    ----------
    ticks : columns of the tick table
    constants : car and pavement
    """
    jumps = [
        np.abs(np.diff(ticks[f"axle_load_{axle}"], prepend=ticks[f"axle_load_{axle}"][:1]))
        > HIT * constants.static_load(axle)
        for axle in "fr"
    ]
    return spread((jumps[0] | jumps[1]).astype(float), 3) > 0


def spread(values: Floats, ticks: int) -> Floats:
    """Return the largest value within some ticks of each [N].

    Parameters
    ----------
    values : [N] [any]
    ticks : to either side [1]
    """
    return np.asarray(maximum_filter1d(values, 2 * ticks + 1, mode="nearest"))
