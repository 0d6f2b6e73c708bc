"""Snow on the road as a layer of Gaussians of its own, and snow on what else faces up."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
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
    local_depth_mm,
    locate_snow,
)
from tasks.render.weather.snow.road_anchors import AnchorParameters, road_anchors
from tasks.render.weather.snow.shelter import open_share
from tasks.render.weather.snow.wheel_tracks import TrackParameters
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0
from tasks.scene.surroundings import surface_scales

BURIED = 0.98
"""Share of an anchor that its snow hides from which on the anchor itself need not be drawn."""
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
    lay = locate_snow(field, gaussians.means[anchors.index])
    xi = coverage_rank(field, lay)
    share = covered_share(xi, amount.coverage, p.edge)
    on = share * gaussians.opacities[anchors.index] > 1 / 255
    index, normal, flat = anchors.index[on], anchors.normal[on], anchors.flat[on]
    share, tracks = share[on], lay.tracks[on]
    depth = local_depth_mm(xi[on], amount, p.edge)
    place = gaussians.means[index].astype(np.float64)
    scales, quats = _lying(gaussians, index, normal, flat)
    lumps = height_field(place[:, 0], place[:, 1], p.lumps, field.seed, "snow-lumps", scales.max(axis=1))
    rise = 1e-3 * depth * np.clip(1 + p.lump_share * lumps, 0.2, HIGHEST_LUMP)
    thin = np.argmin(scales, axis=1)
    scales[np.arange(len(index)), thin] = np.clip(0.3 * rise, 1e-3, 5e-3)

    colour = _snow_colour(lumps, tracks, depth, _at(white, index), p)
    if gaussians.display_encoded:
        colour = to_display_unclipped(colour)
    sh = np.zeros((len(index), *gaussians.sh.shape[1:]), dtype=np.float32)
    sh[:, 0] = (colour - 0.5) / C0
    buried = share >= BURIED
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
    return SnowLayer(gaussians=layer, anchors=index, cover=share * area, buried=index[buried])


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
        about[snow.anchors, 0] *= (1 + snow.cover).astype(np.float32)
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
    hidden[on] = facing[on] * np.maximum(cover, p.dust * min(1.0, 4 * amount.coverage))
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
