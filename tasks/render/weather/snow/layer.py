"""Snow on the road as a layer of Gaussians of its own, and snow on what else faces up."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.rasterise.preparation import rotation_matrices
from tasks.render.weather.coverage_field import FieldParameters, height_field
from tasks.render.weather.scene_light import (
    append_gaussians,
    recolour_gaussians,
    remove_gaussians,
    to_display_unclipped,
)
from tasks.render.weather.snow.bearing import GROUND_CLASSES, bearing_share
from tasks.render.weather.snow.field import (
    LyingSnow,
    SnowField,
    coverage_rank,
    covered_share,
    edge_width,
    local_depth_mm,
    locate_snow,
)
from tasks.render.weather.snow.road_anchors import AnchorParameters, RoadAnchors, road_anchors
from tasks.render.weather.snow.shelter import open_share
from tasks.render.weather.snow.wheel_tracks import TrackParameters
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0
from tasks.scene.street.surfels import OVERLAP
from tasks.scene.surroundings import surface_scales

BURIED = 0.98
"""Share of an anchor that its snow hides from which on the anchor itself need not be drawn."""
NEAR_EDGE = 0.12
"""Distance beyond the edge of a patch, in the coverage field, within which discs are cut [1]."""
MOST_PIECES = 4
"""Pieces of an anchor, at most [1]."""
HIGHEST_LUMP = 2.0
"""Height of the highest lump of snow by the mean depth [1]."""


@dataclass(frozen=True, kw_only=True)
class SnowCoverParameters:
    """How snow lies and looks.

    Parameters
    ----------
    patches : waves of the coverage field
    stretch : how much longer they are along the road than across [1]
    edge : share of the road over which the edge of a patch goes from bare to covered, at most [1]
    tracks : wheel tracks in it
    anchors : which Gaussians of the road carry it
    lumps : waves of the micro-height
    lump_share : standard deviation of the micro-height by the local depth [1]
    relief : standard deviation of the snow's brightness from hollow to lump, by its mean [1]
    hiding_mm : depth at which 1 - 1/e of the ground beside the road is hidden [mm]
    albedo : reflectance of fresh snow, red, green, blue [1]
    slush_albedo : reflectance of the wet snow at the edge of a patch, red, green, blue [1]
    slush_mm : depth over which slush turns to snow, 1 - 1/e [mm]
    damp_albedo_ratio : reflectance of the damp road between the snow by its dry one [1]
    dust : share of the bare road that blown snow and salt whiten [1]
    rim : share of the road that slush hides right beside a patch; None is no more than dust [1]
    rim_width : distance from a patch, in the coverage field, over which that falls to 1/e [1]
    """

    patches: FieldParameters
    stretch: float
    edge: float
    tracks: TrackParameters
    anchors: AnchorParameters
    lumps: FieldParameters
    lump_share: float
    relief: float
    hiding_mm: float
    albedo: tuple[float, float, float]
    slush_albedo: tuple[float, float, float]
    slush_mm: float
    damp_albedo_ratio: float
    dust: float
    rim: float | None = None
    rim_width: float | None = None


@dataclass(frozen=True, kw_only=True)
class SnowLayer:
    """Snow on the road.

    Parameters
    ----------
    gaussians : to append to the scene; they keep their anchors' class
    anchors : int64 [A] the road Gaussian under each [1]
    cover : float64 [A] opacity times area of each by its anchor's [1]
    buried : int64 [B] road Gaussians that nobody sees any more [1]
    """

    gaussians: Gaussians
    anchors: NDArray[np.int64]
    cover: NDArray[np.float64]
    buried: NDArray[np.int64]


def hidden_share(depth_mm: NDArray[np.floating], parameters: SnowCoverParameters) -> NDArray[np.float64]:
    """Share of the ground that snow of a depth hides.

    Parameters
    ----------
    depth_mm : [...] local depth [mm]
    parameters : hiding depth

    Returns
    -------
    float64 [...] share [1]
    """
    return 1 - np.exp(-np.asarray(depth_mm, dtype=np.float64) / parameters.hiding_mm)


def snow_layer(
    gaussians: Gaussians,
    field: SnowField,
    white: NDArray[np.floating],
    amount: LyingSnow,
    parameters: SnowCoverParameters,
    lift: NDArray[np.floating] | None = None,
) -> SnowLayer:
    """The Gaussians of the snow on the road.

    Parameters
    ----------
    gaussians : the scene with the clip's road edit
    field : its coverage field
    white : [3] or [N, 3] radiance of a white surface lying on the road, or there, as the scene's colours have it [1]
    amount : how much snow lies
    parameters : how snow lies and looks
    lift : [N] height of a road feature under each Gaussian, as `road_anchors` takes it [m]

    Returns
    -------
    SnowLayer
    """
    p = parameters
    anchors = road_anchors(gaussians, p.anchors, lift)
    cut = np.zeros(len(anchors.index), bool)
    if 0 < amount.coverage < 1:
        xi = coverage_rank(field, locate_snow(field, gaussians.means[anchors.index]))
        cut = np.abs(xi - amount.coverage) < edge_width(amount.coverage, p.edge) / 2 + NEAR_EDGE
    index, normal, place, scales, quats = _cut_anchors(gaussians, anchors, cut)
    lay = locate_snow(field, place)
    xi = coverage_rank(field, lay)
    share = covered_share(xi, amount.coverage, p.edge)
    least = np.ones(len(gaussians))
    np.minimum.at(least, index, share)
    on = share * gaussians.opacities[index] > 1 / 255
    index, share, tracks = index[on], share[on], lay.tracks[on]
    normal, place, scales, quats = normal[on], place[on], scales[on], quats[on]
    buried = least[index] >= BURIED
    depth = local_depth_mm(xi[on], amount, p.edge)
    lumps = height_field(place[:, 0], place[:, 1], p.lumps, field.seed, "snow-lumps", scales.max(axis=1))
    rise = 1e-3 * depth * np.clip(1 + p.lump_share * lumps, 0.2, HIGHEST_LUMP)
    thin = np.argmin(scales, axis=1)
    scales[np.arange(len(index)), thin] = np.clip(0.3 * rise, 1e-3, 5e-3)

    colour = _snow_colour(lumps, tracks, depth, _at(white, index), p)
    if gaussians.display_encoded:
        colour = to_display_unclipped(colour)
    sh = np.zeros((len(index), *gaussians.sh.shape[1:]), dtype=np.float32)
    sh[:, 0] = (colour - 0.5) / C0
    # Where the ground is not buried, its discs lie among those of the snow.
    area = surface_scales(scales).prod(axis=1) / surface_scales(gaussians.scales[index]).prod(axis=1)
    layer = replace(
        gaussians,
        means=(place + rise[:, None] * normal).astype(np.float32),
        quats_wxyz=quats.astype(np.float32),
        scales=scales.astype(np.float32),
        opacities=np.clip(share * gaussians.opacities[index], 1 / 255, 1).astype(np.float32),
        sh=sh,
        normals=normal.astype(np.float32),
        class_id=gaussians.class_id[index],
        surroundings=_surroundings(gaussians, index, area, share * area + ~buried),
    )
    return SnowLayer(gaussians=layer, anchors=index, cover=share * area, buried=np.unique(index[buried]))


def snowed_over(gaussians: Gaussians, snow: SnowLayer) -> Gaussians:
    """The scene with the layer on it, less what it buries.

    Parameters
    ----------
    gaussians : the scene that the layer was made for, in whatever colours
    snow : the layer

    Returns
    -------
    Gaussians
        The layer comes last.
    """
    if gaussians.surroundings is not None:
        about = gaussians.surroundings.copy()
        cover = np.bincount(snow.anchors, snow.cover, len(gaussians))
        about[:, 0] *= (1 + cover).astype(np.float32)
        gaussians = replace(gaussians, surroundings=about)
    return append_gaussians(remove_gaussians(gaussians, snow.buried), snow.gaussians)


def whiten_gaussians(
    gaussians: Gaussians,
    field: SnowField,
    white: NDArray[np.floating],
    amount: LyingSnow,
    parameters: SnowCoverParameters,
) -> Gaussians:
    """The scene with snow on everything that faces up, and damp road between the snow.

    What stands on the ground gets as much as reaches it past what hangs above; ground gets it all, drifted there.

    The road under the snow layer is whitened too: far away a pixel blends many Gaussians, and dark ones between
    the layer's would show through.

    Parameters
    ----------
    gaussians : the scene
    field : its coverage field
    white : [3] or [N, 3] radiance of a white surface lying on the road, or there, as the scene's colours have it [1]
    amount : how much snow lies
    parameters : how snow lies and looks

    Returns
    -------
    Gaussians
        The same Gaussians with other colours.
    """
    p = parameters
    road = np.isin(gaussians.class_id, ROAD_CLASSES)
    facing = bearing_share(gaussians, p.anchors)
    hidden = np.zeros(len(gaussians))
    depth, tracks = np.zeros(len(gaussians)), np.zeros(len(gaussians))
    on = np.flatnonzero(road & (facing > 0))
    lay = locate_snow(field, gaussians.means[on])
    xi = coverage_rank(field, lay)
    tracks[on], depth[on] = lay.tracks, local_depth_mm(xi, amount, p.edge)
    cover = covered_share(xi, amount.coverage, p.edge)
    cover = np.maximum(cover, p.dust * min(1.0, 4 * amount.coverage))
    if p.rim and p.rim_width and amount.coverage > 0:
        cover = np.maximum(cover, p.rim * np.exp(-np.maximum(xi - amount.coverage, 0) / p.rim_width))
    hidden[on] = facing[on] * cover
    beside = np.flatnonzero(~road & (facing > 0))
    reached = np.where(np.isin(gaussians.class_id, GROUND_CLASSES), 1.0, open_share(gaussians))
    depth[beside] = reached[beside] * amount.depth_mm
    hidden[beside] = facing[beside] * hidden_share(depth[beside], p)
    damp = np.where(road, p.damp_albedo_ratio, 1.0)
    snow = _snow_colour(np.zeros(len(gaussians)), tracks, depth, white, p)
    return recolour_gaussians(gaussians, (1 - hidden) * damp, hidden[:, None] * snow)


def _at(white: NDArray[np.floating], index: NDArray[np.int64]) -> NDArray[np.floating]:
    """The light at some Gaussians, or everywhere."""
    return white[index] if np.ndim(white) == 2 else white


def _snow_colour(
    lumps: NDArray[np.floating],
    tracks: NDArray[np.floating],
    depth_mm: NDArray[np.floating],
    white: NDArray[np.floating],
    p: SnowCoverParameters,
) -> NDArray[np.float64]:
    """Radiance of snow: slush where it is thin, hollows less bright than lumps, wheels press it grey."""
    shade = (1 + p.relief * np.clip(np.asarray(lumps), -2.5, 1.5)) * (1 - p.tracks.compaction * tracks)
    wet = np.exp(-np.asarray(depth_mm) / p.slush_mm)[:, None]
    albedo = (1 - wet) * np.array(p.albedo) + wet * np.array(p.slush_albedo)
    return shade[:, None] * albedo * np.asarray(white)


def _surroundings(
    gaussians: Gaussians, index: NDArray[np.int64], area: NDArray[np.float64], cover: NDArray[np.float64]
) -> NDArray[np.float32] | None:
    """Of Gaussians over these, so much of their area, on a surface so much more densely covered."""
    if gaussians.surroundings is None:
        return None
    overlap, ratio = gaussians.surroundings[index].T
    return np.column_stack((overlap * cover, ratio / np.sqrt(area))).astype(np.float32)


def _cut_anchors(
    gaussians: Gaussians, anchors: RoadAnchors, cut: NDArray[np.bool_]
) -> tuple[
    NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
]:
    """Return index, normal, place, scales and quaternion of the discs of the snow: of some anchors several in a row.

    Discs of a road are as long as a flat view of it allows; the edge of a patch is as sharp as they are wide.
    """
    scales, quats = _lying(gaussians, anchors.index, anchors.normal, anchors.flat)
    long, wide = scales.argmax(axis=1), np.sort(scales, axis=1)[:, 1]
    length = scales[np.arange(len(scales)), long]
    count = np.where(cut, np.clip(np.rint(length / wide), 1, MOST_PIECES), 1).astype(np.int64)
    own = np.repeat(np.arange(len(count)), count)
    turn = np.arange(len(own)) - np.repeat(np.cumsum(count) - count, count) - (count[own] - 1) / 2
    axis = rotation_matrices(quats.astype(np.float32))[np.arange(len(long)), :, long]
    place = gaussians.means[anchors.index].astype(np.float64)[own]
    place += (turn * length[own] / (OVERLAP * count[own]))[:, None] * axis[own]
    scales = scales[own]
    scales[np.arange(len(own)), long[own]] /= count[own]
    return anchors.index[own], anchors.normal[own], place, scales, quats[own]


def _lying(
    gaussians: Gaussians, index: NDArray[np.int64], normal: NDArray[np.float64], flat: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Scales and quaternions of Gaussians that lie in the surface: flat anchors' own, else discs turned to it."""
    scales = gaussians.scales[index].astype(np.float64)
    quats = gaussians.quats_wxyz[index].astype(np.float64)
    middle = np.sort(scales[~flat], axis=1)[:, 1]
    scales[~flat] = np.column_stack((middle, middle, 1e-3 * np.ones(len(middle))))
    x, y, z = normal[~flat].T
    turned = np.column_stack((1 + z, -y, x, np.zeros(len(z))))
    quats[~flat] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return scales, quats
