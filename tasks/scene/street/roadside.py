"""Guard rails, delineators, traffic signs, and poles with wires beside the road."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.noise import named_generator
from tasks.scene.street.surfels import Cover, Surfels, build_panel, build_tube, join_surfels, tile_surface

Floats = NDArray[np.float64]

_RAIL_AWAY, _RAIL_TOP = 0.55, 0.75
"""Distance of a guard rail from the road's edge and height of its top [m]: RPS 2009."""
_RAIL_WIDTH = 0.31
"""Height of the beam's profile [m]: W-beam of EN 1317."""
_POST_AWAY, _POST_HEIGHT, _POST_WIDTH = 0.5, 1.0, 0.12
"""Of a delineator [m]: sign 620, StVO."""
_SIGN_POLE = 0.9
_UP = np.array([0.0, 0.0, 1.0])


def build_roadside(layout: StreetLayout, seed: int) -> Surfels:
    """Build the surfels of rails, delineators and poles with wires, classes other and pole.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    return join_surfels(
        [
            *_build_rails(layout, seed),
            *_build_delineators(layout),
            *_build_wires(layout, seed),
        ]
    )


def list_signs(layout: StreetLayout, seed: int) -> list[Surfels]:
    """Build each traffic sign beside the road, for the traffic of the lane that it stands at.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    if layout.sign_spacing == 0:
        return []
    rng = named_generator(seed, "signs")
    first, last = layout.station_range
    signs = []
    station = first + rng.uniform(0.3, 1.3) * layout.sign_spacing
    while station < last - 5:
        side = -1 if rng.random() < 0.65 else 1
        shape = ("disc", "triangle", "board")[rng.choice(3, p=[0.45, 0.35, 0.2])]
        edge, look = layout.kerb_position(side), int(rng.integers(3))
        lateral = edge + side * (layout.kerb_width + _SIGN_POLE)
        signs.append(_build_sign(np.array([station, lateral, layout.kerb_height]), float(side), shape, look))
        station += rng.uniform(0.5, 1.5) * layout.sign_spacing
    return signs


def _build_sign(foot: Floats, outward: float, shape: str, look: int) -> Surfels:
    """Build a sign that faces against station where ``outward`` is -1; back and post are grey."""
    n, edge = 15, 0.7
    grid = (np.arange(n) + 0.5) / n * 2 - 1
    a, b = np.meshgrid(grid, grid, indexing="ij")
    radius = np.hypot(a, b)
    rim, field = palette.SIGN_RED, palette.WHITE_PAINT
    if shape == "disc":
        inside, border = radius < 1.0, radius > 0.74
        if look == 2:
            rim, field = palette.WHITE_PAINT, palette.SIGN_BLUE
        mark = (np.abs(b) < 0.12) & (np.abs(a) < 0.5) if look else (np.abs(a) < 0.38) & (np.abs(b) < 0.36)
    elif shape == "triangle":
        reach = (1 - b) / 2 if look else (1 + b) / 2
        inside = np.abs(a) < reach
        border = (np.abs(a) > reach - 0.26) | (b * (1 if look else -1) < -0.76)
        mark = (np.abs(a) < 0.09) & (np.abs(b + 0.15) < 0.3)
    else:
        inside, border = np.abs(b) < 0.62, (np.abs(a) > 0.93) | (np.abs(b) > 0.55)
        rim, field = (
            (palette.METAL_DARK, palette.SIGN_YELLOW) if look else (palette.WHITE_PAINT, palette.SIGN_BLUE)
        )
        mark = (np.abs(b - 0.2) < 0.1) | ((np.abs(b + 0.2) < 0.1) & (a < 0.3))
    ink = palette.METAL_DARK if field is not palette.SIGN_BLUE else palette.WHITE_PAINT
    picture = np.where(border[..., None], rim, np.where(mark[..., None], ink, field))[inside]
    offset = np.stack([0 * a, outward * a * edge / 2, b * edge / 2], axis=-1)[inside]
    middle = foot + np.array([0.06 * outward, 0, 2.35])
    across, rise = np.array([0, outward * edge / n, 0]), np.array([0, 0, edge / n])
    pole = SemanticClass.POLE
    return join_surfels(
        [
            build_tube(foot + np.linspace(0, 2.7, 16)[:, None] * _UP, 0.035, 6, pole, palette.METAL_GREY),
            tile_surface(middle + offset, across, rise, pole, picture),
            tile_surface(middle + offset - [0.02 * outward, 0, 0], -across, rise, pole, palette.METAL_GREY),
        ]
    )


