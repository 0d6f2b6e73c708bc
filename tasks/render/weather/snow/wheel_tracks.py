"""Where wheels have run: two strips in each lane, which wander a little and have soft edges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.coverage_field import FieldParameters, height_field


@dataclass(frozen=True, kw_only=True)
class TrackParameters:
    """Tracks of the traffic that drove before.

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
    station: NDArray[np.floating],
    lateral: NDArray[np.floating],
    lanes: tuple[float, ...],
    parameters: TrackParameters,
    seed: int,
) -> NDArray[np.float64]:
    """How much of a wheel track a place is.

    Parameters
    ----------
    station, lateral : [N] place along and across the route [m]
    lanes : lateral positions of the middles of the lanes that are driven [m]
    parameters : the tracks
    seed : visual seed of the clip [1]

    Returns
    -------
    float64 [N] 1 in the middle of a track, 0 away from it [1]
    """
    p = parameters
    wave = FieldParameters(coarsest_m=p.wander_length_m, octaves=2, roughness=0.5)
    share = np.zeros(len(station))
    for lane in lanes:
        wander = p.wander_m * height_field(station, np.full(len(station), lane), wave, seed, "wheel-tracks")
        across = (np.abs(lateral - lane + wander) - p.gauge_m / 2) / (p.width_m / 2)
        share = np.maximum(share, 1 / (1 + across**4))
    return share
