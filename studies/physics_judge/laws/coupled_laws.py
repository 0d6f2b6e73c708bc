"""Laws of the physical model: relations of columns at each tick, and integrals over one tick.

A relation holds to rounding. An integral is worked out from the rates at four ticks; its bound is what these rates
change beyond a straight line about the tick, since that is all that the logging interval hides.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from studies.physics_judge.laws.constants import DT, ClipColumns, Constants, Floats
from studies.physics_judge.laws.coupled import Forces, compute_forces, spread
from studies.physics_judge.laws.effects import AXLE, FORCE, HEAVE, PITCH, SUM, TORQUE
from studies.physics_judge.laws.half_step import INNER_STEP
from studies.physics_judge.laws.law import Law, evaluate_law, rounding_tolerance
from studies.physics_judge.laws.tyres import find_curve

HIDDEN = 1.5
"""Share of a rate's change of slope that an integral over a tick may miss: half where it jumps within, times 3 [1]."""
UNEQUAL = 0.01
"""Share of its integral by which a wheel's change of speed may miss it over a clip [1]."""
FAINT = 1e-5
"""Change of wheel speed in an interval that shows nothing of it [rad/s]."""
FEWEST = 20
"""Intervals that a ratio over all of them needs [1]."""
AROUND = 20
"""Ticks about a row whose largest force an error of second order of the inner step follows: a quarter of a hop [1]."""
SLIGHT = 5e-4
"""Share of the clip's largest force that is always unknown [1]."""
EDGE = 4
"""Ticks at either end where differences know the axle's rate less well [1]."""
STATES = "heave pitch heave_rate pitch_rate unsprung_heave_f unsprung_heave_r"
"""Columns that decide the struts' forces."""


def coupled_laws(clip: ClipColumns) -> list[Law | None]:
    """Return the laws of slip, tyre, brake, wheels, motion, road, contact and body of the physical model.

    Parameters
    ----------
    clip : what is judged
    """
    ticks, constants = clip.ticks, clip.constants
    forces = compute_forces(clip)
    return [
        *_axle_laws(clip, forces, "f"),
        *_axle_laws(clip, forces, "r"),
        *_motion_laws(clip, forces),
        *_body_laws(ticks, forces, constants),
    ]


def integral_law(
    name: str, columns: str, values: Floats, rate: Floats, hits: NDArray[np.bool_], *,
    rows: NDArray[np.bool_] | None = None, uncertainty: Floats | float = 0.0, floor: float = 0.0,
) -> Law | None:  # fmt: skip
    """Return the law that a column changes over each tick by the integral of its rate.

    Parameters
    ----------
    name, columns : as in ``evaluate_law``
    values, rate : [N] the column and its rate at the ticks [any, any/s]
    hits : [N] ticks about which the rate may jump to and fro
    rows : [N - 1] intervals that are judged; None for all
    uncertainty : [N] largest error of the rate itself [any/s]
    floor : rounding of the column [any]
    """
    inner, gained = np.concatenate([rate[:1], rate, rate[-1:]]), _integrate(rate)
    bend = spread(np.abs(np.diff(inner, 2)), 2)
    bend = bend + np.where(hits, spread(np.abs(np.diff(rate, prepend=rate[:1])), 3), 0.0)
    unsure = HIDDEN * bend + spread(np.broadcast_to(uncertainty, rate.shape), 1)
    unsure = np.where(hits, 4.0, 1.0) * unsure
    tolerance = DT * np.maximum(unsure[1:], unsure[:-1]) + floor
    tolerance = tolerance + 1e-9 * DT * np.abs(rate).max() + 1e-12 * np.abs(values).max()
    k = np.arange(len(values) - 1) if rows is None else np.flatnonzero(rows)
    law = evaluate_law(name, columns, (np.diff(values) - gained)[k], tolerance[k])
    return None if law is None else law.moved_to(k)


