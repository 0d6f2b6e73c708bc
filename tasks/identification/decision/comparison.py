"""Odds of one explanation against another: what the runs decide between them, less what no model knows so well."""

from math import copysign, inf, log

import numpy as np

from tasks.identification.decision.odds import (
    Explanation,
    RunGrams,
    weigh_explanation,
)
from tasks.identification.decision.random_effects import FEWEST, estimate_spread


def compare_explanations(
    grams: RunGrams, one: Explanation, other: Explanation, signature_error: float
) -> float:
    """Return the logarithm of the odds of one explanation against another [1].

    What the runs disagree about on the line from one to the other counts as a random effect there: two explanations
    that half of the runs decide either way are not distinguished, however much each run gains. The run that speaks most
    for the better one does not count. No model has the signature of an effect exactly as the car does; what its
    relative error leaves over is no evidence (model discrepancy, Kennedy and O'Hagan 2001,
    doi:10.1111/1467-9868.00294).

    Parameters
    ----------
    grams : of the runs
    one, other : the explanations
    signature_error : relative error of the signature of an effect [1]
    """
    used = np.flatnonzero((one.everything != 0.0) | (other.everything != 0.0))
    information = grams.information[:, used[:, None], used[None, :]]
    along = (other.everything - one.everything)[used]
    left = grams.score[:, used] - information @ (one.everything - grams.centre)[used]
    size, pull = np.einsum("i,rij,j->r", along, information, along), left @ along
    plain = float(np.sum(0.5 * size - pull))
    spread = estimate_spread(size, pull)
    informed = size > 0.0
    weight = np.zeros(len(size))
    weight[informed] = 1.0 / (1.0 / size[informed] + spread)
    estimate = np.divide(pull, size, out=np.zeros(len(size)), where=informed)
    by_run = weight * (0.5 - estimate)
    total = float(by_run.sum())
    if len(by_run) >= FEWEST and total:
        # no comparison hangs on one run
        side = float(np.sign(total))
        total = side * max(abs(total) - max(float((side * by_run).max()), 0.0), 0.0)
    prior = sum(m.log_prior for m in one.members) - sum(m.log_prior for m in other.members)
    whole = one.gain - other.gain + prior
    odds = whole - plain + total
    if odds * whole <= 0.0:
        # of two that the runs do not tell apart neither is the better for its fewer numbers
        return 0.0
    return temper_odds(odds, max(one.gain, other.gain), find_shared_gain(grams, one, other), signature_error)


def find_shared_gain(grams: RunGrams, one: Explanation, other: Explanation) -> float:
    """Return what the members that two explanations share gain alone [1].

    Parameters
    ----------
    grams : of the runs
    one, other : the explanations
    """
    shared = weigh_explanation(grams, [m for m in one.members if m in other.members], spread=False)
    return 0.0 if shared is None else shared.gain


def temper_odds(log_odds: float, gain: float, shared: float, signature_error: float) -> float:
    """Return the logarithm of odds without what errors of the signatures alone may make [1].

    What the error of a shared signature leaves over either explanation may take up. That of their own signatures moves
    the car along the line between them, and the odds are those of two normal distributions with that variance too.

    Parameters
    ----------
    log_odds : by the runs' noise alone [1]
    gain : rise of the log likelihood by the better explanation [1]
    shared : by the members that both have [1]
    signature_error : relative error of a signature in a model of the car [1]
    """
    square = signature_error**2
    left = max(abs(log_odds) - square * max(shared, 0.0), 0.0)
    return copysign(left / (1.0 + square * max(gain - max(shared, 0.0), 0.0)), log_odds)


def find_odds(log_odds: float) -> float:
    """Return odds from their logarithm, without overflow [1].

    Parameters
    ----------
    log_odds : logarithm of the odds [1]
    """
    return float(np.exp(min(log_odds, log(1e12)))) if log_odds > -inf else 0.0
