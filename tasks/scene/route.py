"""The reference route P_0(s): rig poses along arc length."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Route:
    """Rig poses on the road, sampled along the route.

    The rig frame is ISO 8855 (x forward, y left, z up) with its origin on the road surface under
    the middle of the front axle of the undisturbed vehicle.

    Parameters
    ----------
    station : float64 [M] strictly increasing arc length, starting at 0 [m]
    T_world_rig : float64 [M, 4, 4] rig-to-world poses
    """

    station: NDArray[np.float64]
    T_world_rig: NDArray[np.float64]

    @property
    def length(self) -> float:
        """Arc length [m]."""
        return float(self.station[-1])