def balance_law(name: str, columns: str, values: Floats, rate: Floats, rows: NDArray[np.bool_]) -> Law | None:
    """Return the law that a column changes by the integral of its rate, as one ratio over all intervals.

    A wheel swings between ticks by more than its inertia does, so one interval says little. The ratio is the median of
    all, each weighted by its integral; its bound is `UNEQUAL` and the distance within which half of them lie.

    Parameters
    ----------
    name, columns : as in ``evaluate_law``
    values, rate : [N] the column and its rate at the ticks [any, any/s]
    rows : [N - 1] intervals that are judged
    """
    gained = _integrate(rate)
    k = np.flatnonzero(rows & (np.abs(gained) > FAINT))
    if k.size < FEWEST:
        return None
    missed, weight = np.diff(values)[k] / gained[k] - 1.0, np.abs(gained[k])
    middle = _find_weighted_median(missed, weight)
    apart = _find_weighted_median(np.abs(missed - middle), weight)
    return evaluate_law(name, columns, np.array([middle]), UNEQUAL + apart)


def _integrate(rate: Floats) -> Floats:
    """Integral of a rate over each interval by the rates at four ticks, [N - 1]."""
    inner = np.concatenate([rate[:1], rate, rate[-1:]])
    gained = DT / 24 * (13 * (inner[1:-2] + inner[2:-1]) - inner[:-3] - inner[3:])
    gained[[0, -1]] = DT / 2 * (rate[:-1] + rate[1:])[[0, -1]]
    return gained


def _find_weighted_median(values: Floats, weight: Floats) -> float:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def _axle_laws(clip: ClipColumns, forces: Forces, axle: str) -> list[Law | None]:
    ticks, facts, constants = clip
    car, curve, x, at = constants.car, find_curve(facts, constants), f"_{axle}", forces.axles[axle]
    v, omega, kappa = ticks["speed"], ticks[f"wheel_speed{x}"], ticks[f"braking_slip{x}"]
    load, torque = ticks[f"tyre_load{x}"], ticks[f"brake_torque{x}"]
    damping = constants.effects.get("tyre_damping", 0.0)
    jolt = DT * at.linked / car[f"unsprung_mass{x}"]
    slight = 3e-3 * np.abs(at.rate).max()
    part = slice(EDGE, -EDGE) if damping else slice(None)
    force = ticks[f"tyre_force{x}"]
    radius, floor = car["wheel_radius"], car["slip_speed_floor"]
    slip = np.clip((v - radius * omega) / np.maximum(v, floor), -1.0, 1.0)
    rolls = forces.moves[1:] & forces.moves[:-1]
    feature = "clips.hazard_height_m clips.hazard_center_m clips.hazard_length_m"
    tilted = "" if not constants.effects.get("force_tilt") else f" tyre_force{x}"
    return [
        evaluate_law(f"slip of wheel speed, {axle}", f"braking_slip{x} wheel_speed{x} speed", kappa - slip, 1e-9),
        evaluate_law(f"{FORCE}, {axle}", f"tyre_force{x} braking_slip{x} tyre_load{x} clips.tyre_peak",
            force - at.tyre_force, rounding_tolerance(force, load)),
        evaluate_law(f"{TORQUE}, {axle}", f"brake_torque{x} abs_scale{x} brake_pressure_mpa",
            torque - at.torque, rounding_tolerance(torque) + 1e-9 + at.torque_error),
        *_abs_laws(ticks, forces, axle, curve.target_slip, constants),
        balance_law(f"wheel torque balance, {axle}", f"wheel_speed{x} tyre_force{x} brake_torque{x} tyre_load{x}",
            omega, at.spin, rolls),
        evaluate_law(f"wheel starts rolling, {axle}", f"wheel_speed{x} clips.initial_speed_km_h",
            omega[:1] - facts["initial_speed_km_h"] / 3.6 / radius, 1e-9),
        evaluate_law(f"wheel stands with the car, {axle}", f"wheel_speed{x} speed", omega[~forces.moves], 1e-12),
        evaluate_law(f"road height as commanded, {axle}", f"road_height{x} station {feature}",
            ticks[f"road_height{x}"] - at.height, 1e-9 * (1.0 + abs(facts["hazard_height_m"]))),
        evaluate_law(f"contact load of tyre squeeze, {axle}", f"tyre_load{x} road_height{x} unsprung_heave{x}",
            (load - at.load)[part], (rounding_tolerance(load) + damping * (3 * at.rate_error + slight + jolt))[part]),
        evaluate_law(f"axle load of contact load, {axle}", f"axle_load{x} tyre_load{x}{tilted}",
            ticks[f"axle_load{x}"] - at.vertical, rounding_tolerance(load, force)),
        evaluate_law(f"contact is a load, {axle}", f"contact{x} axle_load{x}",
            (ticks[f"contact{x}"] != (ticks[f"axle_load{x}"] > 0)).astype(float), 0.5),
    ]  # fmt: skip


