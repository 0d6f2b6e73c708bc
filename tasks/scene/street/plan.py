"""Positions of buildings, trees, cars and lamps, drawn from the seed before anything is built."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.noise import named_generator

Roof = Literal["flat", "pitched", "mansard"]


@dataclass(frozen=True, kw_only=True)
class Building:
    """One house front and the block behind it.

    Parameters
    ----------
    number : running number, names its random streams [1]
    side : 1 left, -1 right [1]
    start : station of its near edge [m]
    bay, bays : width of a window bay [m] and how many there are [1]
    storeys : including the ground floor [1]
    setback : of the front behind the building line [m]
    door : number of the bay with the door [1]
    shop, awnings, balconies, flowers : whether the front has them
    clad : whether it is of sheet metal
    roof : kind of roof
    beside : height of the houses that adjoin it before and after, 0 for a gap [m]
    """

    number: int
    side: int
    start: float
    bay: float
    bays: int
    storeys: int
    setback: float
    door: int
    shop: bool
    awnings: bool
    balconies: bool
    flowers: bool
    clad: bool
    roof: Roof
    beside: tuple[float, float] = (0.0, 0.0)

    @property
    def nearest_station(self) -> float:
        """Station of the end that a camera on the route comes closest to [m]."""
        return self.start + (self.width if self.start < 0 else 0.0)

    @property
    def width(self) -> float:
        """Length of the front [m]."""
        return self.bay * self.bays

    def eaves_height(self, layout: StreetLayout) -> float:
        """Height of the wall above the road [m]."""
        return layout.kerb_height + layout.ground_storey_height + (self.storeys - 1) * layout.storey_height


@dataclass(frozen=True, kw_only=True)
class Tree:
    """A street tree: a trunk and a crown of leafy balls.

    Parameters
    ----------
    number : running number [1]
    station, lateral : foot of the trunk [m]
    girth : radius of the trunk [m]
    balls : float64 [K, 4] centre in route coordinates and radius of each ball of leaves [m]
    """

    number: int
    station: float
    lateral: float
    girth: float
    balls: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Car:
    """A parked car.

    Parameters
    ----------
    number : running number [1]
    station, lateral : middle of the car [m]
    facing : 1 along the route, -1 against it [1]
    model : name of its shape
    """

    number: int
    station: float
    lateral: float
    facing: int
    model: str


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Positions of everything on the street."""

    buildings: tuple[Building, ...]
    trees: tuple[Tree, ...]
    cars: tuple[Car, ...]
    lamps: tuple[tuple[float, int], ...]


CROWN_BALLS = 26
"""Balls of leaves of a crown."""
MODELS = ("hatchback", "saloon", "estate", "suv", "van")
"""Shapes of car."""


