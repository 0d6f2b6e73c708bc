"""The throttle at rest: a sensor that reads more than 0 while the driver's foot is on the brake.

Throttle plates and pedals of many cars idle at 0.1 to 0.2. Taken as logged, the engine would drive the car through
every stop, and a fit would find an engine that holds it back.
"""

from collections.abc import Sequence

import numpy as np

from tasks.campaign.campaign import Run

APPLIED = 0.5
"""Share of a run's range of pressure, from its lowest, above which its brake is applied [1]."""
LEAST_RANGE = 0.1
"""Range of pressure from which a run brakes at all [MPa]."""
LOWEST, HIGHEST = 0.02, 0.3
"""Throttle from which and up to which it may rest: sensors are off by less, a foot on both pedals reads more [1]."""


def find_throttle_rest(runs: Sequence[Run]) -> float:
    """Return what the throttle reads while the brake is applied, the median over runs; 0 if it does not rest [1].

    Parameters
    ----------
    runs : that may be looked at
    """
    read = []
    for run in runs:
        lowest, span = float(np.min(run.pressure)), float(np.ptp(run.pressure))
        if run.throttle is not None and span > LEAST_RANGE:
            read.append(float(np.median(run.throttle[run.pressure > lowest + APPLIED * span])))
    rest = float(np.median(read)) if read else 0.0
    return rest if LOWEST < rest <= HIGHEST else 0.0
