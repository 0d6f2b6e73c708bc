"""Snow on the road as a layer of Gaussians of its own, and snow on what else faces up.

Coverage is one field xi over the world, uniform on [0, 1] over the road's area: a place is covered when
xi <= c_s, so higher coverage adds to what is there. Depth tapers to the edge of a patch and keeps the mean:
twice the mean depth where xi is 0, none where xi reaches c_s; once everything is covered the rest falls evenly.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.spherical_harmonics import C0
from tasks.render.weather.coverage_field import FieldParameters, height_field, rank_uniform
from tasks.render.weather.ground_grid import ground_grid, window_sums
from tasks.render.weather.scene_light import recoloured, to_display
from tasks.scene.gaussians import Gaussians

PLANE_CELL_M = 0.5
QUANTILES = 1025
EDGE_WIDTHS = 1.4
"""Distance to the edge of a patch by the standard deviation of a Gaussian that still ends there."""
NARROWEST = 0.35
"""Width of the narrowest Gaussian, at the very edge, by that of its anchor."""


@dataclass(frozen=True, kw_only=True)
class SnowCoverParameters:
    """How snow lies and looks.

    Parameters
    ----------
    patches : waves of the coverage field
    lumps : waves of the micro-height
    lump_share : standard deviation of the micro-height by the local depth [1]
    height_tolerance_m : largest distance of a road anchor from the local road plane [m]
    tilt_limit_deg : largest tilt of a road anchor's normal from up [deg]
    flatness : shortest by middle axis below which a Gaussian's own axis is its normal [1]
    full_cover_mm : depth at which the road is covered, h_cover [mm]
    hiding_mm : depth at which 1 - 1/e of the ground is hidden [mm]
    albedo : reflectance of fresh snow, red, green, blue [1]
    damp_albedo_ratio : reflectance of the damp ground between the snow by its dry one [1]
    """

    patches: FieldParameters
    lumps: FieldParameters
    lump_share: float
    height_tolerance_m: float
    tilt_limit_deg: float
    flatness: float
    full_cover_mm: float
    hiding_mm: float
    albedo: tuple[float, float, float]
    damp_albedo_ratio: float


@dataclass(frozen=True, kw_only=True)
class SnowField:
    """The coverage field of one scene and seed, readable anywhere.

    Parameters
    ----------
    parameters : its waves
    seed : visual seed [1]
    quantiles : float64 [Q] raw field below which 0, 1/(Q-1), ... 1 of the road's area lies [1]
    """

    parameters: FieldParameters
    seed: int
    quantiles: NDArray[np.float64]


def road_anchors(
    gaussians: Gaussians, parameters: SnowCoverParameters
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Gaussians of the road surface that carry snow, and the normals of the surface there.

    An anchor is of a road class, lies within the height tolerance of the plane through its neighbours, and its
    normal is within the tilt limit of up. The normal is the shortest axis where the Gaussian is flat enough,
    else the neighbours' plane.

    Parameters
    ----------
    gaussians : the scene
    parameters : tolerance and limits

    Returns
    -------
    index : int64 [A] anchors in the cloud [1]
    normal : float64 [A, 3] unit normals, upward [1]
    """
    p = parameters
    index = np.flatnonzero(np.isin(gaussians.class_id, ROAD_CLASSES))
    if not len(index):
        return index, np.empty((0, 3))
    means = gaussians.means[index].astype(np.float64)
    height, slope = _local_planes(means)
    normal = np.column_stack((-slope, np.ones(len(index))))
    scales = np.sort(gaussians.scales[index], axis=1)
    flat = scales[:, 0] < p.flatness * scales[:, 1]
    normal[flat] = _shortest_axes(gaussians.quats_wxyz[index[flat]], gaussians.scales[index[flat]])
    normal *= np.where(normal[:, 2] < 0, -1.0, 1.0)[:, None]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    upright = normal[:, 2] >= np.cos(np.deg2rad(p.tilt_limit_deg))
    near = np.abs(means[:, 2] - height) <= p.height_tolerance_m
    return index[upright & near], normal[upright & near]


def snow_field(gaussians: Gaussians, parameters: SnowCoverParameters, seed: int) -> SnowField:
    """The coverage field, made uniform over the area of the scene's road.

    Parameters
    ----------
    gaussians : the scene, with or without a road edit
    parameters : the field's waves
    seed : visual seed of the clip [1]

    Returns
    -------
    SnowField
    """
    index, _ = road_anchors(gaussians, parameters)
    raw = height_field(
        gaussians.means[index, 0], gaussians.means[index, 1], parameters.patches, seed, "snow-cover"
    )
    scales = np.sort(gaussians.scales[index].astype(np.float64), axis=1)
    ranks = rank_uniform(raw, scales[:, 1] * scales[:, 2])
    order = np.argsort(ranks)
    levels = np.linspace(0, 1, QUANTILES)
    quantiles = np.interp(levels, ranks[order], raw[order]) if len(index) else levels
    return SnowField(parameters=parameters.patches, seed=seed, quantiles=quantiles)


