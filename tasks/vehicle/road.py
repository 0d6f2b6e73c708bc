"""Height and slope of the road at one station, for the kernels: a feature, lines of another program, and the grade."""

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.surface.road_profile import RoadGrade, RoadHazard


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


class Climb(NamedTuple):
    """Deceleration that the grade of a road causes.

    Parameters
    ----------
    spacing : between the stations, of which the first is 0 [m]
    deceleration : at each, float64 [N]; empty on a level road [m/s2]
    """

    spacing: float
    deceleration: NDArray[np.float64]


def make_climb(grade: RoadGrade, gravity: float, direction: int = 1) -> Climb:
    """Return the deceleration that a grade causes.

    Parameters
    ----------
    grade : of the road
    gravity : g [m/s2]
    direction : +1 along the route, -1 against it
    """
    rise = np.array(() if grade.is_level else grade.rise, dtype=np.float64)
    return Climb(float(grade.spacing_m), gravity * rise * direction)


@register_jitable(cache=True)
def compute_climb(station: float, climb: Climb) -> float:
    """Return the deceleration that the grade causes at a station [m/s2].

    Parameters
    ----------
    station : route position of the front axle [m]
    climb : along the road
    """
    known = climb.deceleration
    last = len(known) - 1
    if last < 0:
        return 0.0
    position = min(max(station / climb.spacing, 0.0), float(last))
    before = min(int(position), max(last - 1, 0))
    after = min(before + 1, last)
    return float(known[before] + (position - before) * (known[after] - known[before]))


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