def _build_rails(layout: StreetLayout, seed: int) -> list[Surfels]:
    """Build guard rails along stretches of the road, drawn for each side and 40 m."""
    rng = named_generator(seed, "rails")
    first, last = layout.station_range
    parts: list[Surfels] = []
    steel, kind = palette.ZINC, SemanticClass.OTHER
    for side in (-1, 1):
        lateral = layout.pavement_end(side) + side * _RAIL_AWAY
        for start in np.arange(first, last, 40.0):
            if rng.random() >= layout.rail_share:
                continue
            stop = min(start + 40.0, last)
            s = np.arange(start + 0.1, stop, 0.2)
            # the profile of the beam: two ridges, seen from the road
            tone = np.exp(0.05 * rng.standard_normal((len(s), 1, 1)))
            shade = np.interp(np.arange(8) / 7, [0, 0.25, 0.5, 0.75, 1], [0.9, 1.0, 0.5, 1.0, 0.6])
            z = layout.kerb_height + _RAIL_TOP - _RAIL_WIDTH * (np.arange(8) + 0.5) / 8
            centre = np.stack(np.broadcast_arrays(s[:, None], lateral, z[None]), axis=-1)
            rise = [0, 0, _RAIL_WIDTH / 8]
            parts.append(tile_surface(centre, [side * 0.2, 0, 0], rise, kind, steel * shade[:, None] * tone))
            posts = np.arange(start + 1.0, stop, 4.0)
            heights = layout.kerb_height + np.array([0.12, 0.36])
            upright = np.stack(
                np.broadcast_arrays(posts[:, None], lateral + side * 0.08, heights[None]), axis=-1
            )
            parts.append(tile_surface(upright, [side * 0.12, 0, 0], [0, 0, 0.25], kind, 0.7 * steel))
    return parts


def _build_delineators(layout: StreetLayout) -> list[Surfels]:
    """Build white posts with a black band at either edge."""
    if layout.delineator_spacing == 0:
        return []
    first, last = layout.station_range
    stations = np.arange(first + 5.0, last, layout.delineator_spacing)
    rows, columns = 20, 4
    colours = np.array([palette.WHITE_PAINT] * 14 + [palette.TYRE] * 4 + [palette.WHITE_PAINT] * 2)
    z = (np.arange(rows) + 0.5) / rows * _POST_HEIGHT
    across = ((np.arange(columns) + 0.5) / columns - 0.5) * _POST_WIDTH
    parts = []
    for side in (-1, 1):
        lateral = layout.pavement_end(side) + side * _POST_AWAY
        for outward in (-1.0, 1.0):
            centre = np.stack(
                np.broadcast_arrays(
                    stations[:, None, None] + 0.04 * outward,
                    lateral + across[:, None],
                    layout.kerb_height + z,
                ),
                axis=-1,
            )
            edge, up = [0, outward * _POST_WIDTH / columns, 0], [0, 0, _POST_HEIGHT / rows]
            parts.append(tile_surface(centre, edge, up, SemanticClass.POLE, colours))
    return parts


def _build_wires(layout: StreetLayout, seed: int) -> list[Surfels]:
    """Build wooden poles on one side, with wires that sag between them."""
    if layout.wire_spacing == 0:
        return []
    rng = named_generator(seed, "wires")
    side = int(rng.choice([-1, 1]))
    first, last = layout.station_range
    lateral, height = layout.pavement_end(side) + side * rng.uniform(1.2, 5.0), rng.uniform(7.0, 9.0)
    stations = np.arange(first + rng.uniform(0, 20), last, layout.wire_spacing)
    parts, t = [], np.linspace(0, 1, 22)[:, None]
    for station in stations:
        foot = np.array([station, lateral, layout.kerb_height])
        wood = palette.BARK * np.exp(0.1 * rng.standard_normal())
        parts.append(build_tube(foot + t * height * _UP, 0.13 - 0.05 * t[:, 0], 7, SemanticClass.POLE, wood))
        corner = foot + np.array([0.06, -0.8, height - 0.45])
        parts.append(build_panel(corner, [0, 1.6, 0], [0, 0, 0.12], 0.12, SemanticClass.POLE, wood))
        parts.append(
            build_panel(
                corner + np.array([-0.1, 1.6, 0]), [0, -1.6, 0], [0, 0, 0.12], 0.12, SemanticClass.POLE, wood
            )
        )
    way = (np.arange(60) + 0.5) / 60
    sag = -0.028 * layout.wire_spacing * 4 * way * (1 - way)
    slope = -0.028 * 4 * (1 - 2 * way)
    for a, offset in ((a, offset) for a in stations[:-1] for offset in (-0.7, 0.0, 0.7)):
        step = layout.wire_spacing / 60
        centre = np.column_stack(
            [
                a + way * layout.wire_spacing,
                np.full(60, lateral + offset),
                layout.kerb_height + height - 0.3 + sag,
            ]
        )
        along = np.column_stack([np.full(60, step), 0 * way, slope * step])
        parts.append(
            tile_surface(
                centre, along, [0, 0, 0.025], SemanticClass.OTHER, palette.TYRE, cover=Cover(0.6, 0.8)
            )
        )
    return parts
