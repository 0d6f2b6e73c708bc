"""Fronts that a clip comes near: with cells along their edges as fine as its camera resolves."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians
from tasks.scene.street.bend import integrate_course
from tasks.scene.street.build import pack_surfels
from tasks.scene.street.houses.facades import build_facades
from tasks.scene.street.layout import EYE_HEIGHT, StreetLayout
from tasks.scene.street.near import choose_cell, measure_approach, replace_discs
from tasks.scene.street.plan import Building, plan_street
from tasks.scene.surroundings import add_surroundings

Floats = NDArray[np.float64]

LEVELS = (0.035, 0.05, 0.07)
"""Widths of the cells beside an edge [m]."""
CELL_PX = 3.0
"""Their width where the clip comes nearest, with the focal length that its camera has [px]."""


def detail_fronts(
    gaussians: Gaussians, layout: StreetLayout, seed: int, T_world_camera: Floats, focal_px: float
) -> Gaussians:
    """Return the street with fine fronts in place of the coarse ones that a clip comes near; these come last.

    Parameters
    ----------
    gaussians : of the street with this layout and seed
    layout, seed : of the street
    T_world_camera : float64 [F, 4, 4] poses of the clip's camera [m]
    focal_px : its focal length [px]

    Raises
    ------
    InputError
        If the street is none of this layout and seed.
    """
    houses = plan_street(layout, seed).buildings
    edges = {}
    for index, house in enumerate(houses):
        cell = choose_cell(CELL_PX, _approach_front(house, layout, T_world_camera), focal_px, LEVELS)
        if cell is not None:
            edges[index] = cell
    if not edges:
        return gaussians
    corner, counts = _list_coarse(layout, seed)
    first = np.flatnonzero((gaussians.means == corner).all(axis=1))
    if len(first) != 1:
        raise InputError("the scene must be the built-in street of this version: its fronts stand elsewhere")
    ends = int(first[0]) + np.concatenate(([0], np.cumsum(counts)))
    gone = np.concatenate([np.arange(ends[index], ends[index + 1]) for index in edges])
    return replace_discs(gaussians, gone, [_make_fine(layout, seed, *one) for one in edges.items()])


def _approach_front(house: Building, layout: StreetLayout, T_world_camera: Floats) -> float:
    station = np.linspace(house.start, house.start + house.width, 4)
    front = np.full(4, layout.front_position(house.side) + house.side * house.setback)
    foot = integrate_course(layout).to_world(np.column_stack([station, front, np.full(4, EYE_HEIGHT)]))
    return min(measure_approach(point, T_world_camera)[0] for point in foot)


@lru_cache(maxsize=4)
def _list_coarse(layout: StreetLayout, seed: int) -> tuple[NDArray[np.float32], tuple[int, ...]]:
    """Return where the first disc of the fronts stands in the world [3] [m], and how many each house has."""
    houses = plan_street(layout, seed).buildings
    coarse = build_facades(layout, houses, seed)
    first = integrate_course(layout).to_world(coarse.centre[:1])[0].astype(np.float32)
    counts = [len(build_facades(layout, houses, seed, {index: None})) for index in range(len(houses))]
    return first, tuple(counts)


@lru_cache(maxsize=64)
def _make_fine(layout: StreetLayout, seed: int, index: int, edge: float) -> Gaussians:
    plan, line = plan_street(layout, seed), integrate_course(layout)
    surfels = build_facades(layout, plan.buildings, seed, {index: edge})
    return add_surroundings(pack_surfels(surfels, layout, line, plan))
