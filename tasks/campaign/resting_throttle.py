"""The throttle at rest: a sensor that reads more than 0 while the driver's foot is on the brake.

Throttle plates and pedals of many cars idle at 0.1 to 0.2. Taken as logged, the engine would drive the car through
every stop, and a fit would find an engine that holds it back.
"""

from collections.abc import Sequence

import numpy as np

from tasks.campaign.campaign import Run

APPLIED = 0.1
"""Share of a run's largest pressure from which its brake is applied [1]."""
HIGHEST = 0.3
"""Throttle up to which it may rest; a foot that holds both pedals reads more [1]."""


def find_throttle_rest(runs: Sequence[Run]) -> float:
    """Return what the throttle reads while the brake is applied, the median of all runs; 0 if it does not rest [1].

    Parameters
    ----------
    runs : that may be looked at
    """
    braking = [
        run.throttle[run.pressure > APPLIED * run.pressure.max()] for run in runs if run.throttle is not None
    ]
    read = np.concatenate(braking) if braking else np.empty(0)
    rest = float(np.median(read)) if read.size else 0.0
    return rest if 0.0 < rest <= HIGHEST else 0.0