def coverage_rank(
    field: SnowField,
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    footprint: NDArray[np.floating] | float = 0.0,
) -> NDArray[np.float64]:
    """The field xi at places in the world.

    Parameters
    ----------
    field : the scene's coverage field
    x, y : [...] world coordinates [m]
    footprint : [...] or one number, width of what looks at the place [m]

    Returns
    -------
    float64 [...] xi in [0, 1]; a place is covered when xi <= c_s [1]
    """
    raw = height_field(x, y, field.parameters, field.seed, "snow-cover", footprint)
    return np.interp(raw, field.quantiles, np.linspace(0, 1, len(field.quantiles)))


def local_depth_mm(
    xi: NDArray[np.floating], coverage: float, depth_mm: float, full_cover_mm: float
) -> NDArray[np.float64]:
    """Snow depth where the field has the value xi; its mean over uniform xi is the depth given.

    Parameters
    ----------
    xi : [...] coverage field [1]
    coverage : c_s [1]
    depth_mm : mean depth over all of the ground, h_s [mm]
    full_cover_mm : depth at which the ground is covered [mm]

    Returns
    -------
    float64 [...] depth, 0 where xi exceeds the coverage [mm]
    """
    if coverage <= 0:
        return np.zeros(np.shape(xi))
    tapered = min(depth_mm, full_cover_mm) * 2 / coverage * np.maximum(1 - np.asarray(xi) / coverage, 0)
    return tapered + max(depth_mm - full_cover_mm, 0.0)


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
    coverage: float,
    depth_mm: float,
    parameters: SnowCoverParameters,
) -> tuple[Gaussians, NDArray[np.int64]]:
    """The Gaussians of the snow on the road.

    Parameters
    ----------
    gaussians : the scene with the clip's road edit
    field : its coverage field
    white : [3] radiance of a white surface lying on the road, as the scene's colours have it [1]
    coverage : c_s [1]
    depth_mm : h_s [mm]
    parameters : how snow lies and looks

    Returns
    -------
    layer : Gaussians to append; they keep their anchors' class
    anchors : int64 [A] the anchor of each [1]
    """
    p = parameters
    index, normal = road_anchors(gaussians, p)
    place = gaussians.means[index].astype(np.float64)
    scales = np.sort(gaussians.scales[index].astype(np.float64), axis=1)
    xi = coverage_rank(field, place[:, 0], place[:, 1])
    depth = local_depth_mm(xi, coverage, depth_mm, p.full_cover_mm)
    lumps = height_field(place[:, 0], place[:, 1], p.lumps, field.seed, "snow-lumps", scales[:, 2])
    rise = 1e-3 * depth * np.clip(1 + p.lump_share * lumps, 0.2, 2)
    hidden = hidden_share(depth, p) * gaussians.opacities[index]
    on = (xi <= coverage) & (hidden > 1 / 255)
    index, normal, place, rise, hidden = index[on], normal[on], place[on], rise[on], hidden[on]

    colour = _snow_colour(lumps[on], white, p)
    if gaussians.display_encoded:
        colour = to_display(colour)
    sh = np.zeros((len(index), *gaussians.sh.shape[1:]), dtype=np.float32)
    sh[:, 0] = (colour - 0.5) / C0
    # as wide as its anchor but not over the edge of its patch, and never thicker than the snow
    wide = np.maximum(scales[on, 2], 2e-3)
    if coverage < 1:
        inside = (coverage - xi[on]) / _steepness(field, place, wide)
        wide = np.clip(inside / EDGE_WIDTHS, NARROWEST * wide, wide)
    thin = np.clip(0.3 * rise, 1e-3, 0.5 * wide)
    return replace(
        gaussians,
        means=(place + rise[:, None] * normal).astype(np.float32),
        quats_wxyz=_lying(normal).astype(np.float32),
        scales=np.column_stack((wide, wide, thin)).astype(np.float32),
        opacities=np.clip(hidden, 1 / 255, 1).astype(np.float32),
        sh=sh,
        normals=normal.astype(np.float32),
        class_id=gaussians.class_id[index],
    ), index


