"""Open ground beside the road: grass, fields and gardens, with tufts where it is seen closest."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import EYE_HEIGHT, PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import fractal_noise, named_generator, smooth_step
from tasks.scene.street.surfels import Cover, Surfels, join_surfels, tile_surface

Floats = NDArray[np.float64]

_CELL = 8.0
"""Width of a cell where it is seen closest [px]."""
_SLENDER = (1.5, 4.0)
"""Least and greatest length of a cell over its width: the ground is seen foreshortened."""
_TUFTS = 26.0
"""Tufts of grass beside the road [m-2]."""
_TUFTED = 2.6
"""Width of the strip that has tufts [m]."""


def build_ground(layout: StreetLayout, seed: int) -> Surfels:
    """Build the surfels of the open ground, class terrain; none where the street has none.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    if layout.open_ground == 0:
        return join_surfels([])
    parts = []
    for side in (-1, 1):
        parts += [_lay_cells(layout, seed, side), _build_tufts(layout, seed, side)]
    return join_surfels(parts)


def ground_albedo(layout: StreetLayout, seed: int, s: Floats, away: Floats) -> Floats:
    """Return the reflectance of the ground: grass beside the road, and fields that change beyond it; [N, 3] [1].

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    s, away : station, and distance from the edge of the road or pavement [N] [m]
    """
    rng = named_generator(seed, "fields")
    patch = fractal_noise(named_generator(seed, "dead grass"), s, away, 4.0, 4)
    dry = layout.dead_grass_share + 0.8 * layout.bare_share
    dead = np.clip(dry + 0.25 * patch, 0, 1)[:, None]
    tone = np.exp(0.25 * fractal_noise(named_generator(seed, "grass"), s, away, 2.3, 4))[:, None]
    grass = (palette.GRASS + (palette.DEAD_GRASS - palette.GRASS) * dead) * tone
    # under trees lie leaves, and little grows
    shaded = (
        np.clip(layout.ground_trees_scale / 60, 0, 1) * smooth_step((away - 2.0) / 3.0) * (0.75 + 0.2 * patch)
    )
    grass += (palette.LITTER * tone - grass) * np.clip(shaded, 0, 1)[:, None]
    strips = palette.FIELDS[rng.integers(len(palette.FIELDS), size=(64, 4))]
    along = np.floor((s + 400.0 + 40.0 * np.sin(away / 11.0)) / rng.uniform(45, 90)).astype(np.int64) % 64
    across = np.clip((away - 6.0) / 16.0, 0, 3).astype(np.int64)
    rows = 1 + 0.12 * np.sin(2 * np.pi * (away + 0.1 * s) / 0.9)
    field = strips[along, across] * (rows * np.exp(0.12 * fractal_noise(rng, s, away, 3.0, 3)))[:, None]
    worked = smooth_step((away - 5.0) / 1.5)[:, None] * (layout.front_garden > 15) * (1 - layout.bare_share)
    green = grass + (field - grass) * worked
    lies_bare = bare_share(layout, seed, s, away)[:, None]
    return np.clip(green + (palette.choose_soil(seed) * tone**0.6 - green) * lies_bare, 0.01, 0.6)


def bare_share(layout: StreetLayout, seed: int, s: Floats, away: Floats) -> Floats:
    """Return how bare the ground lies: the shoulder, its edge that wheels wear, and patches of dry land; [N] [1].

    Parameters
    ----------
    layout, seed, s, away : as `ground_albedo` takes them
    """
    frayed = fractal_noise(named_generator(seed, "bare earth"), s, away, 1.1, 3)
    worn = np.clip(2.0 * (layout.shoulder_width - away) + 0.6 * frayed + 0.4, 0, 0.9)
    patch = fractal_noise(named_generator(seed, "bare patches"), s / 1.5, away, 6.0, 4)
    return np.maximum(worn, np.clip(0.5 + 0.9 * (patch + ndtri(layout.bare_share)), 0, 0.92))


def _lay_cells(layout: StreetLayout, seed: int, side: int) -> Surfels:
    first, last = layout.station_range
    edge, end = layout.pavement_end(side), layout.route_length
    centre, along, across = [], [], []
    stops = np.unique(np.clip([first, -2.0, end + 4.0, end + 20.0, end + 60.0, last], first, last))
    for start, stop in pairwise(stops):
        rng = named_generator(seed, f"ground {side} {start:.3f}")
        away = 0.0
        while away < layout.open_ground:
            lateral = edge + side * away
            depth = float(nearest_depth(layout, start if start >= 0 else min(stop, 0.0) - 1e-9, lateral))
            width = _CELL * PIXEL * depth
            length = width * float(np.clip(depth / EYE_HEIGHT / 2, *_SLENDER))
            n = max(round((stop - start) / length), 1)
            s = start + (np.arange(n) + rng.uniform(0.3, 0.7, n)) * (stop - start) / n
            middle = np.full(n, away + width / 2)
            centre.append(np.stack([s, middle, np.full(n, layout.kerb_height)], axis=1))
            along.append(np.full(n, (stop - start) / n))
            across.append(np.full(n, width))
            away += width
    point = np.concatenate(centre)
    albedo = ground_albedo(layout, seed, point[:, 0], point[:, 1])
    albedo *= np.exp(0.12 * named_generator(seed, f"ground grain {side}").standard_normal((len(point), 1)))
    point[:, 1] = edge + side * point[:, 1]
    zero = np.zeros(len(point))
    return tile_surface(
        point,
        np.stack([np.concatenate(along), zero, zero], axis=1),
        np.stack([zero, np.concatenate(across), zero], axis=1),
        SemanticClass.TERRAIN,
        albedo,
        cover=Cover(0.8, 0.98),
    )


def _build_tufts(layout: StreetLayout, seed: int, side: int) -> Surfels:
    """Build upright tufts beside the road, which hide the straight edge of the ground."""
    rng = named_generator(seed, f"tufts {side}")
    first, last = -2.0, layout.route_length + 40.0
    n = int(_TUFTS * _TUFTED * (last - first))
    s, away = rng.uniform(first, last, n), _TUFTED * rng.random(n) ** 1.6
    grown = rng.random(n) ** 2 > bare_share(layout, seed, s, away)
    s, away, n = s[grown], away[grown], int(grown.sum())
    height = rng.uniform(0.06, 0.20, n) * (0.6 + 0.8 * smooth_step(away / 1.0))
    turn = rng.uniform(0, np.pi, n)
    lean = rng.normal(0, 0.35, (n, 2))
    centre = np.stack(
        [s, layout.pavement_end(side) + side * away, layout.kerb_height + 0.45 * height], axis=1
    )
    across = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * (0.9 * height)[:, None]
    up = np.concatenate([lean, np.ones((n, 1))], axis=1) * height[:, None]
    albedo = ground_albedo(layout, seed, s, away) * np.exp(0.25 * rng.standard_normal((n, 1)))
    return tile_surface(
        centre, across, up, SemanticClass.TERRAIN, albedo, openness=0.75, cover=Cover(0.36, 0.9)
    )
