"""Street trees, and the hedges and gardens that close the gaps between houses."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import fractal_noise, named_generator
from tasks.scene.street.plan import Building, Tree
from tasks.scene.street.surfels import (
    Cover,
    Grain,
    Surfels,
    build_panel,
    build_tube,
    join_surfels,
    tile_surface,
)

Floats = NDArray[np.float64]

LEAF_EXTINCTION = 0.9
"""Extinction of sunlight in a crown: about a quarter passes through 1.5 m of leaves [m-1]."""
_LEAF = 7.3
"""Length of a tuft of leaves where it is seen closest [px]."""
_NEAR_TWIGS = 0.2
"""Length of a tuft below which a bare crown is drawn in full [m]."""
_LAYERS = 1.7
"""Tufts over each other on the crown's surface [1]."""


def build_trees(layout: StreetLayout, planted: tuple[Tree, ...], seed: int) -> Surfels:
    """Build the surfels of all trees, class vegetation.

    Parameters
    ----------
    layout : dimensions
    planted : the trees
    seed : the street's seed [1]
    """
    parts = []
    for tree in planted:
        rng = named_generator(seed, f"tree {tree.number}")
        depth = float(nearest_depth(layout, tree.station, tree.lateral, 3.5))
        colour = palette.FOLIAGE[rng.integers(len(palette.FOLIAGE))]
        size = _LEAF * PIXEL * depth
        if layout.leaf_share > 0:
            tinted = tint_leaves(colour, layout.autumn_share, rng)
            parts.append(build_leaves(tree.balls, tinted, size, rng, layout.leaf_share))
        parts += _build_wood(tree, layout.kerb_height, rng)
        if layout.leaf_share < 0.9:
            parts.append(_build_twigs(tree, size, rng))
    return join_surfels(parts)


def tint_leaves(colour: Floats, autumn_share: float, rng: np.random.Generator) -> Floats:
    """Return the reflectance of leaves of which a share has turned, [3] [1].

    Parameters
    ----------
    colour : of green leaves [3] [1]
    autumn_share : that has turned [1]
    rng : draws the colour of autumn, if any has turned
    """
    if autumn_share == 0:
        return colour
    turned = palette.AUTUMN[rng.integers(len(palette.AUTUMN))]
    return colour + (turned - colour) * np.clip(autumn_share * rng.uniform(0.6, 1.2), 0, 1)


def build_leaves(
    balls: Floats, colour: Floats, size: float, rng: np.random.Generator, leaf_share: float = 1.0
) -> Surfels:
    """Build tufts of leaves over the outer surface of a group of balls.

    Parameters
    ----------
    balls : [K, 4] centre and radius of each ball [m]
    colour : [3] reflectance [1]
    size : length of a tuft [m]
    rng : draws places, tilts and tones
    leaf_share : share of the tufts that are there [1]
    """
    skin = balls[:, 3] ** 2
    n = int(leaf_share * _LAYERS * 4 * np.pi * skin.sum() / size**2 / 3.2)
    which = rng.choice(len(balls), n, p=skin / skin.sum())
    out = rng.standard_normal((n, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    place = balls[which, :3] + out * (balls[which, 3] * rng.uniform(0.72, 1.08, n))[:, None]
    inside = np.linalg.norm(place[:, None] - balls[None, :, :3], axis=2) / balls[:, 3]
    inside[np.arange(n), which] = 1.0
    kept = inside.min(axis=1) > 0.62
    which, out, place = which[kept], out[kept], place[kept]
    n = len(place)
    normal = out + 0.65 * rng.standard_normal((n, 3)) + [0, 0, 0.25]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    turn = np.cross(normal, rng.standard_normal((n, 3)))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    length = size * rng.uniform(0.7, 1.3, (n, 1))
    middle, top, low = balls[:, :3].mean(axis=0), balls[:, 2].max(), balls[:, 2].min()
    rise = np.clip((place[:, 2] - low) / max(top - low, 0.1), 0, 1)
    reach = np.hypot(*(balls[:, :2] - middle[:2]).T).max()
    spread = np.hypot(*(place[:, :2] - middle[:2]).T) / reach
    tone = np.exp(0.16 * rng.standard_normal((n, 1))) * (0.85 + 0.3 * rise[:, None])
    tint = 1 + rng.standard_normal((n, 1)) * [0.10, 0.03, 0.05]
    return tile_surface(
        place,
        turn * length,
        np.cross(normal, turn) * length * 0.7,
        SemanticClass.VEGETATION,
        np.clip(colour * tone * tint, 0.004, 0.6),
        openness=np.clip(0.30 + 0.35 * (out[:, 2] + 0.5) + 0.3 * np.minimum(spread, 1.2) * rise, 0.18, 1.0),
        cover=Cover(0.42, 0.93),
    )


def _build_wood(tree: Tree, ground: float, rng: np.random.Generator) -> list[Surfels]:
    foot = np.array([tree.station, tree.lateral, ground])
    fork = foot + np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 2.7])
    t = np.linspace(0, 1, 13)[:, None]
    grain = 1 + 0.22 * rng.standard_normal((8, 12, 1))
    girth = tree.girth * (1 + 0.35 * np.exp(-8 * t[:, 0]) - 0.2 * t[:, 0])
    parts = [
        build_tube(foot + t * (fork - foot), girth, 8, SemanticClass.VEGETATION, palette.BARK * np.abs(grain))
    ]
    for ball in tree.balls[rng.choice(len(tree.balls), 6, replace=False)]:
        t = np.linspace(0, 1, 6)[:, None]
        path = fork + t * (ball[:3] - fork) - [0, 0, 0.3] * (t * (1 - t))
        thin = 0.55 * tree.girth * (1 - 0.75 * t[:, 0])
        parts.append(build_tube(path - [0, 0, 0.15], thin, 5, SemanticClass.VEGETATION, 0.8 * palette.BARK))
    return parts


