"""The clear light in the colours of a scene's Gaussians: its intensity and its distribution."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.composition import LUMINANCE, to_linear
from tasks.render.weather.ground_grid import GroundGrid, ground_grid, read_between, window_sums
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

LIGHT_CELL_M = 0.3
"""Light and shade are read over windows of three cells: wider than the grain, narrow enough for a shadow's edge."""

ILLUMINATION_RANGE = (0.15, 1.7)
"""Relative light that can be believed; beyond it is another material."""

FACADE_DIRECTIONS = 24

LIT_ALIKE = {
    SemanticClass.ROAD: (SemanticClass.ROAD, SemanticClass.MARKING, SemanticClass.KERB),
    SemanticClass.SIDEWALK: (SemanticClass.SIDEWALK,),
}
"""Ground of nearly one reflectance, from which light and shade are read, and the classes that share its light."""


def to_display_unclipped(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return sRGB-encoded values of linear light (IEC 61966-2-1), without a limit at 1: snow in the sun is brighter.

    Parameters
    ----------
    linear : [...] linear light, not negative [1]

    Returns
    -------
    float64 [...] display values [1]
    """
    x = np.maximum(np.asarray(linear, dtype=np.float64), 0)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * x ** (1 / 2.4) - 0.055)


def mean_colours(gaussians: Gaussians) -> NDArray[np.float64]:
    """Return the colour of every Gaussian, averaged over directions, in linear light.

    Parameters
    ----------
    gaussians : the set of Gaussians

    Returns
    -------
    float64 [N, 3] linear light [1]
    """
    colours = np.maximum(gaussians.sh[:, 0].astype(np.float64) * C0 + 0.5, 0)
    return to_linear(colours).astype(np.float64) if gaussians.display_encoded else colours


def recolour_gaussians(
    gaussians: Gaussians, gain: NDArray[np.floating], add: NDArray[np.floating]
) -> Gaussians:
    """Return the Gaussians with every colour c changed to ``gain c + add`` in linear light.

    Parameters
    ----------
    gaussians : the set of Gaussians
    gain : [N], or [N, 3] by colour, factor on the colour, not negative [1]
    add : [N, 3] or [1, 3] linear light to add [1]

    Returns
    -------
    Gaussians
    """
    old = np.maximum(gaussians.sh[:, 0].astype(np.float64) * C0 + 0.5, 0)
    gain = gain[:, None] if gain.ndim == 1 else gain
    new = gain * (to_linear(old) if gaussians.display_encoded else old) + add
    if gaussians.display_encoded:
        new = to_display_unclipped(new)
    sh = gaussians.sh.copy()
    sh[:, 0] = (new - 0.5) / C0
    # directional detail scales with the colour that it modulates; added light has none
    kept = gain ** (1 / 2.2) if gaussians.display_encoded else gain
    sh[:, 1:] *= kept[:, None, :].astype(np.float32)
    return replace(gaussians, sh=sh)


@dataclass(frozen=True, kw_only=True)
class GroundLight:
    """Clear light on the ground of one class, by cells.

    Parameters
    ----------
    lit : float64 [3] radiance of that ground where it is lit [1]
    grid : cells over the ground
    illumination : float64 [cells] light relative to the lit ground [1]
    """

    lit: NDArray[np.float64]
    grid: GroundGrid
    illumination: NDArray[np.float64]


def ground_light(gaussians: Gaussians, ground: SemanticClass) -> GroundLight:
    """Return the clear light on a ground of nearly uniform reflectance.

    Means over cells remove the grain. The upper quartile of the cells represents the lit ground, because the median
    does not where half of the street is in shadow.

    Parameters
    ----------
    gaussians : the scene in clear weather
    ground : class to read

    Returns
    -------
    GroundLight

    Raises
    ------
    InputError
        No Gaussian is of that class.
    """
    member = gaussians.class_id == ground
    if not member.any():
        name = ground.name.lower()
        raise InputError(
            f"weather: the light is read off the {name}, and no Gaussian of the scene has class {name}"
        )
    place = gaussians.means[member, :2]
    grid = ground_grid(place, LIGHT_CELL_M)
    sums = window_sums(grid, place, np.column_stack((np.ones(len(place)), mean_colours(gaussians)[member])))
    seen = sums[..., 0] > 0.5
    cells = sums[seen, 1:] / sums[seen, :1]
    lit = np.quantile(cells, 0.75, axis=0)
    known = np.ones(grid.shape)
    known[seen] = np.clip((cells @ LUMINANCE) / max(float(lit @ LUMINANCE), 1e-9), *ILLUMINATION_RANGE)
    nearest = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    return GroundLight(lit=lit, grid=grid, illumination=known[tuple(nearest)])


def facade_light(gaussians: Gaussians) -> NDArray[np.float64]:
    """Return the clear light on facades by compass direction, relative to the sunny ones.

    The mean reflectance of a whole street's facades differs little from one compass direction to the next, so the
    mean colour of a direction gives its light.

    Parameters
    ----------
    gaussians : the scene in clear weather

    Returns
    -------
    float64 [N] relative light; 1 for Gaussians of other classes [1]
    """
    light = np.ones(len(gaussians))
    facade = np.flatnonzero(
        (gaussians.class_id == SemanticClass.BUILDING) & (np.abs(gaussians.normals[:, 2]) < 0.5)
    )
    if not len(facade):
        return light
    x, y = gaussians.normals[facade, 0].astype(np.float64), gaussians.normals[facade, 1].astype(np.float64)
    bins = np.arctan2(y, x) / (2 * np.pi) * FACADE_DIRECTIONS % FACADE_DIRECTIONS
    luminance = mean_colours(gaussians)[facade] @ LUMINANCE
    area = np.sort(gaussians.scales[facade].astype(np.float64), axis=1)[:, 1:].prod(axis=1)
    counted = np.bincount(bins.astype(int), area, FACADE_DIRECTIONS)
    summed = np.bincount(bins.astype(int), area * luminance, FACADE_DIRECTIONS)
    # the window spans neighbouring directions, so that a rare direction is averaged with common ones
    spread = [sum(w * np.roll(v, k) for k, w in ((-1, 0.25), (0, 1.0), (1, 0.25))) for v in (counted, summed)]
    mean = np.divide(spread[1], spread[0], out=np.full(FACADE_DIRECTIONS, np.nan), where=spread[0] > 0)
    own = np.interp(
        bins - 0.5,
        np.arange(FACADE_DIRECTIONS),
        np.nan_to_num(mean, nan=np.nanmean(mean)),
        period=FACADE_DIRECTIONS,
    )
    order = np.argsort(own)
    sunny = own[order][np.searchsorted(np.cumsum(area[order]), 0.75 * area.sum())]
    light[facade] = np.clip(own / max(sunny, 1e-9), *ILLUMINATION_RANGE)
    return light


def without_sun(gaussians: Gaussians, shadow_kept: float) -> Gaussians:
    """Return the scene with less contrast between light and shade on ground and facades, as under cloud.

    Parameters
    ----------
    gaussians : the scene in clear weather
    shadow_kept : power to which relative light is left [1]

    Returns
    -------
    Gaussians
        Colours of the classes in `LIT_ALIKE` and of facades multiplied by illumination^(shadow_kept - 1).
    """
    gain = facade_light(gaussians) ** (shadow_kept - 1)
    for ground, alike in LIT_ALIKE.items():
        if not (gaussians.class_id == ground).any():
            continue
        light = ground_light(gaussians, ground)
        members = np.isin(gaussians.class_id, alike)
        relative = read_between(light.grid, light.illumination, gaussians.means[members, :2])
        gain[members] = relative ** (shadow_kept - 1)
    return recolour_gaussians(gaussians, gain, np.zeros((len(gaussians), 3)))


def append_gaussians(gaussians: Gaussians, layer: Gaussians) -> Gaussians:
    """Return two sets of Gaussians of one colour space as one.

    Parameters
    ----------
    gaussians : comes first
    layer : comes last; same number of harmonics

    Returns
    -------
    Gaussians
    """
    own, other = _arrays(gaussians), _arrays(layer)
    joined: dict[str, Any] = {name: np.concatenate((own[name], other[name])) for name in own}
    return replace(gaussians, **joined)


def remove_gaussians(gaussians: Gaussians, index: NDArray[np.int64]) -> Gaussians:
    """Return the set without some of its Gaussians.

    Parameters
    ----------
    gaussians : the set of Gaussians
    index : int64 [B] positions of those to remove [1]

    Returns
    -------
    Gaussians
    """
    kept = np.delete(np.arange(len(gaussians)), index)
    left: dict[str, Any] = {name: array.take(kept, axis=0) for name, array in _arrays(gaussians).items()}
    return replace(gaussians, **left)


def _arrays(gaussians: Gaussians) -> dict[str, NDArray[Any]]:
    members = ((member.name, getattr(gaussians, member.name)) for member in fields(Gaussians))
    return {name: value for name, value in members if isinstance(value, np.ndarray)}
