"""Laws of body, axles, surface and outcome; the half-car of Appendix B from its stored columns."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.eval.physics.constants import DT, SURFACE_FORMS, Constants, Floats, derive_surface
from tasks.eval.physics.coupled import find_hits, spread
from tasks.eval.physics.half_step import INNER_STEP, HalfStep, find_brake_onset
from tasks.eval.physics.laws import Law, evaluate_law, is_shaken, rounding_tolerance
from tasks.eval.physics.superposition import CAP_S, compute_pitching_deceleration, sum_contact_changes

ROUND = 1e-9
"""Relative rounding of closed forms [1]."""

STOP_PASS = 10
"""Largest distance between the stops of the last two fixed-point passes over a road feature; 6 occurred [ticks]."""


def body_laws(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants, half: HalfStep
) -> list[Law | None]:
    """Return the laws of rates, the half-car's four equations and contact loads (paper, Eq. app_half_car_complete).

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    constants : car and pavement
    half : state half a tick after each tick
    """
    car = constants.car
    z, dz, theta, dtheta = (ticks[c] for c in ("heave", "heave_rate", "pitch", "pitch_rate"))
    # the brake moment follows dv/dt, so its jumps within a few ticks change both rates
    shaken, hits = is_shaken(ticks, constants), find_hits(ticks, constants)
    literal = constants.steady_limit == 0 and facts["hazard_height_m"] != 0
    jumpy = _spread_maximum(_largest_input_changes(ticks, facts, constants), STOP_PASS if literal else 3)
    pitch_input = 1.3 * car["sprung_mass"] * car["cg_height"] / car["pitch_inertia"]
    laws: list[Law | None] = []
    for name, x, dx, per_jump in (("heave", z, dz, 0.05), ("pitch", theta, dtheta, pitch_input)):
        step = x[2:] - x[:-2] - DT / 3 * (dx[2:] + 4 * dx[1:-1] + dx[:-2])
        bend = spread(np.abs(np.diff(dx, 2)), 2)
        tolerance = DT * (DT * per_jump * jumpy[1:-1] + 0.1 * bend + 1e-6 * np.abs(dx).max()) + 1e-12
        laws.append(
            evaluate_law(f"{name} is the integral of its rate", f"{name} {name}_rate", step, tolerance)
        )

    forces: dict[str, Floats] = {}
    moment = _brake_moment(ticks, facts, constants, half)
    pushed = sum_contact_changes(ticks, moment, constants) if shaken else {}
    for axle, lever in (("f", -car["cg_to_front_axle"]), ("r", car["cg_to_rear_axle"])):
        u = ticks[f"unsprung_heave_{axle}"]
        du = np.full_like(u, np.nan)
        du[2:-2] = (u[:-4] - 8 * u[1:-3] + 8 * u[3:-1] - u[4:]) / (12 * DT)
        forces[axle] = car[f"suspension_stiffness_{axle}"] * (z - u + lever * theta) + car[
            f"suspension_damping_{axle}"
        ] * (dz - du + lever * dtheta)
        load, static = ticks[f"axle_load_{axle}"], constants.static_load(axle)
        squeeze = car[f"tyre_stiffness_{axle}"] * (ticks[f"road_height_{axle}"] - u)
        laws.append(
            evaluate_law(f"contact load of tyre squeeze, {axle}",
                f"axle_load_{axle} road_height_{axle} unsprung_heave_{axle}",
                load - np.maximum(static + squeeze, 0.0), rounding_tolerance(load))
        )  # fmt: skip
        laws.append(
            evaluate_law(f"contact is a load, {axle}", f"contact_{axle} axle_load_{axle}",
                (ticks[f"contact_{axle}"] != (load > 0)).astype(float), 0.5)
        )  # fmt: skip
        mass = car[f"unsprung_mass_{axle}"]
        inner = slice(3, -3)
        bend = (u[2:] - 2 * u[1:-1] + u[:-2])[2:-2] / DT**2
        push = forces[axle] + pushed.get(axle, load - static)
        size = np.abs(load - static).max() + np.abs(forces[axle][inner]).max() + 1e-6
        laws.append(
            evaluate_law(f"axle's own motion, {axle}",
                f"axle_load_{axle} unsprung_heave_{axle} heave pitch heave_rate pitch_rate",
                mass * bend - push[inner],
                5e-3 * size + mass * 5 * jumpy[inner] + 0.5 * spread(np.abs(np.diff(push, 2))[2:-2], 2)
                + np.where(hits, spread(np.abs(np.diff(push, prepend=push[:1])), 3), 0.0)[inner])
        )  # fmt: skip
    judged = _judged_rows(ticks, facts, constants)
    laws += _sprung_laws(dz, dtheta, forces, moment, judged, constants, jumpy, hits)
    return laws


def _sprung_laws(
    dz: Floats, dtheta: Floats, forces: Mapping[str, Floats], moment: Floats, judged: NDArray[np.bool_],
    constants: Constants, jumpy: Floats, hits: NDArray[np.bool_],
) -> list[Law | None]:  # fmt: skip
    car = constants.car
    up = -(forces["f"] + forces["r"]) / car["sprung_mass"]
    nose = car["cg_to_front_axle"] * forces["f"] - car["cg_to_rear_axle"] * forces["r"] + moment
    nose = nose / car["pitch_inertia"]
    laws = []
    every = np.ones(len(dz), bool)
    for name, rate, acceleration, rows, per_jump in (
        ("heave", dz, up, every, 0.05), ("pitch", dtheta, nose, judged, 1.0),
    ):  # fmt: skip
        k = np.flatnonzero(rows[3:-3]) + 3
        step = rate[k + 1] - rate[k - 1]
        drive = DT / 3 * (acceleration[k + 1] + 4 * acceleration[k] + acceleration[k - 1])
        size = np.abs(acceleration[3:-3]).max() if len(k) else 0.0
        met = np.where(hits, spread(np.abs(np.diff(acceleration, prepend=acceleration[:1])), 3), 0.0)
        tolerance = DT * (per_jump * jumpy[k] + met[k] + 1e-3 * size) + 1e-10
        columns = f"{name}_rate heave pitch heave_rate pitch_rate unsprung_heave_f unsprung_heave_r"
        braking = " longitudinal_acceleration" if name == "pitch" else ""
        laws.append(evaluate_law(f"body's {name} equation", columns + braking, step - drive, tolerance))
    return laws


def _judged_rows(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants
) -> NDArray[np.bool_]:
    """Rows whose brake moment follows from the ticks [N]: all but those about a literal stop on a road feature.

    There the low-speed rule holds one sample of the last fixed-point pass but one, and the ticks are of the last.
    """
    judged = np.ones(len(ticks["speed"]), bool)
    standing = np.flatnonzero(ticks["speed"] <= 0)
    if standing.size and constants.held_share == 0 and facts["hazard_height_m"] != 0:
        tyre = constants.tyres[facts["weather"]]
        hold, release = (tyre.at(t, facts["surface_friction"]) for t in (tyre.hold_s, tyre.release_s))
        begin = int(standing[0]) - round(max(hold, CAP_S) / DT) - STOP_PASS
        judged[max(begin, 0) : int(standing[0]) + round(release / DT) + STOP_PASS] = False
    return judged


def _brake_moment(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants, half: HalfStep
) -> Floats:
    """Pitch moment of the brake at each tick (paper, Eq. app_brake_pitch), [N] [N m]."""
    car, tyre = constants.car, constants.tyres[facts["weather"]]
    gamma = tyre.at(tyre.pitch_scale, facts["surface_friction"])
    gamma *= 1.0 if facts["hazard_height_m"] == 0 else car["coupled_pitch_scale"]
    deceleration = compute_pitching_deceleration(ticks, facts, constants, half)
    moment: Floats = gamma * car["sprung_mass"] * car["cg_height"] * deceleration
    return moment


def _largest_input_changes(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants
) -> Floats:
    """Largest change within each tick of the acceleration that drives the brake moment, [N - 1] [m/s2]."""
    v, a = ticks["speed"], ticks["longitudinal_acceleration"]
    between = np.diff(v) / INNER_STEP - a[:-1]
    swing = np.maximum(np.abs(between - a[:-1]), np.abs(a[1:] - between))
    standing = np.flatnonzero(v <= 0)
    if standing.size:
        tyre = constants.tyres[facts["weather"]]
        hold, release = (tyre.at(t, facts["surface_friction"]) for t in (tyre.hold_s, tyre.release_s))
        # the low-speed rule starts, caps, releases and ends its input at these times before the stop
        for before in (hold, CAP_S, 0.0, -release):
            k = min(max(int(standing[0]) - round(before / DT), 1), len(swing) - 1)
            swing[max(k - 1, 0) : k + 1] = np.abs(a).max()
    return swing


def _spread_maximum(swing: Floats, ticks: int) -> Floats:
    """Largest change within the given number of ticks of each tick, [N] from [N - 1]."""
    wide = np.concatenate([swing[:1], np.maximum(swing[1:], swing[:-1]), swing[-1:]])
    padded = np.pad(wide, ticks, mode="edge")
    return np.max(np.lib.stride_tricks.sliding_window_view(padded, 2 * ticks + 1), axis=1)


def surface_laws(facts: Mapping[str, Any], constants: Constants) -> list[Law | None]:
    """Film, snow, friction and the tyre's peak, mu_eff = eta mu_c (paper, Appendix E).

    Parameters
    ----------
    facts : the clip's row
    constants : car and pavement
    """
    expected = derive_surface(
        facts["weather"], facts["precipitation_mm_h"], facts["snow_accumulation_h"], constants.surface
    )
    feeds = SURFACE_FORMS[facts["weather"]].feeds
    tyre = constants.tyres[facts["weather"]]
    eta = tyre.at(tyre.efficiency, facts["surface_friction"])
    laws = [
        evaluate_law(f"{name} of the precipitation", f"clips.{name} {feeds.get(name, '')}",
            np.array([facts[name] - value]), ROUND * (1 + abs(value)))
        for name, value in expected.items()
    ]  # fmt: skip
    peak = np.array([facts["tyre_peak"] - eta * facts["surface_friction"]])
    laws.append(evaluate_law("mu_eff is eta mu_c", "clips.tyre_peak clips.surface_friction", peak, ROUND))
    return laws


def outcome_laws(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants
) -> list[Law | None]:
    """Return the laws of stop, distance, peaks, ABS and wheel lift, each computed again.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    constants : car and pavement
    """
    s, v, pitch = ticks["station"], ticks["speed"], ticks["pitch"]
    laws = [
        evaluate_law("peak pitch is the largest", "clips.peak_pitch pitch", pitch.max() - facts["peak_pitch"], 1e-12),
        evaluate_law("peak deceleration is the largest", "clips.peak_deceleration longitudinal_acceleration",
            max(0.0, -ticks["longitudinal_acceleration"].min()) - np.array([facts["peak_deceleration"]]), 1e-12),
        evaluate_law("peak pitch rate is the largest", "clips.peak_pitch_rate pitch_rate",
            np.abs(ticks["pitch_rate"]).max() - np.array([facts["peak_pitch_rate"]]), 1e-12),
        evaluate_law("peak slip is the larger axle's", "clips.peak_slip braking_slip_f braking_slip_r",
            max(ticks[f"braking_slip_{axle}"].max() for axle in "fr") - np.array([facts["peak_slip"]]), 1e-12),
        evaluate_law("ABS time is time of a reduced torque", "clips.abs_time abs_scale_f abs_scale_r",
            np.array([facts["abs_time"] - DT * np.sum((ticks["abs_scale_f"] < 1) | (ticks["abs_scale_r"] < 1))]),
            0.5 * DT),
        evaluate_law("static pitch is the car's", "clips.static_pitch",
            np.array([facts["static_pitch"] - constants.car["static_pitch"]]), 1e-9),
    ]  # fmt: skip
    laws += [
        evaluate_law(f"wheel lift is time without contact, {axle}", f"clips.wheel_lift_time_{axle} contact_{axle}",
            np.array([facts[f"wheel_lift_time_{axle}"] - DT * np.sum(np.asarray(ticks[f"contact_{axle}"]) < 0.5)]),
            0.5 * DT)
        for axle in "fr"
    ]  # fmt: skip
    standing = np.flatnonzero(v <= 0)
    if standing.size:
        laws.append(
            evaluate_law("stop time is the first standing tick", "clips.stop_time speed",
                np.array([facts["stop_time"] - DT * standing[0]]), DT)
        )  # fmt: skip
        onset = find_brake_onset(ticks, facts)
        if np.isfinite(onset):
            way = s[-1] - np.interp(onset, DT * np.arange(len(s)), s)
            laws.append(
                evaluate_law("stopping distance from the onset", "clips.stopping_distance station",
                    np.array([facts["stopping_distance"] - way]), 1e-5)
            )  # fmt: skip
    return laws