def _bound_rate_change(acceleration: Floats, unsure: Floats) -> Floats:
    """Largest change of a rate that a tick can hide, where its own rate jumps or is unsure, [N]."""
    return DT * (0.5 * spread(np.abs(np.diff(acceleration, prepend=acceleration[:1])), 1) + unsure)


def _abs_laws(
    ticks: Mapping[str, Floats], forces: Forces, axle: str, target: float, constants: Constants
) -> list[Law | None]:
    """Return the law of the ABS; with limited rates its bounds and its largest change a tick."""
    car, columns = constants.car, f"abs_scale_{axle} braking_slip_{axle}"
    q, width = ticks[f"abs_scale_{axle}"], car["abs_release_width"]
    asked = np.clip((target * (1 + width) - ticks[f"braking_slip_{axle}"]) / (width * target), 0.0, 1.0)
    asked = np.where(ticks["speed"] >= constants.effects.get("abs_cutoff", 0.0), asked, 1.0)
    asked = np.where(forces.moves, asked, 1.0)
    step, build, release = 0.5 * DT, car["abs_build_rate"], car["abs_release_rate"]
    if build * step >= 1 and release * step >= 1:
        return [evaluate_law(f"ABS command of slip, {axle}", columns, q - asked, 1e-7)]
    rolls = np.flatnonzero(forces.moves[1:] & forces.moves[:-1])
    gone = np.diff(q)[rolls]
    over = np.maximum(np.maximum(gone - build * DT, -gone - release * DT), 0.0)
    # it goes towards what is asked: beyond the band of both ticks it may not go
    low, high = (pick(asked[1:], asked[:-1])[rolls] for pick in (np.minimum, np.maximum))
    kept = q[1:][rolls]
    away = np.where(kept > np.maximum(high, q[:-1][rolls]), 1.0, 0.0) * (kept - high)
    away = away + np.where(kept < np.minimum(low, q[:-1][rolls]), 1.0, 0.0) * (low - kept)
    bend = spread(np.abs(np.diff(asked, 2, prepend=asked[:1], append=asked[-1:])), 2)[1:][rolls]
    return [
        evaluate_law(f"ABS within its rates, {axle}", columns, over, 1e-9),
        evaluate_law(f"ABS command of slip, {axle}", columns, away, 1e-9 + bend + max(build, release) * DT),
    ]


def _motion_laws(clip: ClipColumns, forces: Forces) -> list[Law | None]:
    ticks, facts, constants = clip
    s, v, a = ticks["station"], ticks["speed"], ticks["longitudinal_acceleration"]
    moves, road = forces.moves, ticks["road_force"]
    force = ticks["tyre_force_f"] + ticks["tyre_force_r"]
    rolls = moves[1:] & moves[:-1]
    start = facts["initial_speed_km_h"] / 3.6
    return [
        evaluate_law("time counts milliseconds", "t_ns", ticks["t_ns"] - 1e6 * np.arange(len(s)), 0.5),
        evaluate_law("station starts at zero", "station", s[:1], 1e-9),
        evaluate_law("speed starts as commanded", "speed clips.initial_speed_km_h", v[:1] - start, 1e-9),
        integral_law("station is the integral of speed", "station speed", s, v, forces.hits, rows=rolls,
            uncertainty=_bound_rate_change(a, forces.hidden / constants.mass), floor=1e-10),
        evaluate_law("station rests with the car", "station speed", np.diff(s)[~moves[:-1]], 1e-9),
        integral_law("speed is the integral of acceleration", "speed longitudinal_acceleration", v, a, forces.hits,
            rows=rolls, uncertainty=forces.hidden / constants.mass),
        evaluate_law(SUM, "longitudinal_acceleration tyre_force_f tyre_force_r road_force speed",
            a - forces.acceleration, rounding_tolerance(a, force / constants.mass, road / constants.mass)),
        evaluate_law("road force of load and slope", "road_force tyre_load_f tyre_load_r station"
            " clips.hazard_height_m clips.hazard_center_m clips.hazard_length_m",
            road - forces.road, rounding_tolerance(road) + 1e-6),
    ]  # fmt: skip


