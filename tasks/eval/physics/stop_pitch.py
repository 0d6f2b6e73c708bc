"""The deceleration that pitches the body up to a stop and after it, from the ticks (paper, low-speed pitch rule)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tasks.eval.physics.constants import Constants, Floats, find_climb
from tasks.eval.physics.half_step import INNER_STEP, HalfStep, find_brake_onset

REFERENCE_S, TAIL_S, CAP_S = 0.6, 0.1, 0.2
"""Windows of the rule: reference before the hold, tail that is compared with it, and cap before the stop [s]."""
CAP_RATIO = 1.05
"""Cap over the reference [1]."""


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
