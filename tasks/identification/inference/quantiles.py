"""How many standard errors an interval of 95 % reaches."""

from scipy.special import ndtri

OUTSIDE = 0.025
"""Share beyond either end [1]."""
NORMAL_QUANTILE = float(ndtri(1.0 - OUTSIDE))
"""Standard deviations from the middle to an end of a normal distribution [1]."""
