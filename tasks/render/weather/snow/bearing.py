"""How much of the snow that falls on open ground a surface bears.

A surface bears snow as far as it faces up and nothing hangs above it. Of a scene whose normals are exact, each
Gaussian's own says how it lies. In a reconstruction they scatter from disc to disc by tens of degrees, and snow that
followed them would lie in specks; there the mean normal of its neighbours says it, of the ground for the ground and of
what stands for what stands, and the topmost edge of what stands is covered whichever way its discs are turned.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.weather.snow.road_anchors import AnchorParameters
from tasks.render.weather.snow.shelter import SOLID_SHARE
from tasks.scene.gaussians import Gaussians

GROUND_CLASSES = (*ROAD_CLASSES, SemanticClass.KERB, SemanticClass.SIDEWALK, SemanticClass.TERRAIN)
SOFT_GROUND = (SemanticClass.SIDEWALK, SemanticClass.TERRAIN)
"""Ground that lies as its neighbours do; a kerb has a face of its own."""
NO_SURFACE = (*ROAD_CLASSES, SemanticClass.VEGETATION, SemanticClass.POLE, SemanticClass.SKY)
"""Classes whose normals say nothing of how exact a scene's are: leaves and rods turn everywhere, and the road of a
reconstruction is made even."""
CELL_M = 0.15
"""Edge of the cells over which normals are averaged, three by three by three, and in which tops are sought."""
KERB_CELL_M = 0.10
"""Edge of the single cell over which normals are averaged beside the road: a kerb's face is no higher than 0.15 m, and
the wider mean would lay it flat."""
KERB_REACH_M = 0.6
"""Distance from the road within which ground may step up by a kerb."""
AGREEMENT_DEG = 5.0
"""Median angle between the normals of Gaussians of one cell up to which a scene's normals are taken as exact."""
ASKED = 7
"""Of so many cells one is asked whether its normals agree."""
TOP_M = 0.12
"""Depth below the highest edge within reach at which half a cover is left."""
OPAQUE_SHARE = 0.5
"""Area of discs, by a cell's, that makes a top; a stray disc makes none [1]."""


def bearing_share(gaussians: Gaussians, anchors: AnchorParameters) -> NDArray[np.float64]:
    """Share of the snow of open ground that each Gaussian bears.

    Parameters
    ----------
    gaussians : the scene
    anchors : gives the tilt up to which a surface bears all

    Returns
    -------
    float64 [N] share [1]
    """
    kind = gaussians.class_id
    share = facing_share(np.where(kind == SemanticClass.SKY, 0.0, gaussians.normals[:, 2]), anchors)
    if normals_agree(gaussians):
        return share
    if len(ground := np.flatnonzero(np.isin(kind, SOFT_GROUND))):
        share[ground] = facing_share(_mean_up(gaussians, ground), anchors)
        if len(beside := ground[_beside_road(gaussians, ground)]):
            face = facing_share(_cell_up(gaussians, beside), anchors)
            share[beside] = np.minimum(share[beside], face)
    if len(standing := np.flatnonzero(~np.isin(kind, (*GROUND_CLASSES, SemanticClass.SKY)))):
        mean = facing_share(_mean_up(gaussians, standing), anchors)
        share[standing] = np.maximum(mean, _top_share(gaussians, standing))
    return share


def facing_share(up: NDArray[np.floating], anchors: AnchorParameters) -> NDArray[np.float64]:
    """Share of snow that a surface of a tilt bears: all up to the tilt of the road, from there on ever less.

    Parameters
    ----------
    up : [...] upward part of the unit normal [1]
    anchors : gives the tilt up to which a surface bears all

    Returns
    -------
    float64 [...] share [1]
    """
    limit = steepest_bearing(anchors)
    return np.clip((up - limit) / limit, 0, 1)


def steepest_bearing(anchors: AnchorParameters) -> float:
    """Upward part of a normal from which on a surface bears some snow; at twice that it bears all [1]."""
    return 0.5 * float(np.cos(np.deg2rad(anchors.tilt_limit_deg)))


def normals_agree(gaussians: Gaussians) -> bool:
    """Whether the normals of neighbours agree so well that each can be taken at its word.

    Parameters
    ----------
    gaussians : the scene
    """
    index = np.flatnonzero(~np.isin(gaussians.class_id, NO_SURFACE))
    if not len(index):
        return True
    keys, _ = _cell_keys(gaussians.means[index])
    asked = np.flatnonzero(keys % ASKED == 0)
    order = asked[np.argsort(keys[asked])]
    together = np.diff(keys[order]) == 0
    normal = gaussians.normals[index[order]]
    cosine = (normal[1:] * normal[:-1]).sum(axis=1)[together]
    return not len(cosine) or float(np.median(cosine)) >= np.cos(np.deg2rad(AGREEMENT_DEG))


