"""Where wheels have run: two strips about the route, which wander a little and have soft edges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.coverage_field import FieldParameters, height_field
from tasks.scene.route import Route


@dataclass(frozen=True, kw_only=True)
class TrackParameters:
    """Tracks of the traffic that drove the route before.

    Parameters
    ----------
    gauge_m : distance between the two tracks [m]
    width_m : width of a track at half its strength [m]
    wander_m : standard deviation of a track's place across the road [m]
    wander_length_m : length over which it wanders [m]
    bareness : how much later a track is covered than its surroundings, in standard deviations of the field [1]
    compaction : share of the snow's reflectance that wheels take away [1]
    """

    gauge_m: float
    width_m: float
    wander_m: float
    wander_length_m: float
    bareness: float
    compaction: float


def track_share(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    route: Route | None,
    parameters: TrackParameters,
    seed: int,
) -> NDArray[np.float64]:
    """How much of a wheel track a place is.

    Parameters
    ----------
    x, y : [N] world coordinates [m]
    route : the route that was driven; None where nobody has driven
    parameters : the tracks
    seed : visual seed of the clip [1]

    Returns
    -------
    float64 [N] 1 in the middle of a track, 0 away from it [1]
    """
    p = parameters
    if route is None:
        return np.zeros(len(x))
    # tracks are read across the road alone, so the height of the place does not matter
    station, lateral, _ = route.project(np.column_stack((x, y, np.zeros(len(x)))))
    wave = FieldParameters(coarsest_m=p.wander_length_m, octaves=2, roughness=0.5)
    lateral = lateral + p.wander_m * height_field(station, np.zeros(len(x)), wave, seed, "wheel-tracks")
    across = (np.abs(lateral) - p.gauge_m / 2) / (p.width_m / 2)
    return 1 / (1 + across**4)
