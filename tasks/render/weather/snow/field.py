"""Where snow lies on the road and how deep: one field over it, uniform over the road's area.

Wheels and wind lay snow along the road: the field is read in route coordinates and longer along it than across. A place
is covered when xi <= c_s, so higher coverage adds to what is there. The edge of a patch is soft, slush as much inside
as outside, so that the covered share stays c_s. Depth tapers to the edge and keeps the mean; once everything is covered
the rest falls evenly. Wheel tracks raise the field before it is made uniform: they are covered last.

Beside the road nobody drives: snow lies there by its mean depth.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.coverage_field import FieldParameters, height_field, rank_uniform
from tasks.render.weather.snow.road_anchors import AnchorParameters, road_anchors
from tasks.render.weather.snow.wheel_tracks import TrackParameters, track_share
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route

QUANTILES = 1025


@dataclass(frozen=True, kw_only=True)
class LyingSnow:
    """How much snow lies on the ground.

    Parameters
    ----------
    coverage : share of the ground that it covers, c_s [1]
    depth_mm : mean depth over all of the ground, h_s [mm]
    full_cover_mm : depth at which the ground is covered, h_cover of the pavement [mm]
    """

    coverage: float
    depth_mm: float
    full_cover_mm: float


@dataclass(frozen=True, kw_only=True)
class SnowField:
    """The coverage field of one scene and seed, readable anywhere.

    Parameters
    ----------
    patches : its waves
    stretch : how much longer they are along the road than across [1]
    tracks : wheel tracks in it
    route : the route that the wheels ran along; None without tracks
    lanes : lateral positions of the lanes along it that are driven [m]
    seed : visual seed [1]
    quantiles : float64 [Q] raw field below which 0, 1/(Q-1), ... 1 of the road's area lies [1]
    """

    patches: FieldParameters
    stretch: float
    tracks: TrackParameters
    route: Route | None
    lanes: tuple[float, ...]
    seed: int
    quantiles: NDArray[np.float64]


class Lay(NamedTuple):
    """Places in the coverage field: along and across the road [m], and how much of a wheel track each is [1]."""

    along: NDArray[np.float64]
    across: NDArray[np.float64]
    tracks: NDArray[np.float64]


def snow_field(
    gaussians: Gaussians,
    patches: FieldParameters,
    stretch: float,
    tracks: TrackParameters,
    anchors: AnchorParameters,
    route: Route | None,
    seed: int,
    lanes: tuple[float, ...] = (0.0,),
) -> SnowField:
    """The coverage field, made uniform over the area of the scene's road.

    Parameters
    ----------
    gaussians : the scene, with or without a road edit
    patches, stretch, tracks, route, seed, lanes : see `SnowField`
    anchors : what a road Gaussian must be to count

    Returns
    -------
    SnowField
    """
    index = road_anchors(gaussians, anchors).index
    level = np.linspace(0, 1, QUANTILES)
    field = SnowField(
        patches=patches, stretch=stretch, tracks=tracks, route=route, lanes=lanes, seed=seed, quantiles=level
    )
    if not len(index):
        return field
    raw = _unranked(locate_snow(field, gaussians.means[index]), field)
    scales = np.sort(gaussians.scales[index].astype(np.float64), axis=1)
    ranks = rank_uniform(raw, scales[:, 1] * scales[:, 2])
    order = np.argsort(ranks)
    return replace(field, quantiles=np.interp(level, ranks[order], raw[order]))


def locate_snow(field: SnowField, places: NDArray[np.floating]) -> Lay:
    """Where places lie in the coverage field; without a route it is laid out in the world, without tracks.

    Parameters
    ----------
    field : the scene's coverage field
    places : [N, 3] world coordinates [m]
    """
    flat = np.array(places, dtype=np.float64)
    if field.route is None:
        return Lay(flat[:, 0], flat[:, 1], np.zeros(len(flat)))
    # read across the road alone, so that the height of the place does not matter
    flat[:, 2] = 0
    station, lateral, _ = field.route.project(flat)
    tracks = track_share(station, lateral, field.lanes, field.tracks, field.seed)
    return Lay(station / field.stretch, lateral, tracks)


def coverage_rank(field: SnowField, lay: Lay) -> NDArray[np.float64]:
    """The field xi at places.

    Parameters
    ----------
    field : the scene's coverage field
    lay : where they lie in it

    Returns
    -------
    float64 [N] xi in [0, 1]; a place is covered when xi <= c_s [1]
    """
    return np.interp(_unranked(lay, field), field.quantiles, np.linspace(0, 1, len(field.quantiles)))


def _unranked(lay: Lay, field: SnowField) -> NDArray[np.float64]:
    waves = height_field(lay.along, lay.across, field.patches, field.seed, "snow-cover")
    return waves + field.tracks.bareness * lay.tracks


def edge_width(coverage: float, widest: float) -> float:
    """Width, in xi, over which the edge of a patch goes from bare to covered; none where all or nothing is covered [1].

    Parameters
    ----------
    coverage : c_s [1]
    widest : its largest width [1]
    """
    return min(widest, 2 * coverage, 2 * (1 - coverage))


def covered_share(xi: NDArray[np.floating], coverage: float, widest: float) -> NDArray[np.float64]:
    """Share of the ground that snow hides where the field has the value xi; its mean over uniform xi is the coverage.

    Parameters
    ----------
    xi : [...] coverage field [1]
    coverage : c_s [1]
    widest : see `edge_width`
    """
    width = edge_width(coverage, widest)
    if width <= 0:
        return np.where(np.asarray(xi) <= coverage, 1.0, 0.0) * (coverage > 0)
    inside = np.clip((coverage + width / 2 - np.asarray(xi, dtype=np.float64)) / width, 0, 1)
    return inside * inside * (3 - 2 * inside)


def local_depth_mm(xi: NDArray[np.floating], snow: LyingSnow, widest: float) -> NDArray[np.float64]:
    """Snow depth where the field has the value xi; its mean over uniform xi is the depth given.

    Parameters
    ----------
    xi : [...] coverage field [1]
    snow : how much lies on average
    widest : see `edge_width`

    Returns
    -------
    float64 [...] depth, 0 beyond the edge [mm]
    """
    if snow.coverage <= 0:
        return np.zeros(np.shape(xi))
    patchy = min(snow.depth_mm, snow.full_cover_mm)
    last = snow.coverage + edge_width(snow.coverage, widest) / 2
    tapers = patchy * 2 / last * np.maximum(1 - np.asarray(xi) / last, 0)
    return np.where(np.asarray(xi) <= last, tapers + snow.depth_mm - patchy, 0.0)
