"""The clear light that a scene's Gaussians carry: how strong it is, and where it falls."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.spherical_harmonics import C0
from tasks.render.weather.ground_grid import GroundGrid, ground_grid, read_between, window_sums
from tasks.render.weather.sky import LUMINANCE
from tasks.scene.gaussians import Gaussians

LIGHT_CELL_M = 1.0
"""Light and shade are read over three cells: larger than a mark on the road, smaller than a building's shadow."""

SHADED_CLASSES = (
    SemanticClass.ROAD, SemanticClass.MARKING, SemanticClass.KERB, SemanticClass.SIDEWALK, SemanticClass.TERRAIN,
)  # fmt: skip
"""Ground on which the road's light and shade are softened under cloud."""


def to_linear(display: NDArray[np.floating]) -> NDArray[np.float64]:
    """sRGB display values to linear light (IEC 61966-2-1), straight on beyond 1.

    Parameters
    ----------
    display : [...] display values, not negative [1]

    Returns
    -------
    float64 [...] linear light [1]
    """
    x = np.maximum(np.asarray(display, dtype=np.float64), 0)
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def to_display(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """Linear light to sRGB display values, the inverse of `to_linear`.

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
    """Colour of every Gaussian, averaged over directions, in linear light.

    Parameters
    ----------
    gaussians : the cloud

    Returns
    -------
    float64 [N, 3] linear light [1]
    """
    colours = np.maximum(gaussians.sh[:, 0].astype(np.float64) * C0 + 0.5, 0)
    return to_linear(colours) if gaussians.display_encoded else colours


def recoloured(gaussians: Gaussians, gain: NDArray[np.floating], add: NDArray[np.floating]) -> Gaussians:
    """The cloud with every colour c turned into ``gain c + add`` in linear light.

    Parameters
    ----------
    gaussians : the cloud
    gain : [N] factor on the colour, not negative [1]
    add : [N, 3] linear light to add [1]

    Returns
    -------
    Gaussians
    """
    old = np.maximum(gaussians.sh[:, 0].astype(np.float64) * C0 + 0.5, 0)
    new = gain[:, None] * (to_linear(old) if gaussians.display_encoded else old) + add
    if gaussians.display_encoded:
        new = to_display(new)
    sh = gaussians.sh.copy()
    sh[:, 0] = (new - 0.5) / C0
    # directional detail shrinks or grows with the colour it modulates, but light from elsewhere has none
    kept = gain ** (1 / 2.2) if gaussians.display_encoded else gain
    sh[:, 1:] *= kept[:, None, None].astype(np.float32)
    return replace(gaussians, sh=sh)


@dataclass(frozen=True, kw_only=True)
class RoadLight:
    """The clear light on the road, place by place.

    Parameters
    ----------
    white : float64 [3] radiance of a white surface lying in the brighter light [1]
    grid : cells over the road
    illumination : float64 [cells] light by that brighter light; 1 where there is no road [1]
    """

    white: NDArray[np.float64]
    grid: GroundGrid
    illumination: NDArray[np.float64]


def road_light(gaussians: Gaussians, asphalt_albedo: float) -> RoadLight:
    """Read the light off the road, whose reflectance is known.

    Means over cells leave the asphalt's grain out. The upper quartile of the cells stands for the lit road:
    where half the street lies in shadow the median would not.

    Parameters
    ----------
    gaussians : the scene in clear weather
    asphalt_albedo : reflectance of dry road [1]

    Returns
    -------
    RoadLight

    Raises
    ------
    InputError
        No Gaussian is of class road.
    """
    road = gaussians.class_id == SemanticClass.ROAD
    if not road.any():
        raise InputError(
            "weather: the light is read off the road, and no Gaussian of the scene has class road"
        )
    place = gaussians.means[road, :2]
    grid = ground_grid(place, LIGHT_CELL_M)
    sums = window_sums(grid, place, np.column_stack((np.ones(len(place)), mean_colours(gaussians)[road])))
    seen = sums[..., 0] > 0.5
    cells = sums[seen, 1:] / sums[seen, :1]
    lit = np.quantile(cells, 0.75, axis=0)
    illumination = np.ones(grid.shape)
    illumination[seen] = np.clip((cells @ LUMINANCE) / max(float(lit @ LUMINANCE), 1e-9), 0.02, 2.0)
    return RoadLight(white=lit / asphalt_albedo, grid=grid, illumination=illumination)


def without_sun(gaussians: Gaussians, light: RoadLight, shadow_kept: float) -> Gaussians:
    """The scene with light and shade on the ground drawn together, as under cloud.

    Parameters
    ----------
    gaussians : the scene in clear weather
    light : the clear light on its road
    shadow_kept : power to which relative light is left [1]

    Returns
    -------
    Gaussians
        Colours of `SHADED_CLASSES` multiplied by illumination^(shadow_kept - 1).
    """
    ground = np.isin(gaussians.class_id, SHADED_CLASSES)
    gain = np.ones(len(gaussians))
    gain[ground] = read_between(light.grid, light.illumination, gaussians.means[ground, :2]) ** (
        shadow_kept - 1
    )
    return recoloured(gaussians, gain, np.zeros((len(gaussians), 3)))


def appended(gaussians: Gaussians, layer: Gaussians) -> Gaussians:
    """Two clouds of one colour space as one.

    Parameters
    ----------
    gaussians : comes first
    layer : comes last; same number of harmonics

    Returns
    -------
    Gaussians
    """
    arrays: dict[str, Any] = {
        member.name: np.concatenate((getattr(gaussians, member.name), getattr(layer, member.name)))
        for member in fields(Gaussians)
        if isinstance(getattr(gaussians, member.name), np.ndarray)
    }
    return replace(gaussians, **arrays)
