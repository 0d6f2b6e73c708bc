"""Laws of body and axles: the half-car of Appendix B from its stored columns.

Once a wheel has left the road, the tyres' forces are those in the sum of the responses to road and brake.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lsim

from studies.physics_judge.laws.constants import DT, ClipColumns, Constants, Floats, find_climb
from studies.physics_judge.laws.coupled import find_hits, spread
from studies.physics_judge.laws.half_step import INNER_STEP, HalfStep, find_brake_onset
from studies.physics_judge.laws.law import Law, evaluate_law, is_shaken, rounding_tolerance

STOP_PASS = 10
"""Largest distance between the stops of the last two fixed-point passes over a road feature; 6 occurred [ticks]."""
REFERENCE_S, TAIL_S, CAP_S = 0.6, 0.1, 0.2
"""Windows of the rule: reference before the hold, tail that is compared with it, and cap before the stop [s]."""
CAP_RATIO = 1.05
"""Cap over the reference [1]."""


def body_laws(clip: ClipColumns, half: HalfStep) -> list[Law | None]:
    """Return the laws of rates, the half-car's four equations and contact loads (paper, Eq. app_half_car_complete).

    Parameters
    ----------
    clip : what is judged
    half : state half a tick after each tick
    """
    ticks, facts, constants = clip
    car = constants.car
    z, dz, theta, dtheta = (ticks[c] for c in ("heave", "heave_rate", "pitch", "pitch_rate"))
    # the brake moment follows dv/dt, so its jumps within a few ticks change both rates
    shaken, hits = is_shaken(ticks, constants), find_hits(ticks, constants)
    literal = constants.steady_limit == 0 and facts["hazard_height_m"] != 0
    jumpy = _spread_maximum(_largest_input_changes(clip), STOP_PASS if literal else 3)
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
    moment = _brake_moment(clip, half)
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
    judged = _judged_rows(clip)
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


def _judged_rows(clip: ClipColumns) -> NDArray[np.bool_]:
    """Rows whose brake moment follows from the ticks [N]: all but those about a literal stop on a road feature.

    There the low-speed rule holds one sample of the last fixed-point pass but one, and the ticks are of the last.
    """
    ticks, facts, constants = clip
    judged = np.ones(len(ticks["speed"]), bool)
    standing = np.flatnonzero(ticks["speed"] <= 0)
    if standing.size and constants.held_share == 0 and facts["hazard_height_m"] != 0:
        tyre = constants.tyres[facts["weather"]]
        hold, release = (tyre.at(t, facts["surface_friction"]) for t in (tyre.hold_s, tyre.release_s))
        begin = int(standing[0]) - round(max(hold, CAP_S) / DT) - STOP_PASS
        judged[max(begin, 0) : int(standing[0]) + round(release / DT) + STOP_PASS] = False
    return judged


def _brake_moment(clip: ClipColumns, half: HalfStep) -> Floats:
    """Pitch moment of the brake at each tick (paper, Eq. app_brake_pitch), [N] [N m]."""
    facts, constants = clip.facts, clip.constants
    car, tyre = constants.car, constants.tyres[facts["weather"]]
    gamma = tyre.at(tyre.pitch_scale, facts["surface_friction"])
    gamma *= 1.0 if facts["hazard_height_m"] == 0 else car["coupled_pitch_scale"]
    deceleration = compute_pitching_deceleration(clip, half)
    moment: Floats = gamma * car["sprung_mass"] * car["cg_height"] * deceleration
    return moment


def _largest_input_changes(clip: ClipColumns) -> Floats:
    """Largest change within each tick of the acceleration that drives the brake moment, [N - 1] [m/s2]."""
    ticks, facts, constants = clip
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
    return spread(np.concatenate([swing[:1], np.maximum(swing[1:], swing[:-1]), swing[-1:]]), ticks)


def sum_contact_changes(
    ticks: Mapping[str, Floats], moment: Floats, constants: Constants
) -> dict[str, Floats]:
    """Return by how much both tyres push the axles more than at rest, by axle, [N] each.

    The paper adds the responses to the road alone and to the brake's moment alone (Appendix B). Each has its own
    contact with the road, whose load is never negative: in the air the road's response has lost its load, and the
    moment's still pushes. Where neither lifts, the sum is that of one half-car.

    Parameters
    ----------
    ticks : columns of the tick table
    moment : pitch moment of the brake at each tick [N m]
    constants : car and pavement
    """
    braked = follow_moment(moment, constants)
    changes = {}
    for axle in "fr":
        static, stiffness = constants.static_load(axle), constants.car[f"tyre_stiffness_{axle}"]
        own = np.maximum(static - stiffness * braked[axle], 0.0)
        squeeze = ticks[f"road_height_{axle}"] - (ticks[f"unsprung_heave_{axle}"] - braked[axle])
        changes[axle] = np.maximum(static + stiffness * squeeze, 0.0) + own - 2.0 * static
    return changes


def follow_moment(moment: Floats, constants: Constants) -> dict[str, Floats]:
    """Return the heave of both axles on a level road under a moment that starts at rest, by axle, [N] each [m].

    Parameters
    ----------
    moment : at each tick, linear between ticks [N m]
    constants : car and pavement
    """
    car = constants.car
    mass, inertia = car["sprung_mass"], car["pitch_inertia"]
    # states: heave, pitch, both axles' heave, and their rates; a row of `stretch` is a strut's length
    stretch = np.array([[1.0, -car["cg_to_front_axle"], -1.0, 0.0], [1.0, car["cg_to_rear_axle"], 0.0, -1.0]])
    weights = np.array([mass, inertia, car["unsprung_mass_f"], car["unsprung_mass_r"]])
    springs = np.diag([car[f"suspension_stiffness_{axle}"] for axle in "fr"])
    dampers = np.diag([car[f"suspension_damping_{axle}"] for axle in "fr"])
    tyres = np.diag([0.0, 0.0, car["tyre_stiffness_f"], car["tyre_stiffness_r"]])
    A = np.zeros((8, 8))
    A[:4, 4:] = np.eye(4)
    A[4:, :4] = -(stretch.T @ springs @ stretch + tyres) / weights[:, None]
    A[4:, 4:] = -(stretch.T @ dampers @ stretch) / weights[:, None]
    B = np.zeros((8, 1))
    B[5] = 1.0 / inertia
    C = np.eye(8)[2:4]
    _, heave, _ = lsim((A, B, C, np.zeros((2, 1))), moment, DT * np.arange(len(moment)))
    return {"f": heave[:, 0], "r": heave[:, 1]}


def compute_pitching_deceleration(clip: ClipColumns, half: HalfStep) -> Floats:
    """Return d_theta at each tick [N] [m/s2] (paper, Appendix B).

    Away from a stop it is the deceleration. Up to the stop, the rule holds the reference or caps the deceleration;
    after it, the held value decays to 0 over tau_r and stays there. On a grade it is the deceleration by the forces at
    the ground, which on an ascent hold the car also where it is not braked.

    Parameters
    ----------
    clip : what is judged
    half : state half a tick after each tick
    """
    ticks, facts, constants = clip
    v, a = ticks["speed"], ticks["longitudinal_acceleration"]
    climb, later_climb, _ = find_climb(ticks, constants)
    pitching: Floats = np.maximum(-a - climb, np.minimum(-climb, 0.0))
    standing = np.flatnonzero(v <= 0)
    onset = find_brake_onset(ticks, facts)
    if not constants.low_speed_rule or standing.size == 0 or standing[0] == 0 or not np.isfinite(onset):
        return pitching
    # two inner samples a tick: what the speed lost between two ticks tells the one between them
    tick = int(standing[0])
    inner, pull = np.zeros(2 * len(v) - 1), np.zeros(2 * len(v) - 1)
    inner[::2], pull[::2] = a, climb
    inner[1::2], pull[1::2] = np.diff(v) / INNER_STEP - a[:-1], later_climb
    between = v[tick - 1] + INNER_STEP * a[tick - 1]
    stop, speed = 2 * tick, between
    if between <= constants.car["stop_speed"]:
        stop, speed = 2 * tick - 1, v[tick - 1]
    else:  # the speed jumps to 0 in the step that ends here
        inner[stop - 1] = half.acceleration[tick - 1]
    d, rest = np.maximum(-inner - pull, np.minimum(-pull, 0.0)), -climb[tick]
    tyre = constants.tyres[facts["weather"]]
    hold_s, release_s = (tyre.at(t, facts["surface_friction"]) for t in (tyre.hold_s, tyre.release_s))

    def first_sample(before: float, start: int = stop) -> int:
        return max(start - round(before / INNER_STEP), 0)

    hold = max(min(round(onset / INNER_STEP), stop), first_sample(hold_s))
    earlier = d[first_sample(REFERENCE_S, hold) : hold]
    if not (earlier > 0).any():
        return pitching
    reference = np.median(earlier[earlier > 0])
    if np.median(d[first_sample(TAIL_S) : stop]) < constants.car["hold_ratio"] * reference:
        d[hold:stop] = reference
    else:
        capped = slice(first_sample(CAP_S), stop)
        d[capped] = np.minimum(d[capped], CAP_RATIO * reference)
    held = d[min(max(hold, first_sample(constants.held_share * hold_s)), stop - 1) : stop].mean()
    stop_time = stop * INNER_STEP
    if constants.steady_limit > 0:  # the stop lies within the step, where the speed falls below the threshold
        share = (speed - constants.car["stop_speed"]) / (-inner[stop - 1] * INNER_STEP)
        stop_time -= INNER_STEP * (1 - min(max(share, 0.0), 1.0))
    after = INNER_STEP * np.arange(stop, len(d)) - stop_time
    d[stop:] = rest + (held - rest) * np.maximum(1.0 - after / release_s, 0.0)
    return d[::2]
