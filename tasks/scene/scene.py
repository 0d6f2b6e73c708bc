"""A street one can drive: Gaussians, the route through them, and what lies beyond them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One reconstructed or generated street.

    Parameters
    ----------
    name : catalogue or folder name
    gaussians : the street itself
    route : P_0, the reference route of the rig
    environment : float32 [H, W, 3] linear light of the sky and far field, equirectangular:
        row 0 zenith, last row nadir; column centre = world +x, leftward columns toward +y [1]
    carriageway_left, carriageway_right : lateral extent of the carriageway from the route [m],
        left positive (y left): ``carriageway_right < 0 < carriageway_left``
    """

    name: str
    gaussians: Gaussians
    route: Route
    environment: NDArray[np.float32]
    carriageway_left: float
    carriageway_right: float