def plan_street(layout: StreetLayout, seed: int) -> Plan:
    """Draw the positions on the street from its seed.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    first, last = layout.station_range
    # one lamp stands by the crossing; those of the other side stand between the lamps of this side
    beside = layout.crossing_station + layout.crossing_length + 1.5
    start = beside - layout.lamp_spacing * int((beside - first) / (layout.lamp_spacing or 1.0))
    lamps = (
        tuple(
            (float(s), side)
            for side, offset in ((-1, 0.0), (1, layout.lamp_spacing / 2))
            for s in np.arange(start + offset, last, layout.lamp_spacing)
        )
        if layout.lamp_spacing
        else ()
    )
    buildings = tuple(b for side in (-1, 1) for b in _row_of_houses(layout, seed, side))
    trees = tuple(t for side in (-1, 1) for t in _row_of_trees(layout, seed, side, lamps))
    trees += tuple(t for side in (-1, 1) for t in _scatter_trees(layout, seed, side, buildings))
    cars = tuple(c for side in (-1, 1) for c in _park_cars(layout, seed, side))
    return Plan(buildings=buildings, trees=trees, cars=cars, lamps=lamps)


def _row_of_houses(layout: StreetLayout, seed: int, side: int) -> list[Building]:
    rng = named_generator(seed, f"houses {side}")
    first, last = layout.station_range
    sheets = named_generator(seed, f"cladding {side}")
    houses: list[Building] = []
    fewest, most = round(layout.fewest_storeys), round(layout.most_storeys)
    station, storeys = first - rng.uniform(0, 8), (fewest + most) // 2
    flat, mansard = layout.flat_share, layout.mansard_share
    while station < last + 12:
        storeys = int(np.clip(storeys + rng.choice([-1, 1, 0, 1, -1]), fewest, most))
        bay = float(rng.uniform(2.7, 3.3))
        bays = int(rng.integers(round(layout.fewest_bays), round(layout.most_bays) + 1))
        houses.append(
            Building(
                number=2 * len(houses) + (side > 0),
                side=side,
                start=float(station),
                bay=bay,
                bays=bays,
                storeys=storeys,
                setback=float(rng.choice([0.0, 0.0, 0.15, 0.3])),
                door=int(rng.integers(bays)),
                shop=bool(rng.random() < layout.shop_share),
                awnings=bool(rng.random() < 0.6),
                balconies=bool(rng.random() < 0.4),
                flowers=bool(rng.random() < 0.4),
                clad=bool(sheets.random() < layout.cladding_share),
                roof=("flat", "pitched", "mansard")[rng.choice(3, p=[flat, 1 - flat - mansard, mansard])],
            )
        )
        gap = rng.uniform(layout.shortest_gap, layout.longest_gap) if rng.random() < layout.gap_share else 0.0
        station += bay * bays + gap
    built = named_generator(seed, f"lots {side}")
    houses = [house for house in houses if built.random() < layout.built_share]
    if not houses:
        return []
    touching = [0.0 if b.start - a.start - a.width > 0.5 else 1.0 for a, b in pairwise(houses)]
    before = [
        0.0,
        *(joined * house.eaves_height(layout) for joined, house in zip(touching, houses, strict=False)),
    ]
    after = [
        *(joined * house.eaves_height(layout) for joined, house in zip(touching, houses[1:], strict=True)),
        0.0,
    ]
    return [
        replace(house, beside=(low, high)) for house, low, high in zip(houses, before, after, strict=True)
    ]


def _row_of_trees(
    layout: StreetLayout, seed: int, side: int, lamps: tuple[tuple[float, int], ...]
) -> list[Tree]:
    rng = named_generator(seed, f"trees {side}")
    first, last = layout.station_range
    posts = np.array([s for s, post_side in lamps if post_side == side])
    lateral = layout.kerb_position(side) + side * (layout.kerb_width + 0.75)
    trees: list[Tree] = []
    for slot in np.arange(first + 4.0, last, layout.tree_spacing) if layout.tree_spacing else ():
        station = float(slot + rng.uniform(-1.5, 1.5))
        crown = _draw_crown(rng, station, lateral, layout)
        girth = float(rng.uniform(0.11, 0.17))
        beyond = station - layout.crossing_station
        near_crossing = layout.has_crossing and -9.0 < beyond < layout.crossing_length + 2.0
        if (
            rng.random() < 1 - layout.tree_share
            or near_crossing
            or np.abs(posts - station).min(initial=np.inf) < 2.0
        ):
            continue
        number = 2 * len(trees) + (side > 0)
        trees.append(Tree(number=number, station=station, lateral=lateral, girth=girth, balls=crown))
    return trees


def _scatter_trees(layout: StreetLayout, seed: int, side: int, buildings: tuple[Building, ...]) -> list[Tree]:
    """Draw trees on the open ground, in groups, where no house stands."""
    rng = named_generator(seed, f"ground trees {side}")
    first, last = layout.station_range
    edge = layout.pavement_end(side)
    trees: list[Tree] = []
    count = round(layout.ground_trees_scale * (last - first) / 100)
    while count > 0:
        group = min(int(rng.integers(1, 7)), count)
        count -= group
        # most stand near the road
        middle, away = rng.uniform(first, last), 5.0 + 0.8 * layout.open_ground * rng.random() ** 1.7
        for _ in range(group):
            station = float(middle + rng.normal(0, 6.0))
            back = float(max(away + rng.normal(0, 3.0), 4.2))
            lateral = edge + side * back
            crown = _draw_crown(rng, station, lateral, layout)
            near = any(
                b.side == side
                and b.start - 3 < station < b.start + b.width + 3
                and -3.0 < back - layout.front_garden - b.setback < 13.0
                for b in buildings
            )
            if not near and first < station < last:
                number = 10_000 + 2 * len(trees) + (side > 0)
                girth = float(rng.uniform(0.11, 0.17))
                trees.append(Tree(number=number, station=station, lateral=lateral, girth=girth, balls=crown))
    return trees


def _draw_crown(
    rng: np.random.Generator, station: float, lateral: float, layout: StreetLayout
) -> NDArray[np.float64]:
    """Draw balls of leaves that fill an egg shape: large ones inside, smaller ones around them."""
    height, radius = np.array([rng.uniform(6.3, 8.3), rng.uniform(1.7, 2.2)]) * layout.tree_scale
    base = 2.7 + layout.kerb_height
    middle = np.array([station, lateral, (base + height) / 2 + 0.2])
    half = np.array([radius, radius, (height - base) / 2])
    direction = rng.standard_normal((CROWN_BALLS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    reach = rng.uniform(0.25, 1.0, CROWN_BALLS) ** 0.5
    size = rng.uniform(0.36, 0.62, CROWN_BALLS) * (1.25 - 0.45 * reach)
    centre = middle + direction * half * (reach * 0.78)[:, None]
    return np.concatenate([centre, size[:, None] * radius / 1.5], axis=1)


def _park_cars(layout: StreetLayout, seed: int, side: int) -> list[Car]:
    rng = named_generator(seed, f"cars {side}")
    first, last = layout.station_range
    taken = named_generator(seed, f"places {side}")
    lateral = layout.kerb_position(side) - side * (layout.parking_width / 2 - 0.12)
    cars: list[Car] = []
    station = first + rng.uniform(2, 6)
    while station < last - 10:
        car = Car(
            number=2 * len(cars) + (side > 0),
            station=float(station),
            lateral=float(lateral + rng.uniform(-0.08, 0.08)),
            facing=-side,
            model=str(rng.choice(MODELS, p=[0.33, 0.2, 0.17, 0.18, 0.12])),
        )
        beyond = station - layout.crossing_station
        crossing = layout.has_crossing and -8.5 < beyond < layout.crossing_length + 5.5
        if not crossing and taken.random() < layout.parked_share:
            cars.append(car)
        station += rng.choice([5.8, 6.4, 12.0, 20.0], p=[0.27, 0.23, 0.22, 0.28]) + rng.uniform(0, 1.0)
    return cars
