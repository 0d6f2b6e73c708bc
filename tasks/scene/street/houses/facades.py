"""House fronts, cut into cells that follow the openings."""

from collections.abc import Mapping
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street.houses.facade_paint import OPENINGS, FrontCells, Look, draw_look, paint_fronts
from tasks.scene.street.houses.openings import (
    BAYS,
    Part,
    Pattern,
    bay_patterns,
    drop_thin_parts,
    storey_pattern,
)
from tasks.scene.street.layout import EYE_HEIGHT, PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Building
from tasks.scene.street.surfels import Surfels, build_panel, graded_cells, join_surfels, tile_surface

Floats = NDArray[np.float64]

_CELL = (18.0, 12.0)
"""Largest width and height of a wall cell where it is seen closest [px]."""
_SCATTER = 0.1
"""Largest distance of a disc from its column over the cell's width [1]. Discs of one column are equally far from a
level camera: the sign of its pitch would decide which of them cover which, and the front's picture would jump."""
_THINNEST = (0.08, 0.11)
"""Width and height of the thinnest part by those of the largest cell [1]."""
_FORESHORTENED = 1.5
"""Width of a fine cell by its height [1]."""
_FINE_GROWTH = 0.5
"""Width of a cell by its distance from the nearest edge of a fine front; three hundredths of its disc pass that [1]."""
_RECESS = np.array([0.0, -0.03, 0.10, 0.14, -0.06, -0.08, -0.04])
"""Distance of each part behind the wall's surface [m]."""
_BEHIND = 1.0
"""Distance of a fine front's back behind the wall's surface [m]."""
_REVEAL, _REVEAL_CELLS = (-0.03, 0.16), 4
"""Distance behind the wall's surface at which a reveal begins and ends [m], and cells between [1]."""


