"""Extent of the carriageway, and the class of a surface point."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass

BIN = 0.1
"""Lateral step in which the edge is sought [m]."""
LEVEL = 0.06
"""Points within this height of the route are level with it [m]."""
LEVEL_SHARE = 0.7
"""A strip is carriageway while this share of its low points is level [1]."""
LOW = 0.6
"""Points higher than this above the route are not ground [m]."""
NARROWEST = 1.0
"""Least half width, about half a car [m]."""
MEASURED_WELL = 14.0
"""Only points nearer than this to their camera decide about the edge [m]."""
HEIGHT_ERROR = 0.004
"""Growth of the height tolerance with distance from the camera [1]."""
FARTHEST = 60.0
"""Beyond this depth the tolerance grows no further [m]."""
GROUND = 0.3
"""Points within this height of the route, off the carriageway, are terrain [m]."""
GROUND_REACH = 15.0
"""Farther to the side, points are not classified as ground [m]."""


def measure_carriageway(
    station: NDArray[np.float64],
    lateral: NDArray[np.float64],
    height: NDArray[np.float64],
    depth: NDArray[np.float64],
    route_length: float,
    limit: float,
) -> tuple[float, float]:
    """Return the extent of the level strip around the route to the left (positive) and right (negative) [m].

    A kerb, a verge or parked cars end it: in either direction the first strip in which too few of the
    points near the ground are level with the route.

    Parameters
    ----------
    station, lateral, height : float64 [N] route coordinates of the points [m]
    depth : float64 [N] distance from the camera that measured them [m]
    route_length : points beyond the route do not count [m]
    limit : largest extent on either side [m]
    """
    used = (depth < MEASURED_WELL) & (np.abs(height) < LOW) & (station > 0) & (station < route_length)
    count = int(np.ceil(limit / BIN))
    strip = np.floor(lateral[used] / BIN).astype(np.int64) + count
    inside = (strip >= 0) & (strip < 2 * count)
    level = np.bincount(strip[inside], np.abs(height[used][inside]) < LEVEL, minlength=2 * count)
    total = np.bincount(strip[inside], minlength=2 * count)
    ended = level < LEVEL_SHARE * np.maximum(total, 1)
    left = next((k for k in range(count) if ended[count + k]), count) * BIN
    right = next((k for k in range(count) if ended[count - 1 - k]), count) * BIN
    return max(left, NARROWEST), -max(right, NARROWEST)


def classify_points(
    lateral: NDArray[np.float64],
    height: NDArray[np.float64],
    depth: NDArray[np.float64],
    extents: tuple[float, float],
) -> NDArray[np.uint8]:
    """Classify points: ROAD on the carriageway, TERRAIN on the ground beside it, OTHER elsewhere.

    Parameters
    ----------
    lateral, height : float64 [N] route coordinates [m]
    depth : float64 [N] distance from the camera that measured the point [m]
    extents : left (positive) and right (negative) edge of the carriageway [m]
    """
    tolerance = LEVEL + HEIGHT_ERROR * np.minimum(depth, FARTHEST)
    on_carriageway = (lateral < extents[0]) & (lateral > extents[1])
    road = on_carriageway & (np.abs(height) < tolerance)
    ground = ~on_carriageway & (np.abs(height) < GROUND + tolerance) & (np.abs(lateral) < GROUND_REACH)
    return np.select([road, ground], [SemanticClass.ROAD, SemanticClass.TERRAIN], SemanticClass.OTHER).astype(
        np.uint8
    )
