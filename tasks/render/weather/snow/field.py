"""Where snow lies and how deep: one field over the world, uniform over the road's area.

A place is covered when xi <= c_s, so higher coverage adds to what is there. Depth tapers to the edge of a patch
and keeps the mean: twice the mean depth where xi is 0, none where xi reaches c_s; once everything is covered the
rest falls evenly. Wheel tracks raise the field before it is made uniform: they are covered last, and the share
that is covered stays c_s.
"""

from dataclasses import dataclass

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
    tracks : wheel tracks in it
    route : the route that the wheels ran along; None without tracks
    seed : visual seed [1]
    quantiles : float64 [Q] raw field below which 0, 1/(Q-1), ... 1 of the road's area lies [1]
    """

    patches: FieldParameters
    tracks: TrackParameters
    route: Route | None
    seed: int
    quantiles: NDArray[np.float64]


def snow_field(
    gaussians: Gaussians,
    patches: FieldParameters,
    tracks: TrackParameters,
    anchors: AnchorParameters,
    route: Route | None,
    seed: int,
) -> SnowField:
    """The coverage field, made uniform over the area of the scene's road.

    Parameters
    ----------
    gaussians : the scene, with or without a road edit
    patches : the field's waves
    tracks : wheel tracks in it
    anchors : what a road Gaussian must be to count
    route : the route that wheels ran along; None leaves the snow untouched
    seed : visual seed of the clip [1]

    Returns
    -------
    SnowField
    """
    index = road_anchors(gaussians, anchors).index
    level = np.linspace(0, 1, QUANTILES)
    quantiles = level
    if len(index):
        x, y = gaussians.means[index, :2].T
        raw = _unranked(x, y, track_share(x, y, route, tracks, seed), patches, tracks, seed)
        scales = np.sort(gaussians.scales[index].astype(np.float64), axis=1)
        ranks = rank_uniform(raw, scales[:, 1] * scales[:, 2])
        order = np.argsort(ranks)
        quantiles = np.interp(level, ranks[order], raw[order])
    return SnowField(patches=patches, tracks=tracks, route=route, seed=seed, quantiles=quantiles)


def tracks_at(field: SnowField, x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.float64]:
    """How much of a wheel track each place is; 0 without a route.

    Parameters
    ----------
    field : the scene's coverage field
    x, y : [N] world coordinates [m]

    Returns
    -------
    float64 [N] share [1]
    """
    return track_share(x, y, field.route, field.tracks, field.seed)


def coverage_rank(
    field: SnowField, x: NDArray[np.floating], y: NDArray[np.floating], tracks: NDArray[np.floating]
) -> NDArray[np.float64]:
    """The field xi at places in the world.

    Parameters
    ----------
    field : the scene's coverage field
    x, y : [N] world coordinates [m]
    tracks : [N] how much of a wheel track each place is, from `tracks_at` [1]

    Returns
    -------
    float64 [N] xi in [0, 1]; a place is covered when xi <= c_s [1]
    """
    level = np.linspace(0, 1, len(field.quantiles))
    return np.interp(_unranked(x, y, tracks, field.patches, field.tracks, field.seed), field.quantiles, level)


def _unranked(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    on_track: NDArray[np.floating],
    patches: FieldParameters,
    tracks: TrackParameters,
    seed: int,
) -> NDArray[np.float64]:
    return height_field(x, y, patches, seed, "snow-cover") + tracks.bareness * np.asarray(on_track)


def local_depth_mm(xi: NDArray[np.floating], snow: LyingSnow) -> NDArray[np.float64]:
    """Snow depth where the field has the value xi; its mean over uniform xi is the depth given.

    Parameters
    ----------
    xi : [...] coverage field [1]
    snow : how much lies on average

    Returns
    -------
    float64 [...] depth, 0 where xi exceeds the coverage [mm]
    """
    if snow.coverage <= 0:
        return np.zeros(np.shape(xi))
    patchy = min(snow.depth_mm, snow.full_cover_mm)
    depth = patchy * 2 / snow.coverage * np.maximum(1 - np.asarray(xi) / snow.coverage, 0) + (
        snow.depth_mm - patchy
    )
    return np.where(np.asarray(xi) <= snow.coverage, depth, 0.0)
