"""Kerbs and paved footways."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import fractal_noise, named_generator
from tasks.scene.street.plan import Tree
from tasks.scene.street.surfels import Surfels, join_surfels, tile_surface

_CELL = 5.2
"""Width of a paving cell where it is seen closest [px]."""
_SLAB = np.array([0.23, 0.215, 0.195])
_GRANITE = np.array([0.26, 0.255, 0.25])
_KERBSTONE = 1.0
_PIT = 0.58
"""Half the side of the open earth about a tree [m]."""


def build_pavement(layout: StreetLayout, planted: tuple[Tree, ...], seed: int) -> Surfels:
    """Build the surfels of the kerbstones (class kerb), the slabs (sidewalk) and the earth about the trees (terrain).

    There are none without a pavement.

    Parameters
    ----------
    layout : dimensions
    planted : the trees
    seed : the street's seed [1]
    """
    if not layout.has_pavement:
        return join_surfels([])
    parts = []
    for side in (-1, 1):
        parts += [_build_kerb(layout, seed, side), *_build_slabs(layout, seed, side)]
    return _add_tree_pits(join_surfels(parts), planted, seed)


def _add_tree_pits(paving: Surfels, planted: tuple[Tree, ...], seed: int) -> Surfels:
    s, d = paving.centre[:, 0], paving.centre[:, 1]
    earth = np.zeros(len(paving), dtype=bool)
    for tree in planted:
        earth |= (np.abs(s - tree.station) < _PIT) & (np.abs(d - tree.lateral) < _PIT)
    earth &= paving.class_id == SemanticClass.SIDEWALK
    tone = np.exp(0.25 * named_generator(seed, "earth").standard_normal((len(paving), 1)))
    return replace(
        paving,
        albedo=np.where(earth[:, None], palette.EARTH * tone, paving.albedo),
        class_id=np.where(earth, np.uint8(SemanticClass.TERRAIN), paving.class_id),
    )


def _build_kerb(layout: StreetLayout, seed: int, side: int) -> Surfels:
    rng = named_generator(seed, f"kerb {side}")
    first, last = layout.station_range
    face, h = layout.kerb_position(side), layout.kerb_height
    per_stone = 6
    step = _KERBSTONE / per_stone
    s = np.arange(first + step / 2, last, step)
    stone = np.floor((s - first) / _KERBSTONE).astype(np.int64)
    tone = 1 + 0.10 * rng.standard_normal(stone.max() + 1)[stone] + 0.05 * rng.standard_normal(len(s))
    joint = np.where(np.arange(len(s)) % per_stone == 0, 0.86, 1.0)
    albedo = _GRANITE * (tone * joint)[:, None]
    zero = np.zeros(len(s))
    along = np.array([step, 0, 0])
    parts = []
    rows = 2
    for row in range(rows):
        low, high = h * row / rows, h * (row + 1) / rows
        front = np.stack([s, zero + face, zero + (low + high) / 2], axis=1)
        up = np.array([0.0, 0.0, high - low])
        edge_u = along if side > 0 else -along
        parts.append(
            tile_surface(
                front, edge_u, up, SemanticClass.KERB, albedo * (0.75 + 0.25 * row), openness=0.5 + 0.3 * row
            )
        )
        d = face + side * layout.kerb_width * (row + 0.5) / rows
        top = np.stack([s, zero + d, zero + h], axis=1)
        across = np.array([0, layout.kerb_width / rows, 0])
        parts.append(tile_surface(top, along, across, SemanticClass.KERB, albedo * (1.1 - 0.08 * row)))
    return join_surfels(parts)


def _build_slabs(layout: StreetLayout, seed: int, side: int) -> list[Surfels]:
    first, last = layout.station_range
    inner = layout.kerb_position(side) + side * layout.kerb_width
    width = layout.pavement_width + 0.4  # under the fronts that stand back
    rows = round(width / layout.slab)
    slab = width / rows
    parts = []
    # stretches of similar distance share one number of cells per slab
    end = layout.route_length
    for start, stop in pairwise(np.unique(np.clip([first, -2.0, end + 4.0, end + 20.0, last], first, last))):
        rng = named_generator(seed, f"slabs {side} {start:.3f}")
        for row in range(rows):
            middle = inner + side * slab * (row + 0.5)
            depth = float(nearest_depth(layout, start if start >= 0 else min(stop, 0.0) - 1e-9, middle))
            across = int(np.clip(round(slab / (_CELL * PIXEL * depth)), 1, 6))
            along = int(np.clip(round(slab / (2.5 * _CELL * PIXEL * depth)), 1, 4))
            n = max(round((stop - start) / slab), 1)
            length = (stop - start) / n
            i, a, b = np.meshgrid(np.arange(n), np.arange(along), np.arange(across), indexing="ij")
            s = start + (i + 0.5 * (row % 2) + (a + 0.5) / along) * length
            d = middle + slab * ((b + 0.5) / across - 0.5)
            tone = 1 + 0.09 * rng.standard_normal(n)[i] + 0.035 * rng.standard_normal(i.shape)
            tone += 0.06 * fractal_noise(named_generator(seed, "pavement"), s, d, 3.0, 3)
            at_joint = (a == 0) * (along > 1) | (b == 0) * (across > 2)
            tone *= np.where(at_joint, 0.80, 1.04)
            to_wall = layout.pavement_width - np.abs(d - inner)
            parts.append(
                tile_surface(
                    np.stack([s, d, np.full(s.shape, layout.kerb_height)], axis=-1),
                    np.array([length / along, 0, 0]),
                    np.array([0, slab / across, 0]),
                    SemanticClass.SIDEWALK,
                    _SLAB * tone[..., None],
                    openness=np.clip(0.55 + 0.9 * to_wall, 0.4, 1.0),
                )
            )
    return parts
