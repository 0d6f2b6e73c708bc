"""The raised-cosine road feature that both the wheels and the visible road follow."""

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class RoadHazard:
    """A speed hump (height above 0), a depression (below 0) or a flat road (0).

    Parameters
    ----------
    center_m : station of the middle of the feature, s_g [m]
    length_m : longitudinal extent, L_g [m]
    height_m : signed height of the middle, A_g [m]

    Raises
    ------
    InputError
        For a value that is not finite, a negative length, or a height without a length.
    """

    center_m: float
    length_m: float
    height_m: float

    def __post_init__(self) -> None:
        problems = [
            f"hazard {name} must be a finite number; it is {getattr(self, name)}"
            for name in ("center_m", "length_m", "height_m")
            if not isfinite(getattr(self, name))
        ]
        if self.length_m < 0 or (self.height_m != 0 and self.length_m == 0):
            problems.append(
                f"a hazard of height {self.height_m:g} m needs length_m above 0; it is {self.length_m:g}"
            )
        if problems:
            raise InputError(problems)


FLAT_ROAD = RoadHazard(center_m=0.0, length_m=0.0, height_m=0.0)


def road_elevation(station: ArrayLike, hazard: RoadHazard) -> NDArray[np.float64]:
    """Road height H_g [m] (paper, Eq. shared_road_profile).

    Parameters
    ----------
    station : route coordinate, any shape [m]
    hazard : the feature
    """
    phase, inside = _phase(station, hazard)
    return np.where(inside, 0.5 * hazard.height_m * (1 + np.cos(phase)), 0.0)


def road_slope(station: ArrayLike, hazard: RoadHazard) -> NDArray[np.float64]:
    """Slope dH_g/ds [m/m], the derivative of Eq. shared_road_profile; continuous at the ends of the feature.

    Parameters
    ----------
    station : route coordinate, any shape [m]
    hazard : the feature
    """
    phase, inside = _phase(station, hazard)
    steepest = np.pi * hazard.height_m / hazard.length_m if hazard.height_m != 0 else 0.0
    return np.where(inside, -steepest * np.sin(phase), 0.0)


def _phase(station: ArrayLike, hazard: RoadHazard) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    offset = np.asarray(station, float) - hazard.center_m
    if hazard.height_m == 0:
        return np.zeros_like(offset), np.zeros(offset.shape, bool)
    return 2 * np.pi * offset / hazard.length_m, np.abs(offset) <= hazard.length_m / 2
