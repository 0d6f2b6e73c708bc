"""House fronts, cut into cells that follow the openings."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street.houses.facade_paint import FrontCells, Look, draw_look, paint_fronts
from tasks.scene.street.houses.openings import (
    BAYS,
    Part,
    Pattern,
    bay_patterns,
    drop_thin_parts,
    storey_pattern,
)
from tasks.scene.street.layout import PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Building
from tasks.scene.street.surfels import Surfels, graded_cells, join_surfels, tile_surface

Floats = NDArray[np.float64]

_CELL = (18.0, 12.0)
"""Largest width and height of a wall cell where it is seen closest [px]."""
_SCATTER = 0.1
"""Largest distance of a disc from its column over the cell's width [1]. Discs of one column are equally far from a
level camera: the sign of its pitch would decide which of them cover which, and the front's picture would jump."""
_RECESS = np.array([0.0, -0.03, 0.10, 0.14, -0.06, -0.08, -0.04])
"""Distance of each part behind the wall's surface [m]."""


def build_facades(layout: StreetLayout, buildings: tuple[Building, ...], seed: int) -> Surfels:
    """Build the surfels of all fronts, class building.

    Parameters
    ----------
    layout : dimensions
    buildings : the houses
    seed : the street's seed [1]
    """
    if not buildings:
        return join_surfels([])
    looks = [draw_look(house, seed) for house in buildings]
    grids = [
        grid
        for index, (house, look) in enumerate(zip(buildings, looks, strict=True))
        for grid in _cut_front(layout, house, look, index)
    ]
    cells = FrontCells.join(grids)
    side = np.array([house.side for house in buildings], dtype=np.float64)[cells.house]
    front = np.array([layout.front_position(house.side) + house.side * house.setback for house in buildings])[
        cells.house
    ]
    zero = np.zeros(len(side))
    albedo, glow = paint_fronts(layout, cells, looks, seed)
    aside = named_generator(seed, "front cells").uniform(-_SCATTER, _SCATTER, len(side)) * cells.size[:, 0]
    glazed = (cells.part == Part.GLASS) | (cells.part == Part.FRAME)
    return tile_surface(
        np.stack([cells.station + aside, front + side * _RECESS[cells.part], cells.height], axis=1),
        np.stack([side * cells.size[:, 0], zero, zero], axis=1),
        np.stack([zero, zero, cells.size[:, 1]], axis=1),
        SemanticClass.BUILDING,
        albedo,
        glow=glow,
        openness=np.where(glazed, 0.7, 1.0) * np.clip(0.55 + 0.25 * cells.height, 0.0, 1.0),
    )


def _cut_front(layout: StreetLayout, house: Building, look: Look, index: int) -> list[FrontCells]:
    ground = bay_patterns(layout.ground_storey_height, house.bay, look.window)
    grids = []
    for k in range(house.bays):
        kind = "door" if k == house.door else "shop" if house.shop else "window"
        grids.append(_cut_bays(layout, house, index, (k, 1), 0, *ground[kind], kind))
    for storey in range(1, house.storeys):
        pattern = storey_pattern(
            layout.storey_height, house.bay, look.window, banded=look.banded or storey == 1
        )
        grids.append(_cut_bays(layout, house, index, (0, house.bays), storey, *pattern, "window"))
    return grids


def _cut_bays(
    layout: StreetLayout,
    house: Building,
    index: int,
    bays: tuple[int, int],
    storey: int,
    columns: Pattern,
    rows: Pattern,
    kind: str,
) -> FrontCells:
    """Cut the cells of some bays (first, count) of one storey."""
    bottom = layout.kerb_height + (layout.ground_storey_height + (storey - 1) * layout.storey_height) * (
        storey > 0
    )
    cell = (
        np.array(_CELL)
        * PIXEL
        * nearest_depth(layout, house.nearest_station, layout.front_position(house.side), bottom)
    )
    columns, rows = drop_thin_parts(columns, 0.08 * cell[0]), drop_thin_parts(rows, 0.11 * cell[1])
    x, width, column = _cut_pattern(columns, cell[0])
    y, height, row = _cut_pattern(rows, cell[1])
    across, up = np.array([p for _, p in columns])[column], np.array([p for _, p in rows])[row]
    bay = bays[0] + np.arange(bays[1])
    b, i, j = np.meshgrid(bay, np.arange(len(x)), np.arange(len(y)), indexing="ij")
    panes = y[up == Part.GLASS]
    return FrontCells(
        station=(house.start + b * house.bay + x[i]).ravel(),
        height=(bottom + y[j]).ravel(),
        size=np.stack([width[i], height[j]], axis=-1).reshape(-1, 2),
        part=np.where(up[j] >= Part.BAND, up[j], np.minimum(across[i], up[j])).ravel(),
        house=np.full(b.size, index),
        kind=np.full(b.size, BAYS.index(kind)),
        opening=(storey * house.bays + b).ravel() + 1000 * index,
        across=(2 * x[i] / house.bay - 1).ravel(),
        up=((y[j] - panes.min()) / max(np.ptp(panes), 0.1)).ravel(),
    )


def _cut_pattern(pattern: Pattern, cell: float) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Cut cells along one side of a grid: walls finely at their ends, panes and boards evenly."""
    alike = np.array([part in (Part.GLASS, Part.SIGN, Part.PLINTH) for _, part in pattern])
    return graded_cells(np.cumsum([0.0, *(size for size, _ in pattern)]), cell, np.where(alike, 1.0, 0.36))
