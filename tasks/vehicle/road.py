"""Height and slope of the road at one station, for the kernels: a feature, and lines that another program gives."""

from math import cos, pi, sin
from typing import NamedTuple

from numba.extending import register_jitable

from tasks.surface.road_profile import RoadHazard


class RoadLine(NamedTuple):
    """A straight piece of road: a station on it [m], the height there [m] and the slope [m/m]."""

    station: float
    height: float
    slope: float


LEVEL = RoadLine(0.0, 0.0, 0.0)


class RoadFeature(NamedTuple):
    """A road as numbers.

    Parameters
    ----------
    center, length, height : middle, length and signed height of the hazard [m]
    under_axles : the road has the two lines as well, each where its axle is the nearer one
    front, rear : road under each axle, beside the hazard
    """

    center: float
    length: float
    height: float
    under_axles: bool = False
    front: RoadLine = LEVEL
    rear: RoadLine = LEVEL


def make_road_feature(hazard: RoadHazard) -> RoadFeature:
    """Return the hazard as numbers; a flat road is a feature of height 0."""
    return RoadFeature(float(hazard.center_m), float(hazard.length_m), float(hazard.height_m))


@register_jitable(cache=True, forceinline=True)
def find_line(station: float, road: RoadFeature) -> RoadLine:
    """Return the line of the axle that a station is nearer to.

    Parameters
    ----------
    station : route position [m]
    road : the road
    """
    return road.front if station > 0.5 * (road.front.station + road.rear.station) else road.rear


@register_jitable(cache=True, forceinline=True)
def compute_road_height(station: float, road: RoadFeature) -> float:
    """Return the road height H_g [m] (paper, Eq. shared_road_profile).

    Parameters
    ----------
    station : route position [m]
    road : the road
    """
    height = 0.0
    offset = station - road.center
    if not (road.height == 0.0 or abs(offset) > 0.5 * road.length):
        height = 0.5 * road.height * (1.0 + cos(2.0 * pi * offset / road.length))
    if road.under_axles:
        line = find_line(station, road)
        height += line.height + line.slope * (station - line.station)
    return height


@register_jitable(cache=True, forceinline=True)
def compute_road_slope(station: float, road: RoadFeature) -> float:
    """Return the road slope dH_g/ds [m/m] (derivative of the paper's Eq. shared_road_profile).

    Parameters
    ----------
    station : route position [m]
    road : the road
    """
    slope = 0.0
    offset = station - road.center
    if not (road.height == 0.0 or abs(offset) > 0.5 * road.length):
        slope = -pi * road.height / road.length * sin(2.0 * pi * offset / road.length)
    if road.under_axles:
        slope += find_line(station, road).slope
    return slope
