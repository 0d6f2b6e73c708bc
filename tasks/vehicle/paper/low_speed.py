"""The low-speed pitch rule of paper mode: a steady brake-pitch input to the stop, and its release.

The rule needs the time of the stop, so it is applied after the drive; it changes neither speed nor distance. It leaves
open which value is held when the last 0.2 s were only capped. Taken literally that is the last sample, which chatters
with the slip; steadily it is the mean over the hold time.
"""

from dataclasses import dataclass
from math import isnan, nan

import numpy as np
from numpy.typing import NDArray

REFERENCE_WINDOW_S = 0.6
TAIL_WINDOW_S = 0.1
CAP_WINDOW_S = 0.2
CAP_RATIO = 1.05


@dataclass(frozen=True, kw_only=True)
class SteadyStop:
    """A stop whose end does not depend on one sample; without it the published rule is taken literally.

    Parameters
    ----------
    held_share : part of the hold time, up to the stop, over which the released deceleration is the mean [1]
    explicit_limit : longest explicit step of a wheel, in time constants of its slip; slower wheels step implicitly [1]
    pitch_rule : whether the rule replaces the deceleration that drives the pitch; without it none is replaced
    """

    held_share: float
    explicit_limit: float
    pitch_rule: bool = True


@dataclass(frozen=True, kw_only=True)
class BrakedStop:
    """The brake onset and the stop of a drive.

    Parameters
    ----------
    onset : brake onset; infinite if there is none [s]
    sample : sample of the stop; -1 if there is none
    time : of the stop, at or before that sample; None at that sample [s]
    """

    onset: float
    sample: int
    time: float | None = None


NO_STOP = BrakedStop(onset=np.inf, sample=-1)
"""A drive whose pitch follows the deceleration as it is."""


def find_rule_span(onset: float, stop: float, hold_s: float, release_s: float) -> tuple[float, float]:
    """Return the times between which the rule may put another deceleration in the place of the drive's [s].

    Parameters
    ----------
    onset, stop : brake onset and stop; both times are NaN where either is [s]
    hold_s, release_s : tau_h and tau_r [s]
    """
    if isnan(onset + stop):
        return nan, nan
    return max(min(max(onset, stop - hold_s), stop - CAP_WINDOW_S), 0.0), stop + release_s


def compute_brake_pitch_input(
    acceleration: NDArray[np.float64],
    step: float,
    braked: BrakedStop,
    *,
    climb: NDArray[np.float64] | None = None,
    hold_s: float,
    release_s: float,
    hold_ratio: float,
    held_share: float = 0.0,
) -> NDArray[np.float64]:
    """Return the deceleration d_theta that drives the body's pitch [m/s2] (paper, Appendix B, low-speed pitch rule).

    The reference is the median of the positive decelerations over the 0.6 s before the hold; without any the
    input stays as it is. On a grade the input is the deceleration that the forces at the ground cause, and what holds
    a car on its grade counts too: the least input and the end of the release are no longer 0, but those of that force.

    Parameters
    ----------
    acceleration : dv/dt on the internal grid, shape (n,) [m/s2]
    climb : deceleration that the grade causes, shape (n,); None on a level road [m/s2]
    step : grid interval [s]
    braked : when the brake begins, and the stop, with which the release begins
    hold_s : tau_h [s]
    release_s : tau_r [s]
    hold_ratio : rho_h [1]
    held_share : part of the hold time over which the released value is the mean; 0 takes the last sample [1]
    """
    d, rest = np.maximum(-acceleration, 0.0), 0.0
    stop = braked.sample
    if climb is not None:
        d, rest = np.maximum(-acceleration - climb, np.minimum(-climb, 0.0)), -float(climb[stop])
    if stop < 0 or not np.isfinite(braked.onset):
        return d

    def count_samples(seconds: float) -> int:
        return round(seconds / step)

    hold = max(min(count_samples(braked.onset), stop), stop - count_samples(hold_s))
    before = d[max(hold - count_samples(REFERENCE_WINDOW_S), 0) : hold]
    before = before[before > 0]
    if len(before) == 0:
        return d
    reference = float(np.median(before))
    tail = d[max(stop - count_samples(TAIL_WINDOW_S), 0) : stop]
    if np.median(tail) < hold_ratio * reference:
        d[hold:stop] = reference
    else:
        capped = slice(max(stop - count_samples(CAP_WINDOW_S), 0), stop)
        d[capped] = np.minimum(d[capped], CAP_RATIO * reference)
    first = min(max(hold, stop - count_samples(held_share * hold_s)), stop - 1)
    early = 0.0 if braked.time is None else stop * step - braked.time
    since_stop = np.arange(len(d) - stop) * step + early
    d[stop:] = rest + (d[first:stop].mean() - rest) * np.maximum(1 - since_stop / release_s, 0.0)
    return d