def build_facades(
    layout: StreetLayout,
    buildings: tuple[Building, ...],
    seed: int,
    edges: Mapping[int, float | None] | None = None,
) -> Surfels:
    """Build the surfels of fronts, class building.

    Parameters
    ----------
    layout : dimensions
    buildings : the houses
    seed : the street's seed [1]
    edges : position of each house that is built among all, and the width of its cells beside the edges of openings [m],
        None as a camera of 480x320 resolves them; None builds all houses so
    """
    if not buildings:
        return join_surfels([])
    looks = [draw_look(house, seed) for house in buildings]
    grids = [
        grid
        for index, edge in (edges or dict.fromkeys(range(len(buildings)))).items()
        for grid in _cut_front(layout, buildings[index], looks[index], index, edge)
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
    fronts = tile_surface(
        np.stack([cells.station + aside, front + side * _RECESS[cells.part], cells.height], axis=1),
        np.stack([side * cells.size[:, 0], zero, zero], axis=1),
        np.stack([zero, zero, cells.size[:, 1]], axis=1),
        SemanticClass.BUILDING,
        albedo,
        glow=glow,
        openness=np.where(glazed, 0.7, 1.0) * np.clip(0.55 + 0.25 * cells.height, 0.0, 1.0),
    )
    if edges is None or None in edges.values():
        return fronts
    backs = [_build_back(layout, buildings[index], looks[index]) for index in edges]
    return join_surfels([fronts, _build_reveals(cells, looks, front, side), *backs])


def _build_back(layout: StreetLayout, house: Building, look: Look) -> Surfels:
    """Build what closes a house behind its front, through which a twentieth of the light passes."""
    front = layout.front_position(house.side) + house.side * (house.setback + _BEHIND)
    rise = house.eaves_height(layout) - layout.kerb_height
    origin = [house.start + house.width * (house.side < 0), front, layout.kerb_height]
    across, wall = [house.side * house.width, 0, 0], look.colours[Part.WALL]
    return build_panel(origin, across, [0, 0, rise], 0.5, SemanticClass.BUILDING, wall)


def _build_reveals(cells: FrontCells, looks: list[Look], front: Floats, side: Floats) -> Surfels:
    """Close what fine cells leave open between wall and frame: the far jamb and the head of each opening."""
    frame = np.flatnonzero(cells.part == Part.FRAME)
    _, opening = np.unique(cells.opening[frame], return_inverse=True)
    depth = (_REVEAL[1] - _REVEAL[0]) / _REVEAL_CELLS
    parts = []
    for middle, axis in ((cells.station, 0), (cells.height, 1)):
        end = (middle + cells.size[:, axis] / 2)[frame]
        last = np.full(opening.max() + 1, -np.inf)
        np.maximum.at(last, opening, end)
        at, edge = frame[end > last[opening] - 1e-6], last[opening][end > last[opening] - 1e-6]
        back = _REVEAL[0] + depth * (np.arange(_REVEAL_CELLS)[:, None] + 0.5)
        zero, inward = np.zeros(len(at)), np.full(len(at), -depth)
        along = np.stack(
            [[cells.size[at, 0], zero, zero], [zero, zero, cells.size[at, 1]]][axis == 0], axis=-1
        )
        deep = np.stack([zero, inward, zero], axis=-1)
        station, height = (cells.station[at], edge) if axis else (edge, cells.height[at])
        lateral = front[at] + side[at] * back
        centre = np.stack(np.broadcast_arrays(station, lateral, height), axis=-1)
        parts.append(
            tile_surface(
                centre,
                *((along, deep) if axis else (deep, along)),
                SemanticClass.BUILDING,
                np.stack([look.colours[Part.TRIM] for look in looks])[cells.house[at]],
                openness=0.5,
            )
        )
    return join_surfels(parts)


def _cut_front(
    layout: StreetLayout, house: Building, look: Look, index: int, edge: float | None
) -> list[FrontCells]:
    ground = bay_patterns(layout.ground_storey_height, house.bay, look.window)
    grids = []
    for k in range(house.bays):
        kind = "door" if k == house.door else "shop" if house.shop else "window"
        grids += _cut_bays(layout, house, index, (k, 1), 0, ground[kind], kind, edge)
    for storey in range(1, house.storeys):
        pattern = storey_pattern(
            layout.storey_height, house.bay, look.window, banded=look.banded or storey == 1
        )
        grids += _cut_bays(layout, house, index, (0, house.bays), storey, pattern, "window", edge)
    return grids


def _cut_bays(
    layout: StreetLayout,
    house: Building,
    index: int,
    bays: tuple[int, int],
    storey: int,
    pattern: tuple[Pattern, Pattern],
    kind: str,
    edge: float | None,
) -> list[FrontCells]:
    """Cut the cells of some bays (first, count) of one storey."""
    bottom = layout.kerb_height + (layout.ground_storey_height + (storey - 1) * layout.storey_height) * (
        storey > 0
    )
    at = house.nearest_station, layout.front_position(house.side)
    depth, lowest = (float(nearest_depth(layout, *at, z)) for z in (bottom, EYE_HEIGHT))
    cell = np.array(_CELL) * PIXEL * depth
    fine: tuple[float | None, float | None] = None, None
    if edge is None:
        least = np.array(_THINNEST) * cell
    else:
        # upper storeys enter the picture further away, and a front is seen foreshortened
        tall = edge * depth / lowest
        fine = _FORESHORTENED * tall, tall
        least = np.array((_FORESHORTENED, 1.0)) * tall / 2
    columns, rows = (drop_thin_parts(*one) for one in zip(pattern, least, strict=True))
    glazed = np.array([part == Part.GLASS for _, part in rows])
    ends = np.cumsum([0.0, *(size for size, _ in rows)])
    panes = ends[:-1][glazed].min(), ends[1:][glazed].max()
    bay = bays[0] + np.arange(bays[1])
    whole = [(Strip(0.0, columns), Strip(0.0, rows))]
    grids = []
    for columns_of, rows_of in whole if edge is None else _part_front(columns, rows):
        x, width, across = _cut_strip(columns_of, cell[0], fine[0], house.bay)
        y, height, up = _cut_strip(rows_of, cell[1], fine[1])
        b, i, j = np.meshgrid(bay, np.arange(len(x)), np.arange(len(y)), indexing="ij")
        grids.append(
            FrontCells(
                station=(house.start + b * house.bay + x[i]).ravel(),
                height=(bottom + y[j]).ravel(),
                size=np.stack([width[i], height[j]], axis=-1).reshape(-1, 2),
                part=np.where(up[j] >= Part.BAND, up[j], np.minimum(across[i], up[j])).ravel(),
                house=np.full(b.size, index),
                kind=np.full(b.size, BAYS.index(kind)),
                opening=(storey * house.bays + b).ravel() + OPENINGS * index,
                across=(2 * x[i] / house.bay - 1).ravel(),
                up=((y[j] - panes[0]) / (panes[1] - panes[0])).ravel(),
            )
        )
    return grids


class Strip(NamedTuple):
    """Neighbouring parts of a pattern: where they begin [m], the parts, and whether something ends at their edges."""

    begin: float
    parts: Pattern
    edged: bool = True


def _part_front(columns: Pattern, rows: Pattern) -> list[tuple[Strip, Strip]]:
    """Divide a bay into blocks, so that plain wall has no finer cells than its own edges need."""
    blocks = []
    across = Strip(0.0, [(sum(size for size, _ in columns), Part.GLASS)], edged=False)
    for level in _split_pattern(rows):
        if not level.edged:
            blocks.append((across, level._replace(edged=True)))
            continue
        up = Strip(level.begin, [(sum(size for size, _ in level.parts), Part.GLASS)], edged=False)
        blocks += [
            (part._replace(edged=True), level if part.edged else up) for part in _split_pattern(columns)
        ]
    return blocks


def _split_pattern(pattern: Pattern) -> list[Strip]:
    """Return the openings of a pattern, which are edged, and the walls between them."""
    strips, at = [], 0.0
    for opens, parts in groupby(pattern, key=lambda one: one[1] in (Part.TRIM, Part.FRAME, Part.GLASS)):
        run = list(parts)
        strips.append(Strip(at, run, opens))
        at += sum(size for size, _ in run)
    return strips


def _cut_strip(
    strip: Strip, cell: float, edge: float | None, bay: float = np.inf
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return middle [m], width [m] and part of the cells along one side of a grid: walls are cut finely at their ends,
    and panes and boards too where an ``edge`` says how finely. A wall goes on where the next ``bay`` [m] begins."""
    kinds = np.array([part for _, part in strip.parts])
    breaks = strip.begin + np.cumsum([0.0, *(size for size, _ in strip.parts)])
    if edge is None:
        even = np.isin(kinds, (Part.GLASS, Part.SIGN, Part.PLINTH))
        middle, width, interval = graded_cells(breaks, cell, np.where(even, 1.0, 0.36))
    else:
        if strip.edged and bay < np.inf and kinds[0] == Part.WALL:
            breaks += np.diff(breaks) * ([-1, 0] if strip.begin == 0 else [0, 1])
        middle, width, interval = graded_cells(
            breaks, cell, edge / cell if strip.edged else 1.0, _FINE_GROWTH
        )
    own = (middle > 0) & (middle < bay)
    return middle[own], width[own], kinds[interval[own]]