def _build_twigs(tree: Tree, size: float, rng: np.random.Generator) -> Surfels:
    """Build the thin branches of a crown without leaves: from the fork to each ball, and out to its surface."""
    fork = np.array([tree.station, tree.lateral, tree.balls[:, 2].min() - 0.3])
    # of a tree that is seen from afar a few wide discs are enough
    is_near = size < _NEAR_TWIGS
    t = np.linspace(0, 1, 8 if is_near else 4)[:, None]
    bark, kind = 0.8 * palette.BARK, SemanticClass.VEGETATION
    parts = [
        build_tube(
            fork + t * (ball[:3] - fork) - [0, 0, 0.25] * (t * (1 - t)), 0.03 - 0.018 * t[:, 0], 3, kind, bark
        )
        for ball in tree.balls[:: 1 if is_near else 3]
    ]
    which = np.repeat(np.arange(len(tree.balls)), 30 if is_near else 5)
    out = rng.standard_normal((len(which), 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    radius = tree.balls[which, 3:]
    begin = tree.balls[which, :3] + out * radius * rng.uniform(0.0, 0.8, (len(which), 1))
    # a twig grows outward and up, and bends up as it goes
    along = out + 0.5 * rng.standard_normal(out.shape) + np.array([0, 0, 0.4])
    along *= radius * rng.uniform(0.4, 0.7, (len(which), 1)) / np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, rng.standard_normal(out.shape))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    count, width = (3, 0.08 * size) if is_near else (1, 0.22 * size)
    pieces = []
    for k in range(count):
        step = along / count + np.array([0, 0, 0.15 * k / count]) * radius
        thin = max(0.012, width) * (1 - 0.25 * k)
        pieces.append(
            tile_surface(begin + step / 2, step, side * thin, kind, 0.94 * bark, cover=Cover(0.5, 0.85))
        )
        begin = begin + step
    return join_surfels([*parts, *pieces])


def build_gardens(layout: StreetLayout, buildings: tuple[Building, ...], seed: int) -> Surfels:
    """Build low walls, hedges, lawns and shrubs in the gaps between houses, classes other, vegetation and terrain.

    Where the ground is open, a gap stays open too.

    Parameters
    ----------
    layout : dimensions
    buildings : the houses, whose gaps are filled
    seed : the street's seed [1]
    """
    parts = []
    for house, after in pairwise(buildings):
        start, stop = house.start + house.width, after.start
        if house.side == after.side and stop - start > 1.0 and layout.open_ground == 0:
            parts += _build_garden(layout, seed, house.side, start, stop)
    return join_surfels(parts)


def _build_garden(layout: StreetLayout, seed: int, side: int, start: float, stop: float) -> list[Surfels]:
    rng = named_generator(seed, f"garden {side} {start:.3f}")
    front, ground, width = layout.front_position(side), layout.kerb_height, stop - start
    depth = float(nearest_depth(layout, start, front))
    size = 7.0 * PIXEL * depth
    brick = palette.BRICK[rng.integers(len(palette.BRICK))]
    begin = start if side > 0 else stop
    along = np.array([side * width, 0.0, 0.0])

    def corner_point(back: float, z: float) -> Floats:
        return np.array([begin, front + side * back, ground + z])

    other, green = SemanticClass.OTHER, SemanticClass.TERRAIN
    wall = [
        build_panel(corner_point(0.1, 0), along, [0, 0, 1.0], size, other, brick, grain=Grain(rng, 0.12)),
        build_panel(
            corner_point(0.05, 1.0),
            along,
            [0, side * 0.3, 0],
            0.25,
            other,
            palette.TRIM[1],
            grain=Grain(rng, 0.04),
        ),
    ]
    lawn_u, lawn_v = (along, np.array([0, side * 12.0, 0]))
    lawn = build_panel(
        corner_point(0.3, 0.05), lawn_u, lawn_v, 0.5, green, palette.GRASS, grain=Grain(rng, 0.15)
    )
    n = int(width / 0.45)
    hedge = np.column_stack(
        [
            start + (np.arange(n) + 0.5) * width / n,
            np.full(n, front + side * 0.75) + rng.uniform(-0.1, 0.1, n),
            ground + 0.95 + 0.08 * fractal_noise(rng, np.arange(n) * 0.45, np.zeros(n), 1.5, 2),
            np.full(n, 0.42),
        ]
    )
    low = hedge.copy()
    low[:, 2] -= 0.55
    shrubs = np.column_stack(
        [
            rng.uniform(start + 0.8, stop - 0.8, 16),
            front + side * rng.uniform(4.0, 8.0, 16),
            ground + rng.uniform(1.4, 5.2, 16),
            rng.uniform(0.6, 1.1, 16),
        ]
    )
    foliage = palette.FOLIAGE[rng.integers(len(palette.FOLIAGE))]
    return [
        *wall,
        lawn,
        build_leaves(np.concatenate([hedge, low]), palette.HEDGE, size, rng),
        build_leaves(shrubs, foliage, 1.4 * size, rng),
    ]
