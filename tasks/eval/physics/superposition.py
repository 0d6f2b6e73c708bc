"""Tyre forces in the sum of road and brake response, once a wheel has left the road."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.signal import lsim

from tasks.eval.physics.constants import DT, Constants, Floats, find_climb
from tasks.eval.physics.half_step import INNER_STEP, HalfStep, find_brake_onset

REFERENCE_S, TAIL_S, CAP_S = 0.6, 0.1, 0.2
"""Windows of the rule: reference before the hold, tail that is compared with it, and cap before the stop [s]."""
CAP_RATIO = 1.05
"""Cap over the reference [1]."""


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


def compute_pitching_deceleration(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants, half: HalfStep
) -> Floats:
    """Return d_theta at each tick [N] [m/s2] (paper, Appendix B).

    Away from a stop it is the deceleration. Up to the stop, the rule holds the reference or caps the deceleration;
    after it, the held value decays to 0 over tau_r and stays there. On a grade it is the deceleration by the forces at
    the ground, which on an ascent hold the car also where it is not braked.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    constants : car and pavement
    half : state half a tick after each tick
    """
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
