"""The road along its length: the raised-cosine feature that wheels and picture follow, and the grade of a hill."""

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


@dataclass(frozen=True, kw_only=True)
class RoadGrade:
    """Grade along a road: linear between equally spaced stations, constant before the first and beyond the last.

    It is the rise per metre of way, the sine of the road's angle: m g times it is the weight's share along the road,
    and its integral over the station is the height.

    Parameters
    ----------
    rise : at each station; a single one holds everywhere [1]
    spacing_m : between the stations, of which the first is 0 [m]

    Raises
    ------
    InputError
        For a rise that no road has, or stations that do not ascend.
    """

    rise: tuple[float, ...] = (0.0,)
    spacing_m: float = 1.0

    def __post_init__(self) -> None:
        problems = []
        if beyond := [one for one in self.rise if not -1 < one < 1]:
            problems.append(f"the grade of a road must be above -1 and below 1; it is {beyond[0]:g}")
        if not self.rise:
            problems.append("the grade of a road needs one value or more; it has none")
        if not (isfinite(self.spacing_m) and self.spacing_m > 0):
            problems.append(
                f"the stations of a grade must lie spacing_m above 0 apart; it is {self.spacing_m:g}"
            )
        if problems:
            raise InputError(problems)

    @property
    def is_level(self) -> bool:
        """Whether the road neither climbs nor falls anywhere."""
        return not any(self.rise)

    def at(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the grade at stations, any shape [1].

        Parameters
        ----------
        station : route coordinate [m]
        """
        known = self.spacing_m * np.arange(len(self.rise))
        return np.asarray(np.interp(np.asarray(station, float), known, self.rise), float)


LEVEL_ROAD = RoadGrade()


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
