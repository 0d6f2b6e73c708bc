"""Parked cars: their parts in the street, their wheels, and the shade they cast."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.cars.body import WHEEL, build_bodywork, build_car_ends
from tasks.scene.street.cars.shapes import SHAPES, SILL, Shape
from tasks.scene.street.layout import EYE_HEIGHT, PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Car
from tasks.scene.street.surfels import Surfels, build_panel, join_surfels, tile_surface

Floats = NDArray[np.float64]

_CELL = (13.5, 7.8)
"""Length and height of a cell of the body where it is seen closest [px]."""
_SHADE = np.full(3, 0.004)
_SEEN_FROM = 9.0
"""Distance before the car from which its mirror images are right [m]."""


def build_cars(layout: StreetLayout, parked: tuple[Car, ...], seed: int) -> Surfels:
    """Build the surfels of all parked cars, class vehicle.

    Parameters
    ----------
    layout : dimensions
    parked : the cars
    seed : the street's seed [1]
    """
    return join_surfels(list_cars(layout, parked, seed))


def list_cars(layout: StreetLayout, parked: tuple[Car, ...], seed: int) -> list[Surfels]:
    """Build the surfels of each parked car.

    Parameters
    ----------
    layout : dimensions
    parked : the cars
    seed : the street's seed [1]
    """
    return [_build_car(layout, car, seed) for car in parked]


def car_boxes(parked: tuple[Car, ...]) -> Floats:
    """Return the boxes [K, 2, 3] that cast the cars' shadows: body and cabin, slightly inside the surface [m]."""
    boxes = []
    for car in parked:
        shape = SHAPES[car.model]
        top = shape.roof[:, 1].max()
        lower = (0.02, 0.98, 0.92, SILL + 0.05, 0.72)
        cabin = (shape.glass[0] + 0.05, shape.glass[1] - 0.08, 0.70, 0.70, top - 0.12)
        for tail, nose, narrow, low, high in (lower, cabin):
            s = sorted(car.station + car.facing * shape.length * (end - 0.5) for end in (tail, nose))
            half = narrow * shape.width / 2
            boxes.append([[s[0], car.lateral - half, low], [s[1], car.lateral + half, high]])
    return np.array(boxes).reshape(-1, 2, 3)


def car_footprints(parked: tuple[Car, ...]) -> Floats:
    """Return the ground under the cars [K, 2, 2]: lowest and highest station and lateral position [m]."""
    rectangles = []
    for car in parked:
        length, width = 0.46 * SHAPES[car.model].length, 0.42 * SHAPES[car.model].width
        rectangles.append([[car.station + k * length, car.lateral + k * width] for k in (-1, 1)])
    return np.array(rectangles).reshape(-1, 2, 2)


def _build_car(layout: StreetLayout, car: Car, seed: int) -> Surfels:
    shape = SHAPES[car.model]
    rng = named_generator(seed, f"car {car.number}")
    paint = palette.CAR_PAINT[rng.integers(len(palette.CAR_PAINT))]
    flank = np.sign(car.lateral) * (abs(car.lateral) - shape.width / 2)
    tail = car.station - shape.length / 2
    depth = float(nearest_depth(layout, tail if tail > -2 else tail + shape.length, flank)) + 0.8
    cell = np.minimum(np.array(_CELL) * PIXEL * depth, [0.4, 0.25])
    eye = np.array([shape.length / 2 - car.facing * _SEEN_FROM, -car.facing * car.lateral, EYE_HEIGHT])
    parts = [
        build_bodywork(shape, cell, paint, eye),
        *build_car_ends(shape, cell, paint, eye),
        *_build_wheels(shape, cell),
        *_build_underside(shape),
    ]
    local = join_surfels(parts)
    turn = np.array([car.facing, car.facing, 1.0])
    origin = np.array([car.station, car.lateral, 0.0])
    middle = np.array([shape.length / 2, 0.0, 0.0])
    return replace(local, centre=(local.centre - middle) * turn + origin, axes=local.axes * turn)


def _build_wheels(shape: Shape, cell: Floats) -> list[Surfels]:
    n = int(np.clip(np.ceil(2 * WHEEL / cell[1]), 5, 11))
    grid = (np.arange(n) + 0.5) / n * 2 - 1
    a, b = np.meshgrid(grid, grid, indexing="ij")
    radius, angle = np.hypot(a, b), np.arctan2(b, a)
    spokes = np.where(np.cos(5 * angle) > -0.2, 1.0, 0.25)[..., None]
    kept = radius < 1.0
    albedo = np.where((radius < 0.64)[..., None], palette.RIM * spokes, palette.TYRE)[kept]
    step = 2 * WHEEL / n
    parts = []
    for axle in shape.axles:
        for side in (-1.0, 1.0):
            x = axle * shape.length - side * a[kept] * WHEEL
            y = np.full(x.shape, side * 0.99 * shape.width / 2)
            centre = np.stack([x, y, (b[kept] + 1) * WHEEL], axis=-1)
            edge_u, edge_v = [-side * step, 0, 0], [0, 0, step]
            parts.append(tile_surface(centre, edge_u, edge_v, SemanticClass.VEHICLE, albedo, openness=0.6))
    return parts


def _build_underside(shape: Shape) -> list[Surfels]:
    """Build dark sheets that close the space under the car, with the tyres' treads."""
    low, high, cell, kind = 0.02, SILL + 0.12, 0.15, SemanticClass.VEHICLE
    rear, front = (axle * shape.length for axle in shape.axles)
    width, up = 0.92 * shape.width, np.array([0, 0, high - low])
    parts = []
    for x, outward in ((rear - WHEEL, -1.0), (front + WHEEL, 1.0)):
        across = np.array([0, outward * width, 0])
        parts.append(build_panel([x, -across[1] / 2, low], across, up, cell, kind, _SHADE))
        for tyre in (-0.43, 0.43):
            tread = np.array([x + 0.02 * outward, tyre * shape.width - outward * 0.09, low])
            parts.append(build_panel(tread, [0, outward * 0.18, 0], up, cell, kind, palette.TYRE))
    for side in (-1.0, 1.0):
        along = np.array([-side * (front - rear), 0, 0])
        begin = [front if side > 0 else rear, side * 0.40 * shape.width, low]
        parts.append(build_panel(begin, along, up, 2 * cell, kind, _SHADE))
    return parts
