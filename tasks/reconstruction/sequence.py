"""Input of the reconstruction: rectified stereo pairs with poses, and settings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class StereoSequence:
    """F rectified stereo pairs along a drive. Pixels are sRGB-encoded; camera axes x right, y down, z forward.

    Parameters
    ----------
    name : name of the scene
    left, right : uint8 [F, H, W, 3] pictures, sRGB-encoded [1]
    intrinsics : float64 [3, 3] camera matrix of both cameras, pixel centres at whole numbers [px]
    baseline : distance from the left to the right camera along camera +x [m]
    T_origin_camera : float64 [F, 4, 4] poses of the left camera in the sequence's own frame, which may
        have any orientation; translations [m]
    """

    name: str
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    intrinsics: NDArray[np.float64]
    baseline: float
    T_origin_camera: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.left)

    @property
    def disparity_scale(self) -> float:
        """Disparity times depth: focal length times baseline [px m]."""
        return float(self.intrinsics[0, 0] * self.baseline)


@dataclass(frozen=True, kw_only=True)
class StereoSettings:
    """Choices of the reconstruction; the defaults suit a car's camera of about half a megapixel in a street.

    Parameters
    ----------
    disparities : disparity range searched, a multiple of 16 [px]
    held_out_every, held_out_first : which frames are left out of the whole build and judged afterwards.
        By default 4, 12, 20 ...: the first and the last picture stay in, since they show surfaces that no other shows
    camera_ahead_of_front_axle : position of the camera along the rig's x axis [m]
    first_station : the route starts this far behind the first pose, because no picture shows nearer road [m]
    extension : straight road added to the route beyond the last pose [m]
    maximum_depth : farther surfaces are placed at this depth [m]
    carriageway_limit : largest lateral extent of the carriageway on either side of the route [m]
    spacing : distance between neighbouring Gaussians in the picture that shows them largest [px]
    refinement_passes : how often colour, opacity and place are corrected over all training pictures [1]
    environment_rows : rows of the sky panorama; it has twice as many columns [px]
    """

    disparities: int = 128
    held_out_every: int = 8
    held_out_first: int = 4
    camera_ahead_of_front_axle: float = -1.0
    first_station: float = 3.0
    extension: float = 30.0
    maximum_depth: float = 120.0
    carriageway_limit: float = 6.0
    spacing: int = 2
    refinement_passes: int = 4
    environment_rows: int = 1024

    def __post_init__(self) -> None:
        rules = (
            ("disparities", self.disparities > 0 and self.disparities % 16 == 0, "a positive multiple of 16"),
            ("held_out_every", self.held_out_every >= 2, "at least 2"),
            ("held_out_first", 0 <= self.held_out_first < self.held_out_every, "in [0, held_out_every)"),
            ("first_station", self.first_station >= 0, "at least 0 m"),
            ("extension", self.extension >= 0, "at least 0 m"),
            ("maximum_depth", self.maximum_depth > 0, "positive"),
            ("carriageway_limit", self.carriageway_limit > 0, "positive"),
            ("spacing", self.spacing >= 1, "at least 1 px"),
            ("refinement_passes", self.refinement_passes >= 0, "at least 0"),
            ("environment_rows", self.environment_rows >= 16, "at least 16"),
        )
        problems = [
            f"{name} must be {rule}; it is {getattr(self, name)}" for name, ok, rule in rules if not ok
        ]
        if problems:
            raise InputError(problems)

    def held_out(self, count: int) -> NDArray[np.int64]:
        """Return the numbers of the frames, of ``count``, that the build never reads [1]."""
        return np.arange(self.held_out_first, count, self.held_out_every)
