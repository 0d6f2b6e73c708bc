"""Colours of house fronts: plaster and brick, woodwork, curtains, and reflections in the panes."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street import palette
from tasks.scene.street.houses.openings import BAYS, DOOR_HEIGHT, Part
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.noise import fractal_noise, named_generator
from tasks.scene.street.plan import Building

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MIRRORED_SKY = np.array([0.15, 0.195, 0.26])
_MIRRORED_STREET = np.array([0.035, 0.034, 0.032])
OPENINGS = 1000
"""Numbers that a house has for its openings [1]."""
_SHOP_LIGHT = np.array([0.15, 0.11, 0.068])


@dataclass(frozen=True, kw_only=True)
class FrontCells:
    """N cells of house fronts.

    Parameters
    ----------
    station, height : float64 [N] middle of the cell [m]
    size : float64 [N, 2] along the street and upward [m]
    part : int64 [N] `Part`
    house : int64 [N] index of the house [1]
    kind : int64 [N] index of the bay's kind in `BAYS` [1]
    opening : int64 [N] number that the cells of one bay and storey share, `OPENINGS` apart from house to house [1]
    across : float64 [N] place in the bay, -1 to 1 [1]
    up : float64 [N] place in the glazing, 0 to 1 [1]
    """

    station: Floats
    height: Floats
    size: Floats
    part: Ints
    house: Ints
    kind: Ints
    opening: Ints
    across: Floats
    up: Floats

    @staticmethod
    def join(parts: Sequence["FrontCells"]) -> "FrontCells":
        """Concatenate the cells, in order."""
        names = [f.name for f in fields(FrontCells)]
        return FrontCells(**{name: np.concatenate([getattr(p, name) for p in parts]) for name in names})


@dataclass(frozen=True, kw_only=True)
class Look:
    """Colours and windows of one house.

    Parameters
    ----------
    colours : float64 [7, 3] reflectance of each `Part` [1]
    door : float64 [3] reflectance of the door [1]
    grain : relative deviation of the wall's reflectance from cell to cell [1]
    window : width and height of the windows [m]
    banded : every floor has a string course, not only the first
    """

    colours: Floats
    door: Floats
    grain: float
    window: tuple[float, float]
    banded: bool


def draw_look(house: Building, seed: int) -> Look:
    """Draw the house's colours and window size from its own random stream.

    Parameters
    ----------
    house : the house
    seed : the street's seed [1]
    """
    rng = named_generator(seed, f"look {house.number}")
    brick = rng.random() < 0.25
    walls = palette.CLADDING if house.clad else palette.BRICK if brick else palette.PLASTER
    wall = walls[rng.integers(len(walls))]
    plinth = palette.PLINTH if rng.random() < 0.6 else 0.6 * wall
    trim = palette.TRIM[rng.integers(len(palette.TRIM))]
    frame = palette.FRAMES[rng.integers(len(palette.FRAMES))]
    sign = palette.SHOP_SIGNS[rng.integers(len(palette.SHOP_SIGNS))]
    return Look(
        colours=np.stack([wall, trim, frame, palette.DARK_ROOM, trim, sign, plinth]),
        door=palette.DOORS[rng.integers(len(palette.DOORS))],
        grain=0.10 if brick and not house.clad else 0.025,
        window=(float(rng.uniform(1.1, 1.35)), float(rng.uniform(1.65, 1.95))),
        banded=bool(rng.random() < 0.6),
    )


def paint_fronts(
    layout: StreetLayout, cells: FrontCells, looks: Sequence[Look], seed: int
) -> tuple[Floats, Floats]:
    """Return albedo and glow of the cells.

    Parameters
    ----------
    layout : dimensions
    cells : the fronts
    looks : one per house
    seed : the street's seed [1]

    Returns
    -------
    albedo, glow : float64 [N, 3] see `Surfels` [1]
    """
    rng = named_generator(seed, "fronts")
    s, z, part = cells.station, cells.height, cells.part
    tone = 1 + 0.05 * fractal_noise(named_generator(seed, "stains"), s + 400.0 * (cells.house % 7), z, 2.5, 3)
    grain = np.array([look.grain for look in looks])[cells.house]
    # a cell averages its content: the thin cells beside the openings must not appear as streaks
    grain = grain * np.clip(cells.size.min(axis=1) / 0.3, 0.15, 1.0)
    tone += grain * rng.standard_normal(len(s)) * (part == Part.WALL)
    tone *= np.clip(0.84 + 0.06 * z, 0.0, 1.0)
    albedo = np.stack([look.colours for look in looks])[cells.house, part] * tone[:, None]
    glow = np.zeros_like(albedo)

    pane = part == Part.GLASS
    kind = np.array(BAYS)[cells.kind]
    doors = pane & (kind == "door") & (z < layout.kerb_height + DOOR_HEIGHT)
    panelling = np.where(np.abs(np.abs(cells.across) - 0.2) < 0.1, 1.1, 0.85)
    leaf = np.stack([look.door for look in looks])[cells.house] * panelling[:, None]
    albedo = np.where(doors[:, None], leaf, albedo)

    shop = pane & (kind == "shop")
    goods = np.maximum(0.55 + 0.6 * fractal_noise(named_generator(seed, "goods"), s, z, 0.7, 3), 0.05)
    inside = _SHOP_LIGHT * (goods * np.clip(1.2 - 0.6 * cells.up, 0.0, 1.0))[:, None] + _MIRRORED_STREET
    glow = np.where(shop[:, None], inside, glow)

    panes = named_generator(seed, "panes").random((OPENINGS * len(looks), 2))
    drape, glint = panes[cells.opening].T
    window = pane & ~shop & ~doors
    drawn = (drape < 0.4) & (np.abs(cells.across) > 0.2) | (drape > 0.75) & (cells.up > 2.2 - 1.8 * drape)
    albedo = np.where((window & drawn)[:, None], 0.55 * palette.CURTAIN, albedo)
    # from the road a pane mirrors the houses opposite up to their roofs, and the sky above
    ridge = 5.2 + 0.8 * fractal_noise(named_generator(seed, "opposite"), s, 0.0 * s, 4.0, 2)
    sky = np.clip((z - ridge) / 0.5 + 0.5, 0.0, 1.0) * (0.65 + 0.7 * glint) * (0.75 + 0.35 * cells.up)
    mirrored = _MIRRORED_STREET + (_MIRRORED_SKY - _MIRRORED_STREET) * sky[:, None]
    return albedo, np.where(window[:, None], mirrored * np.where(drawn, 0.8, 1.0)[:, None], glow)
