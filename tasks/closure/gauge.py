"""What the noise of the pressure gauge can feign.

The model brakes with the pressure that was measured, noise included; the car did not. A form of the pressure's rate can
filter that noise out again, and so explains a little in every run without any such effect in the car (errors in
variables: Fuller 1987, doi:10.1002/9780470316665).
"""

from collections.abc import Sequence

import numpy as np

from tasks.closure.attribution import Candidate
from tasks.closure.campaign import Run
from tasks.closure.noise import QUIET_PRESSURE

LAG = 4
"""Samples apart at which the gauge's noise is nearly independent and a pressure that is held has not moved."""
NORMAL = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""
BEYOND_NOISE = 4.0
"""A form of the pressure's rate must change torque or friction by so many standard deviations of the gauge's noise."""


def pressure_noise_share(runs: Sequence[Run]) -> float:
    """Standard deviation of the gauge's noise over the median brake pressure [1]; 0 where no run brakes.

    Parameters
    ----------
    runs : with the pressure as measured
    """
    pressed = [run.pressure[run.pressure > QUIET_PRESSURE] for run in runs]
    pressed = [pressure for pressure in pressed if len(pressure) > LAG]
    if not pressed:
        return 0.0
    steps = np.concatenate([pressure[LAG:] - pressure[:-LAG] for pressure in pressed])
    sigma = NORMAL * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2.0)
    return sigma / float(np.median(np.concatenate(pressed)))


def is_feigned(candidate: Candidate, runs: Sequence[Run]) -> bool:
    """Whether a form is no more than the noise of the pressure could make it.

    Parameters
    ----------
    candidate : what may be added
    runs : that it was fitted to
    """
    hypothesis = candidate.hypothesis
    if hypothesis.variable != "pressure_rate" or hypothesis.port not in ("brake_torque", "friction"):
        return False
    _, slots = hypothesis.build(candidate.fitted.values[-len(hypothesis.names) :])
    change = max(float(np.ptp(slot.values)) for slot in slots)
    return change < BEYOND_NOISE * pressure_noise_share(runs)
