"""Solids by their signed distance, and discs that cover their surface, finer where its material changes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Distance = Callable[[Floats], Floats]
"""Signed distance of points [N, 3] from a surface, negative inside; exact at the surface alone [m]."""
Material = Callable[[Floats, Floats], NDArray[np.int64]]
"""Number of the material at points [N, 3] of a surface with unit normals [N, 3]."""
_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_STEP = 1e-3


@dataclass(frozen=True, kw_only=True)
class Discs:
    """N flat discs on a surface.

    Parameters
    ----------
    centre, normal : float64 [N, 3] places [m] and outward unit normals [1]
    cell : float64 [N] edge of the square that a disc stands for [m]
    material : int64 [N] number of its material
    """

    centre: Floats
    normal: Floats
    cell: Floats
    material: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.centre)


def smooth_union(first: Floats, second: Floats, radius: float) -> Floats:
    """Return the distance from either of two solids, with a fillet of about ``radius`` [m] between them."""
    blend = np.maximum(radius - np.abs(first - second), 0) / radius
    return np.minimum(first, second) - 0.25 * radius * blend**2


def smooth_overlap(first: Floats, second: Floats, radius: float) -> Floats:
    """Return the distance from what two solids share, with edges rounded by about ``radius`` [m]."""
    return -smooth_union(-first, -second, radius)


def limb_distance(points: Floats, start: ArrayLike, stop: ArrayLike, thick: float, thin: float) -> Floats:
    """Return the distance from a limb with round ends: a rod from ``start`` to ``stop`` with a radius at each [m]."""
    origin, run = np.asarray(start, float), np.subtract(stop, start)
    along = np.clip((points - origin) @ run / float(run @ run), 0, 1)
    away = np.linalg.norm(points - origin - along[:, None] * run, axis=1)
    return away - (thick + (thin - thick) * along)


def cover_surface(
    distance: Distance, low: ArrayLike, high: ArrayLike, cell: float, material: Material, finer: int = 2
) -> Discs:
    """Return discs over the surface of a solid, one in each cube of a lattice that the surface passes through.

    Parameters
    ----------
    distance : of the solid
    low, high : [3] corners of a box about it [m]
    cell : edge of the lattice's cubes [m]
    material : of the surface; discs on its borders are cut into four, ``finer`` times
    finer : how often [1]
    """
    origin = np.asarray(low, dtype=np.float64) - 1e-4
    count = np.ceil((np.asarray(high) - origin) / cell).astype(int) + 1
    lattice = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
    inside = (distance(origin + cell * lattice) < 0).reshape(count)
    number = sum(
        inside[i : count[0] - 1 + i, j : count[1] - 1 + j, k : count[2] - 1 + k].astype(np.int8)
        for i, j, k in _CORNERS
    )
    crossed = np.argwhere((number > 0) & (number < len(_CORNERS)))
    points = origin + cell * (crossed + 0.5)
    for _ in range(3):
        normal, value = _measure_slope(distance, points)
        points = points - np.clip(value, -cell, cell)[:, None] * normal
    normal, _ = _measure_slope(distance, points)
    discs = Discs(
        centre=points, normal=normal, cell=np.full(len(points), cell), material=material(points, normal)
    )
    for _ in range(finer):
        discs = _cut_at_borders(discs, material)
    return discs


def tangents(normal: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors [N, 3] across each normal [N, 3], which complete it to right-handed axes."""
    helper = np.where(np.abs(normal[:, 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = np.cross(helper, normal)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normal, first)


def _measure_slope(distance: Distance, points: Floats) -> tuple[Floats, Floats]:
    """Return outward unit normals [N, 3], and the distance [N] made true to the first order [m]."""
    value = distance(points)
    slope = np.stack([distance(points + _STEP * axis) - value for axis in np.eye(3)], axis=1) / _STEP
    steep = np.maximum(np.linalg.norm(slope, axis=1), 1e-6)
    return slope / steep[:, None], value / steep


def _cut_at_borders(discs: Discs, material: Material) -> Discs:
    first, second = tangents(discs.normal)
    parts = [
        discs.centre + discs.cell[:, None] / 4 * (a * first + b * second) for a in (-1, 1) for b in (-1, 1)
    ]
    kinds = np.stack([material(part, discs.normal) for part in parts])
    border = (kinds != kinds[0]).any(axis=0)
    whole = ~border
    return Discs(
        centre=np.concatenate([discs.centre[whole], *(part[border] for part in parts)]),
        normal=np.concatenate([discs.normal[whole], *[discs.normal[border]] * len(parts)]),
        cell=np.concatenate([discs.cell[whole], *[discs.cell[border] / 2] * len(parts)]),
        material=np.concatenate([discs.material[whole], *(kind[border] for kind in kinds)]),
    )
