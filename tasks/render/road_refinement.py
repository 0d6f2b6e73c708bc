"""Division of road Gaussians along the road, so that they are short enough to follow a feature's shape and shading.

The length of a Gaussian suits a flat road; on a hump half a metre long it would blur the flank over the crest. The
pieces add up to the original Gaussian: the flat road looks the same.
"""

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.rasterise.preparation import rotation_matrices
from tasks.render.road_edit import RoadRelief
from tasks.scene.gaussians import Gaussians

LENGTH_BY_FEATURE = 1 / 15
"""Longest standard deviation along the road over the feature's length: a flank is seven or more of them long."""
SPACING = 1.6
"""Distance of pieces over their standard deviation: the sum of a row of them varies by a thousandth."""
REACH = 3.0
"""Extent of a Gaussian in standard deviations, for its division and for its contact with the feature."""
_PEAK = np.linspace(0, 0.995, 400)
_MASS = (_PEAK[:, None] ** np.arange(1, 1000) / np.arange(1, 1000) ** 1.5).sum(axis=1)
"""Peak opacity of a Gaussian, and its optical depth added up over a line by sqrt(2 pi) standard deviations."""


def refine_road(gaussians: Gaussians, relief: RoadRelief) -> Gaussians:
    """Return the scene with the road Gaussians about a feature cut into pieces along the road.

    A Gaussian of peak opacity o has optical depth -ln(1 - o exp(-u^2 / 2)) at u standard deviations. Its pieces have
    the optical depth of their places, so that together they absorb as much light as the whole Gaussian.

    Parameters
    ----------
    gaussians : the street
    relief : the feature

    Returns
    -------
    Gaussians
        Pieces come last; Gaussians that are short enough or off the feature are bitwise unchanged, in their order.
    """
    longest = LENGTH_BY_FEATURE * (relief.far - relief.near)
    middle = relief.route.pose((relief.near + relief.far) / 2)
    road = np.flatnonzero(np.isin(gaussians.class_id, ROAD_CLASSES))
    axes = rotation_matrices(gaussians.quats_wxyz[road])
    scales = gaussians.scales[road].astype(np.float64)
    along = np.abs(np.einsum("i,nij->nj", middle[:3, 0], axes)) * scales
    axis = np.argmax(along, axis=1)
    length = along[np.arange(len(road)), axis]
    ahead = (gaussians.means[road] - middle[:3, 3]) @ middle[:3, 0]
    touches = np.abs(ahead) < (relief.far - relief.near) / 2 + REACH * length
    cut = np.flatnonzero(touches & (length > longest))
    if not len(cut):
        return gaussians
    pieces = [
        _cut_gaussian(gaussians, road[k], axes[k, :, axis[k]], int(axis[k]), float(length[k] / longest))
        for k in cut
    ]
    joined: dict[str, Any] = {
        name: np.concatenate(
            [np.delete(getattr(gaussians, name), road[cut], axis=0), *(p[name] for p in pieces)]
        )
        for name in pieces[0]
    }
    return replace(gaussians, **joined)


def _cut_gaussian(
    gaussians: Gaussians, k: int, direction: NDArray[np.float64], axis: int, times: float
) -> dict[str, NDArray[Any]]:
    """Cut Gaussian k into pieces ``times`` shorter along one of its axes, whose world direction is given."""
    scale = float(gaussians.scales[k, axis])
    short = scale / times
    # the row of middles is shorter than the whole Gaussian, since a piece extends beyond its middle
    row = np.sqrt(scale**2 - short**2)
    half = int(np.ceil(REACH * row / (SPACING * short)))
    place = SPACING * short * np.arange(-half, half + 1)
    depth = -np.log1p(-min(float(gaussians.opacities[k]), 0.999) * np.exp(-((place / row) ** 2) / 2))
    opacity = np.interp(depth * SPACING / np.sqrt(2 * np.pi) * scale / row, _MASS, _PEAK)
    kept = opacity > 1 / 255
    count = int(kept.sum())
    names = (m.name for m in fields(Gaussians) if isinstance(getattr(gaussians, m.name), np.ndarray))
    out = {name: np.repeat(getattr(gaussians, name)[k : k + 1], count, axis=0) for name in names}
    out["means"] = (out["means"] + place[kept, None] * direction).astype(np.float32)
    out["scales"][:, axis] = short
    out["opacities"] = opacity[kept].astype(np.float32)
    if "surroundings" in out:
        # Pieces absorb as the whole did, but their opacities add up to more than its opacity.
        out["surroundings"][:, 0] *= opacity[kept].sum() / (times * gaussians.opacities[k])
    return out
