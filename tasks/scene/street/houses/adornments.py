"""Fixtures of house fronts: awnings, balconies, flower boxes and downpipes."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.houses.facade_paint import draw_look
from tasks.scene.street.houses.openings import SIGN_BOTTOM, Part
from tasks.scene.street.layout import PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Building
from tasks.scene.street.surfels import (
    Surfels,
    build_panel,
    build_tube,
    join_surfels,
    tile_surface,
)
from tasks.scene.street.vegetation import build_leaves

Floats = NDArray[np.float64]

_AWNING_REACH, _AWNING_DROP, _VALANCE = 1.05, 0.45, 0.2
_STRIPE = 0.4
_BALCONY_REACH, _SLAB, _RAIL_HEIGHT, _HANDRAIL = 0.8, 0.16, 0.95, 0.05
_BAR_GAP, _BAR_WIDTH = 0.16, 0.028
_BAR_CELLS = np.array([0.06, 0.14, 0.3, 0.3, 0.14, 0.06])
"""Cells of a bar by its height: the last are short, so that it ends where it does [1]."""
_PLATE = 0.5
"""Cell of a balcony's plates [m]."""
_SILL = 0.95
_KIND = SemanticClass.BUILDING


def build_adornments(layout: StreetLayout, buildings: tuple[Building, ...], seed: int) -> Surfels:
    """Build the surfels of the fixtures, classes building and vegetation.

    Parameters
    ----------
    layout : dimensions
    buildings : the houses
    seed : the street's seed [1]
    """
    parts = []
    for house in buildings:
        front = layout.front_position(house.side) + house.side * house.setback
        depth = float(nearest_depth(layout, house.nearest_station, front, 4.0))
        if depth > 40:
            continue
        rng = named_generator(seed, f"adornments {house.number}")
        parts.append(_build_downpipe(layout, house, front))
        if house.shop and house.awnings:
            parts += _build_awnings(layout, house, front, depth, rng)
        upper = [
            (
                storey,
                bay,
                layout.kerb_height + layout.ground_storey_height + (storey - 1) * layout.storey_height,
            )
            for storey in range(1, house.storeys)
            for bay in range(house.bays)
        ]
        window = draw_look(house, seed).window[0]
        slab = draw_look(house, seed).colours[Part.TRIM]
        for storey, bay, floor in upper:
            middle = house.start + (bay + 0.5) * house.bay
            if house.balconies and bay % 2 == house.bays % 2 and storey < house.storeys - 1:
                parts += _build_balcony(house, middle, front, floor, window + 0.7, slab)
            elif house.flowers and storey < 3 and rng.random() < 0.6:
                parts += _build_flower_box(house, middle, front, floor + _SILL, window, PIXEL * depth, rng)
    return join_surfels(parts)


def awning_boxes(layout: StreetLayout, buildings: tuple[Building, ...]) -> Floats:
    """Return the boxes [K, 2, 3] that cast the awnings' shadows [m]."""
    boxes = []
    for house in buildings:
        if house.shop and house.awnings:
            front = layout.front_position(house.side) + house.side * house.setback
            d = sorted((front, front - house.side * _AWNING_REACH))
            top = layout.kerb_height + SIGN_BOTTOM
            boxes += [[[a, d[0], top - 0.3], [b, d[1], top - 0.2]] for a, b in _shop_bays(house)]
    return np.array(boxes).reshape(-1, 2, 3)


def _shop_bays(house: Building) -> list[tuple[float, float]]:
    edges = house.start + house.bay * np.arange(house.bays + 1)
    return [(edges[k] + 0.08, edges[k + 1] - 0.08) for k in range(house.bays) if k != house.door]