def _body_laws(ticks: Mapping[str, Floats], forces: Forces, constants: Constants) -> list[Law | None]:
    car, axles, hits = constants.car, forces.axles, forces.hits
    loads = "tyre_force_f tyre_force_r brake_torque_f brake_torque_r longitudinal_acceleration tyre_load_f tyre_load_r"
    error = sum(axles[axle].strut_error + axles[axle].linked for axle in "fr")
    arm = max(car["cg_to_front_axle"], car["cg_to_rear_axle"])
    stiffness = max(car[f"tyre_stiffness_{axle}"] + car[f"suspension_stiffness_{axle}"] for axle in "fr")
    hops = 3 * INNER_STEP**2 * stiffness / min(car["unsprung_mass_f"], car["unsprung_mass_r"])
    unsure_heave = error / car["sprung_mass"] + hops * spread(np.abs(forces.heave), AROUND)
    unsure_heave = unsure_heave + SLIGHT * np.abs(forces.heave).max()
    unsure_pitch = (arm * error + 2 * car["cg_height"] * forces.hidden) / car["pitch_inertia"]
    unsure_pitch = (
        unsure_pitch + hops * spread(np.abs(forces.pitch), AROUND) + SLIGHT * np.abs(forces.pitch).max()
    )
    z, theta, dz, dtheta = (ticks[name] for name in ("heave", "pitch", "heave_rate", "pitch_rate"))
    laws = [
        integral_law("heave is the integral of its rate", "heave heave_rate", z, dz, hits,
            uncertainty=_bound_rate_change(forces.heave, unsure_heave), floor=1e-12),
        integral_law("pitch is the integral of its rate", "pitch pitch_rate", theta, dtheta, hits,
            uncertainty=_bound_rate_change(forces.pitch, unsure_pitch), floor=1e-12),
        integral_law(HEAVE, f"heave_rate {STATES}", dz, forces.heave, hits, uncertainty=unsure_heave, floor=1e-11),
        integral_law(PITCH, f"pitch_rate {STATES} {loads}", dtheta, forces.pitch, hits, uncertainty=unsure_pitch,
            floor=1e-11),
        evaluate_law("body starts at rest", "heave pitch heave_rate pitch_rate",
            np.array([ticks[name][0] for name in ("heave", "pitch", "heave_rate", "pitch_rate")]), 1e-12),
    ]  # fmt: skip
    inner = np.zeros(len(z) - 1, bool)
    inner[EDGE:-EDGE] = True
    for axle in "fr":
        at, mass = axles[axle], car[f"unsprung_mass_{axle}"]
        push = (at.strut + ticks[f"axle_load_{axle}"] - constants.static_load(axle)) / mass
        laws.append(
            integral_law(f"{AXLE}, {axle}", f"heave_rate unsprung_heave_{axle} axle_load_{axle} {STATES}", at.rate,
                push, hits, rows=inner, floor=1e-9,
                uncertainty=(at.strut_error + at.linked) / mass + 2 * at.rate_error / DT
                + hops * spread(np.abs(push), AROUND) + SLIGHT * np.abs(push).max())
        )  # fmt: skip
    return laws
