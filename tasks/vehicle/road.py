"""Height and slope of the road feature at one station, for the kernels."""

from math import cos, pi, sin
from typing import NamedTuple

from numba import njit

from tasks.surface.road_profile import RoadHazard


class RoadFeature(NamedTuple):
    """A road hazard as numbers: middle [m], length [m] and signed height [m]."""

    center: float
    length: float
    height: float


def make_road_feature(hazard: RoadHazard) -> RoadFeature:
    """Return the hazard as numbers; a flat road is a feature of height 0."""
    return RoadFeature(float(hazard.center_m), float(hazard.length_m), float(hazard.height_m))


@njit(cache=True, nogil=True, forceinline=True)
def compute_road_height(station: float, road: RoadFeature) -> float:
    """Return the road height H_g [m] (paper, Eq. shared_road_profile).

    Parameters
    ----------
    station : route position [m]
    road : road feature
    """
    offset = station - road.center
    if road.height == 0.0 or abs(offset) > 0.5 * road.length:
        return 0.0
    return 0.5 * road.height * (1.0 + cos(2.0 * pi * offset / road.length))


@njit(cache=True, nogil=True, forceinline=True)
def compute_road_slope(station: float, road: RoadFeature) -> float:
    """Return the road slope dH_g/ds [m/m] (derivative of the paper's Eq. shared_road_profile).

    Parameters
    ----------
    station : route position [m]
    road : road feature
    """
    offset = station - road.center
    if road.height == 0.0 or abs(offset) > 0.5 * road.length:
        return 0.0
    return -pi * road.height / road.length * sin(2.0 * pi * offset / road.length)
