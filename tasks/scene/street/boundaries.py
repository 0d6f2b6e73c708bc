"""Hedges, fences and walls along gardens, yards and fields."""

from typing import NamedTuple

import numpy as np

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import fractal_noise, named_generator
from tasks.scene.street.surfels import Cover, Grain, Surfels, build_panel, join_surfels, tile_surface
from tasks.scene.street.vegetation import build_leaves, tint_leaves

_GATE = 3.2
"""Gap for a gate or a drive between two lots [m]."""
_PALE, _PALE_GAP = 0.09, 0.14
"""Width of the pales of a fence and distance of their middles [m]."""
_MESH = 0.30
"""Distance of the drawn wires of a wire fence: a real mesh is finer than a pixel [m]."""


class _Line(NamedTuple):
    """What closes a lot: side of the road, 1 at the left, and where it begins, ends, runs, and its height [m]."""

    side: int
    start: float
    stop: float
    lateral: float
    height: float


def build_boundaries(layout: StreetLayout, seed: int) -> Surfels:
    """Build the surfels of what closes the lots off the road, classes vegetation and other.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    parts = [part for side in (-1, 1) for part in _build_side(layout, seed, side)]
    return join_surfels(parts)


def _build_side(layout: StreetLayout, seed: int, side: int) -> list[Surfels]:
    rng = named_generator(seed, f"boundaries {side}")
    hedge, fence, wall, mesh = layout.hedge_share, layout.fence_share, layout.wall_share, layout.mesh_share
    if hedge + fence + wall + mesh == 0:
        return []
    start, last = layout.station_range
    lateral = layout.pavement_end(side) + side * layout.boundary_distance
    parts: list[Surfels] = []
    while start < last:
        length = rng.uniform(layout.shortest_lot, layout.longest_lot)
        stop = min(start + length, last)
        choice, height = rng.random(), rng.uniform(0.8, 1.7)
        if choice < hedge:
            parts += _build_hedge(layout, rng, _Line(side, start, stop, lateral, height))
        elif choice < hedge + fence:
            parts += _build_fence(layout, rng, _Line(side, start, stop, lateral, 0.65 * height))
        elif choice < hedge + fence + wall:
            parts += _build_wall(layout, rng, _Line(side, start, stop, lateral, 0.8 * height))
        elif choice < hedge + fence + wall + mesh:
            parts += _build_mesh(layout, rng, _Line(side, start, stop, lateral, 1.2 + 0.5 * height))
        start = stop + _GATE
    return parts


def _build_hedge(layout: StreetLayout, rng: np.random.Generator, line: _Line) -> list[Surfels]:
    _, start, stop, lateral, height = line
    n = max(int((stop - start) / 0.5), 2)
    s = start + (np.arange(n) + 0.5) * (stop - start) / n
    radius = 0.36 + 0.1 * height
    top = height - radius + 0.12 * fractal_noise(rng, s, 0 * s, 2.0, 2)
    rows = max(int(np.ceil(height / (1.3 * radius))), 1)
    levels = [radius * 0.7 + (top - radius * 0.7) * (k + 1) / rows for k in range(rows)]
    balls = np.concatenate([
        np.column_stack([s, lateral + rng.uniform(-0.1, 0.1, n), layout.kerb_height + z, np.full(n, radius)])
        for z in levels
    ])  # fmt: skip
    depth = float(nearest_depth(layout, start, lateral, height / 2))
    colour = tint_leaves(palette.HEDGE * rng.uniform(0.7, 1.3), 0.5 * layout.autumn_share, rng)
    return [build_leaves(balls, colour, max(8.0 * PIXEL * depth, 0.07), rng)]


def _build_fence(layout: StreetLayout, rng: np.random.Generator, line: _Line) -> list[Surfels]:
    """Build wooden pales on two rails."""
    side, start, stop, lateral, height = line
    paint = palette.FENCES[rng.integers(len(palette.FENCES))]
    s = np.arange(start, stop, _PALE_GAP)
    z = layout.kerb_height + height * np.array([0.35, 0.8])
    centre = np.stack(np.broadcast_arrays(s[:, None], lateral, z[None]), axis=-1)
    tone = np.exp(0.08 * rng.standard_normal((len(s), 1, 1)))
    pales = tile_surface(
        centre, [side * _PALE, 0, 0], [0, 0, 0.45 * height], SemanticClass.OTHER, paint * tone, openness=0.8
    )
    rails = [
        build_panel(
            [start if side > 0 else stop, lateral + side * 0.03, layout.kerb_height + share * height - 0.04],
            [side * (stop - start), 0, 0], [0, 0, 0.08], 0.4, SemanticClass.OTHER, 0.85 * paint,
        )
        for share in (0.25, 0.75)
    ]  # fmt: skip
    return [pales, *rails]


def _build_wall(layout: StreetLayout, rng: np.random.Generator, line: _Line) -> list[Surfels]:
    side, start, stop, lateral, height = line
    stone = palette.BRICK if rng.random() < 0.5 else palette.PLASTER
    albedo = stone[rng.integers(len(stone))]
    depth = float(nearest_depth(layout, start, lateral, height / 2))
    corner = np.array([start if side > 0 else stop, lateral, layout.kerb_height])
    along, cell = np.array([side * (stop - start), 0, 0]), max(8.0 * PIXEL * depth, 0.12)
    return [
        build_panel(corner, along, [0, 0, height], cell, SemanticClass.OTHER, albedo, grain=Grain(rng, 0.10)),
        build_panel(
            corner + np.array([0, 0, height]), along, [0, side * 0.25, 0], cell, SemanticClass.OTHER, palette.TRIM[1],
            grain=Grain(rng, 0.04),
        ),
    ]  # fmt: skip


def _build_mesh(layout: StreetLayout, rng: np.random.Generator, line: _Line) -> list[Surfels]:
    """Build a wire fence: posts, and wires through which one sees."""
    side, start, stop, lateral, height = line
    steel = palette.METAL_GREY if rng.random() < 0.5 else palette.BIN_GREEN
    kind, ground = SemanticClass.OTHER, layout.kerb_height
    posts = np.arange(start, stop, 2.5)
    z = ground + (np.arange(6) + 0.5) / 6 * height
    upright = np.stack(np.broadcast_arrays(posts[:, None], lateral, z[None]), axis=-1)
    wires = np.arange(start, stop, _MESH)
    level = ground + np.arange(0.15, height, _MESH)
    run = np.stack(np.broadcast_arrays(wires[:, None], lateral, level[None]), axis=-1)
    thin = Cover(0.5, 0.55)
    return [
        tile_surface(upright, [side * 0.06, 0, 0], [0, 0, height / 6], kind, steel),
        tile_surface(run, [side * _MESH, 0, 0], [0, 0, 0.02], kind, steel, cover=thin),
        tile_surface(run, [side * 0.02, 0, 0], [0, 0, _MESH], kind, steel, cover=thin),
    ]
