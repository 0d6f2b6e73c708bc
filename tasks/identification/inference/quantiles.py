"""How many standard errors an interval of 95 % reaches."""

from scipy.special import ndtri, stdtrit

OUTSIDE = 0.025
"""Share beyond either end [1]."""
NORMAL_QUANTILE = float(ndtri(1.0 - OUTSIDE))
"""Standard deviations from the middle to an end of a normal distribution [1]."""


def compute_student_quantile(runs: int) -> float:
    """Return the standard errors from the middle to an end by Student's t: one degree of freedom less than runs [1].

    Parameters
    ----------
    runs : that inform a number
    """
    return float(stdtrit(max(runs - 1, 1), 1.0 - OUTSIDE))
