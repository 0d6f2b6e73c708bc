"""The road as one frame shows it: which pixels, how far, and how its surface lies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class RoadView:
    """The road pixels of one frame, and the camera that sees them.

    Parameters
    ----------
    road : bool [H, W] pixels of the road
    mirrors : bool [H, W] those of them whose mirrored light is computed, one by one
    depth : float32 [H, W] camera z of the whole scene; NaN where there is none [m]
    normal : float32 [H, W, 3] unit normals of the road, world frame [1]
    rays : float32 [H, W, 3] world directions of the pixels, of camera z 1 [1]
    T_world_camera : float64 [4, 4] camera pose [m]
    K : float64 [3, 3] intrinsics [px]
    """

    road: NDArray[np.bool_]
    mirrors: NDArray[np.bool_]
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    rays: NDArray[np.float32]
    T_world_camera: NDArray[np.float64]
    K: NDArray[np.float64]