def _disc_areas(gaussians: Gaussians, index: NDArray[np.int64]) -> NDArray[np.float64]:
    """Area that Gaussians hide when they are seen along their shortest axes [m2]."""
    scales = np.sort(gaussians.scales[index], axis=1).astype(np.float64)
    return SOLID_SHARE * scales[:, 1] * scales[:, 2] * gaussians.opacities[index]


def _cell_keys(
    means: NDArray[np.floating], edge: float = CELL_M
) -> tuple[NDArray[np.int64], tuple[int, int]]:
    """A number for each point's cell, and by how much it grows from a cell to the next one along x and y."""
    cell = np.floor(means / edge).astype(np.int64)
    cell = cell - cell.min(axis=0) + 1
    _, across, high = cell.max(axis=0) + 2
    steps = int(across * high), int(high)
    return cell @ np.array((*steps, 1)), steps


def _mean_up(gaussians: Gaussians, index: NDArray[np.int64]) -> NDArray[np.float64]:
    """Upward part of the mean normal of the Gaussians in the cells about each, of these Gaussians alone."""
    keys, (along, across) = _cell_keys(gaussians.means[index])
    filled, cell = np.unique(keys, return_inverse=True)
    area = _disc_areas(gaussians, index)
    own: NDArray[np.float64] = np.column_stack(
        [np.bincount(cell, area * part) for part in gaussians.normals[index].T]
    )
    total, below = np.zeros(own.shape), np.vstack((np.zeros(3), np.cumsum(own, axis=0)))
    for x in (-along, 0, along):
        for y in (-across, 0, across):
            # cells above one another are next to one another
            low = np.searchsorted(filled, filled + x + y - 1)
            high = np.searchsorted(filled, filled + x + y + 1, side="right")
            total += below[high] - below[low]
    return (total[:, 2] / np.maximum(np.sqrt((total**2).sum(axis=1)), 1e-12))[cell]


def _cell_up(gaussians: Gaussians, index: NDArray[np.int64]) -> NDArray[np.float64]:
    """Upward part of the mean normal of the Gaussians in each one's own small cell, of these Gaussians alone."""
    keys, _ = _cell_keys(gaussians.means[index], KERB_CELL_M)
    _, cell = np.unique(keys, return_inverse=True)
    area = _disc_areas(gaussians, index)
    mean = np.column_stack([np.bincount(cell, area * part) for part in gaussians.normals[index].T])
    up: NDArray[np.float64] = mean[:, 2] / np.maximum(np.sqrt((mean**2).sum(axis=1)), 1e-12)
    return up[cell]


def _beside_road(gaussians: Gaussians, index: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether road lies within reach of each Gaussian, in the map's plane."""
    place = np.floor(gaussians.means[:, :2] / CELL_M).astype(np.int64)
    road, asked = place[np.isin(gaussians.class_id, ROAD_CLASSES)], place[index]
    if not len(road):
        return np.zeros(len(index), bool)
    reach = round(KERB_REACH_M / CELL_M)
    low, high = road.min(axis=0) - reach, road.max(axis=0) + reach
    paved = np.zeros(high - low + 1, np.uint8)
    paved[tuple((road - low).T)] = 1
    near = maximum_filter(paved, size=2 * reach + 1, mode="constant")
    found: NDArray[np.bool_] = ((asked >= low) & (asked <= high)).all(axis=1)
    found[found] = near[tuple((asked[found] - low).T)] > 0
    return found


def _top_share(gaussians: Gaussians, index: NDArray[np.int64]) -> NDArray[np.float64]:
    """Cover of the topmost edge of what stands: all at the highest top about a place, none well below it."""
    means = gaussians.means[index].astype(np.float64)
    place = np.floor(means[:, :2] / CELL_M).astype(np.int64)
    place -= place.min(axis=0)
    shape = place.max(axis=0) + 1
    column = place[:, 0] * shape[1] + place[:, 1]
    order = np.lexsort((-means[:, 2], column))
    above = np.cumsum(_disc_areas(gaussians, index)[order])
    first = np.flatnonzero(np.diff(column[order], prepend=-1))
    above -= np.repeat(np.concatenate(([0.0], above[first[1:] - 1])), np.diff(first, append=len(order)))
    solid = order[above >= OPAQUE_SHARE * CELL_M**2]
    top = np.full(int(shape.prod()), -np.inf)
    np.maximum.at(top, column[solid], means[solid, 2])
    highest = maximum_filter(top.reshape(shape), size=3, mode="nearest").ravel()
    return np.clip(1.5 - (highest[column] - means[:, 2]) / TOP_M, 0, 1)
