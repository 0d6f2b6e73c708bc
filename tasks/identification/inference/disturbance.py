"""Prior of a run's offsets and smooth disturbances, as a precision matrix."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import Tolerances

DISTURBED = ("longitudinal_force", "friction", "pitch_moment")
KNOT_SPACING = (0.15, 0.25, 0.1)
"""Spacing of the disturbance's knots at each port: finer than any disturbance seen in brake tests [s]."""
N_OFFSETS = 4
INITIAL_SPEED, FRICTION, ACCELERATION_BIAS, PITCH_OFFSET = range(N_OFFSETS)
"""Places of a run's own offsets, which precede its disturbances [m/s, 1, m/s2, deg]."""


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """Scale and correlation time of the smooth disturbances, in the order of `DISTURBED`.

    Parameters
    ----------
    scale : standard deviations [N, 1, N m]
    time : correlation times [s]
    """

    scale: tuple[float, float, float] = (60.0, 0.01, 60.0)
    time: tuple[float, float, float] = (1.0, 0.25, 0.2)


def compute_prior_precision(
    knots: tuple[int, ...], tolerances: Tolerances, disturbance: Disturbance
) -> tuple[NDArray[np.float64], float]:
    """Return the prior precision of a run's offsets and disturbance knots.

    The disturbances are first-order Gauss-Markov processes.

    Parameters
    ----------
    knots : number of knots at each disturbed port
    tolerances : prior standard deviations of the offsets
    disturbance : scales and correlation times

    Returns
    -------
    Precision, float64 [D, D], and its log determinant.
    """
    size = N_OFFSETS + sum(knots)
    precision = np.zeros((size, size))
    sigmas = (
        tolerances.initial_speed,
        tolerances.friction,
        tolerances.acceleration_bias,
        tolerances.pitch_offset,
    )
    precision[np.arange(N_OFFSETS), np.arange(N_OFFSETS)] = 1.0 / np.square(sigmas)
    log_det = -2.0 * float(np.sum(np.log(sigmas)))
    at = N_OFFSETS
    for count, spacing, scale, time in zip(
        knots, KNOT_SPACING, disturbance.scale, disturbance.time, strict=True
    ):
        r = np.exp(-spacing / time)
        block = np.zeros((count, count))
        i = np.arange(count)
        block[i, i] = 1.0 + r**2
        block[0, 0] = block[-1, -1] = 1.0
        block[i[:-1], i[1:]] = block[i[1:], i[:-1]] = -r
        precision[at : at + count, at : at + count] = block / (scale**2 * (1.0 - r**2))
        log_det -= 2.0 * count * np.log(scale) + (count - 1) * np.log(1.0 - r**2)
        at += count
    return precision, log_det
