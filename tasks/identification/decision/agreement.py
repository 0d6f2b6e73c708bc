"""Whether the runs agree: on the size of what an explanation names, and with the model whatever it names."""

from math import sqrt

import numpy as np

from tasks.campaign.campaign import FILE_NUMBERS
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.odds import Explanation, RunGrams
from tasks.identification.decision.random_effects import FEWEST, INFORMED

LEAST_SIZE = 0.5
"""Square of the smallest size that matters, over its variance by one run, from which the run tells a number [1]."""
SURE = 3.0
"""Standard errors by which a scatter of the runs is more than noise [1]."""


def is_one_size(grams: RunGrams, explanation: Explanation, member: Candidate, scatter: float) -> bool:
    """Return whether a member has one size in all runs, but for a scatter and for noise (Cochran's Q at three sigma).

    Parameters
    ----------
    grams : of the runs
    explanation : that it belongs to
    member : one of its members
    scatter : standard deviation from run to run that the signature of an effect may have, over its size [1]
    """
    used = np.flatnonzero(explanation.everything != 0.0)
    own = np.array(member.columns)
    along = explanation.everything[own]
    information = along @ grams.information[:, own[:, None], used]
    size = grams.information[:, own[:, None], own] @ along @ along
    pull = grams.score[:, own] @ along - information @ (explanation.everything - grams.centre)[used]
    informed = size > INFORMED * max(float(size.max()), 1e-300)
    weight, estimate = 1.0 / (1.0 / size[informed] + scatter**2), pull[informed] / size[informed]
    left = estimate - float(weight @ estimate) / float(weight.sum())
    freedom = len(left) - 1
    return freedom < FEWEST - 1 or float(weight @ left**2) <= freedom + SURE * sqrt(2.0 * freedom)


def measure_disagreement(grams: RunGrams, explanation: Explanation) -> float:
    """Return by how much the runs disagree with the model, whatever the explanation names [1].

    Under a correct model the score of a run in the direction of any number is standard normal (Cochran 1954,
    doi:10.2307/3001666). Returned is the median over the numbers of the table of its mean square over runs; 1 is noise.

    Parameters
    ----------
    grams : of the runs
    explanation : whose residual is taken
    """
    numbers = grams.columns.base[: -len(FILE_NUMBERS)]
    size = np.einsum("rii->ri", grams.information)[:, numbers]
    used = np.flatnonzero(explanation.everything != 0.0)
    moved = (explanation.everything - grams.centre)[used]
    left = grams.score[:, numbers] - grams.information[:, numbers[:, None], used[None, :]] @ moved
    matters = np.array(
        [next(c.matters for c in grams.columns.candidates if c.columns == (n,)) for n in numbers]
    )
    large = size * matters**2 > LEAST_SIZE
    square = np.where(large, left**2 / np.maximum(size, 1e-300), 0.0).sum(axis=0)
    count = large.sum(axis=0)
    enough = count > FEWEST
    return float(np.median(square[enough] / count[enough])) if enough.any() else 1.0