def _build_awnings(
    layout: StreetLayout, house: Building, front: float, depth: float, rng: np.random.Generator
) -> list[Surfels]:
    cloth = palette.AWNINGS[rng.integers(len(palette.AWNINGS))]
    top = layout.kerb_height + SIGN_BOTTOM + 0.02
    rows = max(int(_AWNING_REACH / (7 * PIXEL * depth)), 3)
    parts = []
    for start, stop in _shop_bays(house):
        n = 2 * round((stop - start) / _STRIPE / 2) + 1
        per = 2
        step = (stop - start) / (n * per)
        s = start + (np.arange(n * per) + 0.5) * step
        colour = np.where((np.arange(n * per) // per % 2 == 0)[:, None, None], cloth, palette.CURTAIN)
        t = (np.arange(rows) + 0.5) / rows
        along, across = np.meshgrid(s, t, indexing="ij")
        out = np.array([0, -house.side * _AWNING_REACH, -_AWNING_DROP])
        centre = np.stack([along, front + across * out[1], top + across * out[2]], axis=-1)
        # the cloth lies face up: along the street to the left of the outward slope
        edge_u = np.array([house.side * step, 0, 0])
        parts.append(tile_surface(centre, edge_u, -out / rows, _KIND, colour * np.ones((1, rows, 1))))
        hem = np.stack(
            [s, np.full(len(s), front + out[1]), np.full(len(s), top + out[2] - _VALANCE / 2)], axis=-1
        )
        parts.append(tile_surface(hem, edge_u, [0, 0, _VALANCE], _KIND, colour[:, 0] * 0.95))
    return parts


def _build_balcony(
    house: Building, middle: float, front: float, floor: float, width: float, slab: Floats
) -> list[Surfels]:
    """Build a slab as it is seen from below, and on its three free sides bars with a handrail."""
    side, up = float(house.side), np.array([0, 0, 1.0])
    wide, deep = np.array([side * width, 0, 0]), np.array([0, -side * _BALCONY_REACH, 0])
    thick = _SLAB * up
    wall = np.array([middle, front, floor]) - wide / 2
    size = _RAIL_HEIGHT * _BAR_CELLS
    height = np.cumsum(size) - size / 2

    def panel(corner: Floats, edge_u: Floats, edge_v: Floats, albedo: Floats) -> Surfels:
        return build_panel(corner, edge_u, edge_v, _PLATE, _KIND, albedo, sharp=True)

    parts = [panel(wall - thick, wide, deep, 0.6 * slab)]
    for corner, run in ((wall, deep), (wall + deep, wide), (wall + deep + wide, -deep)):
        length = float(np.linalg.norm(run))
        share = np.arange(0, length, _BAR_GAP)[:, None, None] / length
        bars = tile_surface(
            corner + share * run + height[:, None] * up,
            _BAR_WIDTH / length * run,
            size[:, None] * up,
            _KIND,
            palette.METAL_DARK,
        )
        handrail = panel(corner + _RAIL_HEIGHT * up, run, _HANDRAIL * up, palette.METAL_DARK)
        parts += [panel(corner - thick, run, thick, slab), bars, handrail]
    return parts


def _build_flower_box(
    house: Building,
    middle: float,
    front: float,
    sill: float,
    width: float,
    pixel: float,
    rng: np.random.Generator,
) -> list[Surfels]:
    n = 5
    s = middle + (np.arange(n) + 0.5) / n * width - width / 2
    d = front - house.side * 0.16
    balls = np.column_stack([s, np.full(n, d), sill + rng.uniform(0.08, 0.14, n), np.full(n, 0.14)])
    bloom = palette.FLOWERS[rng.integers(len(palette.FLOWERS))]
    return [
        build_leaves(balls, palette.HEDGE, 4.0 * pixel, rng),
        build_leaves(balls + np.array([0, 0, 0.06, -0.02]), bloom, 2.6 * pixel, rng),
    ]


def _build_downpipe(layout: StreetLayout, house: Building, front: float) -> Surfels:
    foot = np.array([house.start, front - house.side * 0.09, layout.kerb_height])
    path = foot + np.linspace(0, 1, 16)[:, None] * [0, 0, house.eaves_height(layout) - layout.kerb_height]
    return build_tube(path, 0.055, 5, _KIND, palette.METAL_GREY)
