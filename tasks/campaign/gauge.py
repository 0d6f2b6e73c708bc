"""The pressure that drives the model: the gauge's reading without the gauge's noise.

The model brakes with the measured pressure, but the car did not brake with the gauge's noise. If it stays in, a fit
finds effects that only filter it out again: lags, delays, functions of the pressure's rate (errors in variables:
Fuller 1987, doi:10.1002/9780470316665).
"""

import numpy as np
from numpy.typing import NDArray

RESTING_PRESSURE = 0.02
"""Mean over `RESTING_SPAN` samples below which the brake is taken to be off [MPa]."""
RESTING_SPAN = 7
LAG = 4
"""Lag in samples at which the gauge's noise counts as independent: valid up to a correlation of about 0.6."""
LONGEST = 0.8
"""Correlation above which a change from sample to sample comes from the driver and is no noise [1]."""
NORMAL = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""
HALF_WIDTHS = (1, 2, 4, 8, 16, 32)
"""Half widths of the windows of the mean that are tried [samples]."""
AGREEING = 1.2
"""Half width of the intervals that must intersect, in standard deviations of each mean. Of 0.4, 0.8, 1.2 and 2 it gives
the best prediction of held-out runs on campaigns without a missing effect. A larger one rounds the corners of ramps,
and the estimated brake gain is up to 1 % too high."""


def zero_pressure_at_rest(measured: NDArray[np.float64]) -> NDArray[np.float64]:
    """Set the pressure to 0 where the brake is off: a gauge that cannot read below 0 turns noise into pressure.

    Parameters
    ----------
    measured : float64 [N] [MPa] at a fixed rate
    """
    return np.where(_compute_moving_mean(measured, RESTING_SPAN // 2) < RESTING_PRESSURE, 0.0, measured)


def denoise_pressure(measured: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the brake pressure without the gauge's noise, with its ramps and steps.

    About every sample the mean is taken over a symmetric window, which preserves slopes: the widest one whose
    confidence interval still intersects those of all narrower ones (intersection of confidence intervals: Goldenshluger
    and Nemirovski 1997, Mathematical Methods of Statistics 6:135; Katkovnik 1999, doi:10.1109/78.782197).

    Parameters
    ----------
    measured : float64 [N] [MPa] at a fixed rate

    Returns
    -------
    float64 [N] [MPa], 0 where the brake is off
    """
    best = zero_pressure_at_rest(measured)
    alive = best > 0.0
    sigma, rho = estimate_gauge_noise(measured[alive])
    if sigma == 0.0:
        return best
    low, high = measured - AGREEING * sigma, measured + AGREEING * sigma
    for half in HALF_WIDTHS:
        mean = _compute_moving_mean(measured, half)
        n = 2 * half + 1
        k = np.arange(1, n)
        spread = sigma * np.sqrt((1.0 + 2.0 * np.sum((1.0 - k / n) * rho**k)) / n)
        low, high = np.maximum(low, mean - AGREEING * spread), np.minimum(high, mean + AGREEING * spread)
        alive &= low <= high
        alive[:half], alive[-half:] = False, False
        best = np.where(alive, mean, best)
    return best


def estimate_gauge_noise(pressure: NDArray[np.float64]) -> tuple[float, float]:
    """Return standard deviation [MPa] and correlation from sample to sample [1] of the gauge's noise.

    Both follow from differences of first-order autoregressive noise; medians leave out the corners of ramps. The
    variance of second differences is (6 - 8 rho + 2 rho^2) sigma^2 at lag 1 and 6 sigma^2 at `LAG`: their ratio gives
    rho. That of fourth differences, which the driver's foot hardly affects, is
    (70 - 112 rho + 56 rho^2 - 16 rho^3 + 2 rho^4) sigma^2. (0, 0) where there are too few samples or no noise.

    Parameters
    ----------
    pressure : float64 [N] [MPa] while the brake is on
    """
    if len(pressure) <= 4 * LAG:
        return 0.0, 0.0
    second = pressure[2:] - 2.0 * pressure[1:-1] + pressure[:-2]
    near, fourth = _measure_robust_deviation(second), _measure_robust_deviation(np.diff(second, 2))
    far = _measure_robust_deviation(pressure[2 * LAG :] - 2.0 * pressure[LAG:-LAG] + pressure[: -2 * LAG])
    if far == 0.0:
        return 0.0, 0.0
    share = min((near / far) ** 2, 1.0)
    rho = min(2.0 - float(np.sqrt(1.0 + 3.0 * share)), LONGEST)
    return fourth / float(np.sqrt(np.polyval((2.0, -16.0, 56.0, -112.0, 70.0), rho))), rho


def _compute_moving_mean(x: NDArray[np.float64], half: int) -> NDArray[np.float64]:
    n = 2 * half + 1
    return np.convolve(np.pad(x, half, mode="edge"), np.ones(n) / n, mode="valid")


def _measure_robust_deviation(x: NDArray[np.float64]) -> float:
    return NORMAL * float(np.median(np.abs(x)))
