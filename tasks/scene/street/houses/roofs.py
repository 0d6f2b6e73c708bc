"""Tops and ends of the houses: cornices, roofs, chimneys and the blank walls beside lower neighbours."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.houses.facade_paint import draw_look
from tasks.scene.street.houses.openings import Part
from tasks.scene.street.layout import PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Building
from tasks.scene.street.surfels import Grain, Surfels, build_box, build_panel, join_surfels

Floats = NDArray[np.float64]

DEPTH = 10.0
"""Depth of the houses, from front to back [m]."""
_CELL = 6.0
"""Cell of a roof where it is seen closest [px]."""
_PITCH = {"flat": (0.0, 0.0), "pitched": (2.6, 3.4), "mansard": (0.9, 2.6)}
"""Run back from the eaves and rise of the roof's front slope [m]."""


def build_roofs(layout: StreetLayout, buildings: tuple[Building, ...], seed: int) -> Surfels:
    """Build the surfels above and beside the fronts, class building.

    Parameters
    ----------
    layout : dimensions
    buildings : the houses
    seed : the street's seed [1]
    """
    return join_surfels([part for house in buildings for part in _close_house(layout, house, seed)])


def _close_house(layout: StreetLayout, house: Building, seed: int) -> list[Surfels]:
    look = draw_look(house, seed)
    wall, trim = look.colours[Part.WALL], look.colours[Part.TRIM]
    rng = named_generator(seed, f"roof {house.number}")
    front = layout.front_position(house.side) + house.side * house.setback
    eaves = house.eaves_height(layout)
    cell = max(_CELL * PIXEL * float(nearest_depth(layout, house.nearest_station, front, eaves)), 0.2)
    out = float(house.side)
    along = np.array([out * house.width, 0, 0])
    start = house.start if out > 0 else house.start + house.width
    tile = palette.ROOF_TILES[rng.integers(len(palette.ROOF_TILES))]

    def corner_point(back: float, z: float) -> Floats:
        return np.array([start, front + out * back, z])

    kind = SemanticClass.BUILDING
    overhang, parapet = np.array([0, out * 0.4, 0]), np.array([0, 0, 0.7])
    parts = [
        build_panel(
            corner_point(-0.28, eaves - 0.1),
            along,
            np.array([0, 0, 0.3]),
            cell,
            kind,
            trim,
            grain=Grain(rng, 0.02),
        ),
        build_panel(
            corner_point(-0.28, eaves + 0.2), along, overhang, cell, kind, 0.8 * trim, grain=Grain(rng, 0.02)
        ),
        build_panel(
            corner_point(0.0, eaves - 0.1), along, np.array([0, -out * 0.28, 0]), cell, kind, 0.5 * trim
        ),
    ]
    run, rise = _PITCH[house.roof]
    if house.roof == "flat":
        parts.append(
            build_panel(
                corner_point(0.1, eaves + 0.1), along, parapet, cell, kind, wall, grain=Grain(rng, look.grain)
            )
        )
    else:
        slope = np.array([0, out * run, rise])
        parts.append(
            build_panel(
                corner_point(0.0, eaves + 0.2), along, slope, cell, kind, tile, grain=Grain(rng, 0.09)
            )
        )
    ends = ((house.start, -1.0), (house.start + house.width, 1.0))
    for (end, outward), neighbour in zip(ends, house.beside, strict=True):
        blank = {"cell": 1.6 * cell, "class_id": kind, "albedo": 0.8 * wall, "grain": Grain(rng, 0.03)}
        blank["sharp"] = outward < 0  # only that end faces the traffic
        # where two fronts are not aligned, some centimetres of the end wall are visible
        near, far = sorted((front, front + out * 0.35), reverse=outward < 0)
        parts.append(
            build_panel(
                [end, near, 0.0], [0, far - near, 0], [0, 0, eaves], **blank | {"cell": cell, "sharp": False}
            )
        )
        near, far = sorted((front, front + out * DEPTH), reverse=outward < 0)
        if neighbour < eaves:
            low = max(neighbour - 0.3, 0.0)
            parts.append(
                build_panel([end, near, low], [0, far - near, 0], [0, 0, eaves + 0.2 - low], **blank)
            )
        if house.roof != "flat":
            near, far = sorted((front + out * 0.6 * run, front + out * 0.6 * DEPTH), reverse=outward < 0)
            parts.append(build_panel([end, near, eaves], [0, far - near, 0], [0, 0, 0.7 * rise], **blank))
            foot = np.array([end - 0.8 * outward, front + out * (run + 0.4), eaves + 0.8 * rise])
            half = np.array([0.3, 0.5, 0.0])
            brick = palette.BRICK[rng.integers(len(palette.BRICK))]
            parts.append(
                build_box(foot - half, foot + half + [0, 0, 1.7], 0.4, kind, brick, grain=Grain(rng, 0.1))
            )
    return parts


def house_boxes(layout: StreetLayout, buildings: tuple[Building, ...]) -> Floats:
    """Return the boxes [K, 2, 3] that cast the houses' shadows: the block, the ridge and the cornice [m]."""
    boxes = []
    for house in buildings:
        front = layout.front_position(house.side) + house.side * house.setback
        eaves = house.eaves_height(layout)
        run, rise = _PITCH[house.roof]
        for near, far, low, high in (
            (0.25, DEPTH, 0.0, eaves),
            (max(run, 0.3), DEPTH - max(run, 0.3), eaves, eaves + max(rise, 0.8)),
            (-0.26, 0.1, eaves - 0.08, eaves + 0.18),
        ):
            d = sorted((front + house.side * near, front + house.side * far))
            boxes.append([[house.start, d[0], low], [house.start + house.width, d[1], high]])
    return np.array(boxes).reshape(-1, 2, 3)