def whitened(
    gaussians: Gaussians,
    field: SnowField,
    white: NDArray[np.floating],
    coverage: float,
    depth_mm: float,
    parameters: SnowCoverParameters,
) -> Gaussians:
    """The scene with snow on everything that faces up, and damp road between the snow.

    The road under the snow layer is whitened too: far away a pixel blends many Gaussians, and dark ones between
    the layer's would show through.

    Parameters
    ----------
    gaussians : the scene
    field : its coverage field
    white : [3] radiance of a white surface lying on the road, as the scene's colours have it [1]
    coverage : c_s [1]
    depth_mm : h_s [mm]
    parameters : how snow lies and looks

    Returns
    -------
    Gaussians
        The same Gaussians with other colours.
    """
    p = parameters
    road = np.isin(gaussians.class_id, ROAD_CLASSES)
    up = np.where(gaussians.class_id == SemanticClass.SKY, 0.0, gaussians.normals[:, 2])
    limit = np.cos(np.deg2rad(p.tilt_limit_deg))
    facing = np.clip((up - limit / 2) / (limit / 2), 0, 1)
    bears = np.flatnonzero(facing > 0)
    place = gaussians.means[bears]
    xi = coverage_rank(field, place[:, 0], place[:, 1])
    hidden = np.zeros(len(gaussians))
    hidden[bears] = facing[bears] * hidden_share(local_depth_mm(xi, coverage, depth_mm, p.full_cover_mm), p)
    damp = np.where(road, p.damp_albedo_ratio, 1.0)
    snow = _snow_colour(np.zeros(len(gaussians)), white, p)
    return recoloured(gaussians, (1 - hidden) * damp, hidden[:, None] * snow)


def _steepness(
    field: SnowField, place: NDArray[np.float64], width: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Slope of the coverage field over a Gaussian's width [m-1]; where it is level the edge is far away."""
    x, y = place[:, 0], place[:, 1]
    along = coverage_rank(field, x + width, y) - coverage_rank(field, x - width, y)
    across = coverage_rank(field, x, y + width) - coverage_rank(field, x, y - width)
    return np.hypot(along, across) / (2 * width) + 1e-6


def _snow_colour(
    lumps: NDArray[np.floating], white: NDArray[np.floating], p: SnowCoverParameters
) -> NDArray[np.float64]:
    """Radiance of snow: hollows between lumps get and give less light."""
    return (1 + 0.03 * np.clip(np.asarray(lumps), -2, 2))[:, None] * (np.array(p.albedo) * np.asarray(white))


def _local_planes(means: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Height and slope, at every point, of the least-squares plane through its neighbours."""
    grid = ground_grid(means[:, :2], PLANE_CELL_M)
    centre = means.mean(axis=0)
    x, y, z = (means - centre).T
    ones = np.ones(len(x))
    sums = window_sums(
        grid, means[:, :2], np.column_stack((ones, x, y, z, x * x, x * y, y * y, x * z, y * z))
    )
    cells = np.floor((means[:, :2] - grid.origin) / grid.cell_m).astype(np.int64)
    n, sx, sy, sz, sxx, sxy, syy, sxz, syz = sums[cells[:, 0], cells[:, 1]].T
    mx, my, mz = sx / n, sy / n, sz / n
    # a thousandth of a cell's spread keeps lone points solvable: their plane is level
    ridge = 1e-3 * PLANE_CELL_M**2
    a, b, c = sxx / n - mx * mx + ridge, sxy / n - mx * my, syy / n - my * my + ridge
    u, v = sxz / n - mx * mz, syz / n - my * mz
    slope = np.column_stack((c * u - b * v, a * v - b * u)) / (a * c - b * b)[:, None]
    height = mz + slope[:, 0] * (x - mx) + slope[:, 1] * (y - my) + centre[2]
    return height, slope


def _shortest_axes(quats_wxyz: NDArray[np.floating], scales: NDArray[np.floating]) -> NDArray[np.float64]:
    """World direction of each Gaussian's shortest axis."""
    w, x, y, z = np.asarray(quats_wxyz, dtype=np.float64).T
    columns = np.stack(
        (
            np.column_stack((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))),
            np.column_stack((2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x))),
            np.column_stack((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))),
        ),
        axis=1,
    )
    return columns[np.arange(len(w)), np.argmin(scales, axis=1)]


def _lying(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions wxyz that turn the z axis to the normals, by the shortest way."""
    quats = np.column_stack((1 + normal[:, 2], -normal[:, 1], normal[:, 0], np.zeros(len(normal))))
    return quats / np.linalg.norm(quats, axis=1, keepdims=True)
