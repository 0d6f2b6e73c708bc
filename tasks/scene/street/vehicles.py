"""Parked cars: a body lofted over a side profile, glass, lamps, plates and wheels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import EYE_HEIGHT, PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import stream
from tasks.scene.street.plan import Car
from tasks.scene.street.surfels import Surfels, graded_cells, join, sheet_cells, tiles

Floats = NDArray[np.float64]

_CELL = (13.5, 7.8)
"""Length and height of a cell of the body where it is seen closest [px]."""
_SILL, _BUMPER = 0.20, 0.42
_WHEEL = 0.315
_LAMP, _PLATE = 0.56, 0.29
"""Inner edge of the lamps and half width of the number plate, over half the car's width [1]."""
_SKY, _HOUSES, _ROAD = np.array([0.42, 0.52, 0.68]), np.array([0.16, 0.15, 0.14]), np.array([0.13, 0.13, 0.125])


@dataclass(frozen=True, kw_only=True)
class Shape:
    """Side view of a car, from its tail (0) to its nose (1).

    Parameters
    ----------
    length, width : overall [m]
    roof : [n, 2] place along the length [1] and height of the outline [m]
    belt : [m, 2] the same for the line under the side windows
    glass : place along the length of the rearmost and the foremost side window [1]
    pillar : place of the pillar between the doors [1]
    axles : places of the axles [1]
    """

    length: float
    width: float
    roof: Floats
    belt: Floats
    glass: tuple[float, float]
    pillar: float
    axles: tuple[float, float] = (0.19, 0.80)


SHAPES = {
    "hatchback": Shape(
        length=4.1,
        width=1.76,
        roof=np.array(
            [[0, 0.84], [0.015, 0.95], [0.10, 1.36], [0.16, 1.44], [0.40, 1.47], [0.55, 1.42], [0.74, 0.97], [0.78, 0.93], [0.94, 0.76], [0.985, 0.68], [1, 0.60]]
        ),
        belt=np.array([[0, 0.84], [0.015, 0.94], [0.15, 0.99], [0.60, 0.94], [0.78, 0.90], [0.94, 0.74], [0.985, 0.66], [1, 0.60]]),
        glass=(0.12, 0.70),
        pillar=0.42,
    ),
    "saloon": Shape(
        length=4.6,
        width=1.81,
        roof=np.array(
            [[0, 0.86], [0.01, 0.98], [0.14, 1.03], [0.27, 1.38], [0.36, 1.44], [0.52, 1.42], [0.69, 0.98], [0.73, 0.94], [0.94, 0.77], [0.985, 0.68], [1, 0.60]]
        ),
        belt=np.array([[0, 0.86], [0.01, 0.95], [0.14, 0.99], [0.60, 0.94], [0.73, 0.91], [0.94, 0.75], [0.985, 0.66], [1, 0.60]]),
        glass=(0.22, 0.66),
        pillar=0.44,
        axles=(0.205, 0.80),
    ),
    "estate": Shape(
        length=4.6,
        width=1.81,
        roof=np.array(
            [[0, 0.86], [0.012, 0.98], [0.075, 1.38], [0.12, 1.45], [0.42, 1.48], [0.53, 1.44], [0.69, 0.98], [0.73, 0.94], [0.94, 0.77], [0.985, 0.68], [1, 0.60]]
        ),
        belt=np.array([[0, 0.86], [0.012, 0.96], [0.15, 1.0], [0.60, 0.95], [0.73, 0.91], [0.94, 0.75], [0.985, 0.66], [1, 0.60]]),
        glass=(0.09, 0.66),
        pillar=0.43,
        axles=(0.205, 0.80),
    ),
    "van": Shape(
        length=4.9,
        width=1.92,
        roof=np.array(
            [[0, 1.80], [0.03, 1.90], [0.55, 1.93], [0.66, 1.86], [0.80, 1.18], [0.84, 1.11], [0.95, 0.93], [0.985, 0.78], [1, 0.66]]
        ),
        belt=np.array([[0, 1.06], [0.66, 1.08], [0.84, 1.05], [0.95, 0.90], [0.985, 0.76], [1, 0.66]]),
        glass=(0.58, 0.76),
        pillar=0.60,
        axles=(0.19, 0.82),
    ),
}  # fmt: skip


def cars(layout: StreetLayout, parked: tuple[Car, ...], seed: int) -> Surfels:
    """Surfels of all parked cars, class vehicle.

    Parameters
    ----------
    layout : dimensions
    parked : the cars
    seed : the street's seed [1]
    """
    return join([_placed(layout, car, seed) for car in parked])


def car_boxes(parked: tuple[Car, ...]) -> Floats:
    """Boxes [K, 2, 3] that cast the cars' shadows, body and cabin, a little within the surface [m]."""
    boxes = []
    for car in parked:
        shape = SHAPES[car.model]
        top = shape.roof[:, 1].max()
        spans = ((0.02, 0.98, 0.92, _SILL + 0.05, 0.72), (shape.glass[0] + 0.05, shape.glass[1] - 0.08, 0.70, 0.7, top - 0.12))
        for tail, nose, narrow, low, high in spans:
            s = sorted(car.station + car.facing * shape.length * (end - 0.5) for end in (tail, nose))
            half = narrow * shape.width / 2
            boxes.append([[s[0], car.lateral - half, low], [s[1], car.lateral + half, high]])
    return np.array(boxes)


def footprints(parked: tuple[Car, ...]) -> Floats:
    """Ground under the cars [K, 2, 2]: lowest and highest station and lateral position [m]."""
    half = np.array([[0.46 * SHAPES[car.model].length, 0.42 * SHAPES[car.model].width] for car in parked])
    middle = np.array([[car.station, car.lateral] for car in parked])
    return np.stack([middle - half, middle + half], axis=1)


def _placed(layout: StreetLayout, car: Car, seed: int) -> Surfels:
    shape = SHAPES[car.model]
    rng = stream(seed, f"car {car.number}")
    paint = palette.CAR_PAINT[rng.integers(len(palette.CAR_PAINT))]
    flank = np.sign(car.lateral) * (abs(car.lateral) - shape.width / 2)
    tail = car.station - shape.length / 2
    depth = float(nearest_depth(layout, tail if tail > -2 else tail + shape.length, flank)) + 0.8
    cell = np.minimum(np.array(_CELL) * PIXEL * depth, [0.4, 0.25])
    eye = np.array([car.facing * -9.0, -car.facing * car.lateral, EYE_HEIGHT])
    parts = [_body(shape, cell, paint, eye), *_ends(shape, cell, paint, eye), *_wheels(shape, cell), _shade(shape)]
    local = join(parts)
    turn = np.array([car.facing, car.facing, 1.0])
    origin = np.array([car.station, car.lateral, 0.0])
    middle = np.array([shape.length / 2, 0.0, 0.0])
    return Surfels(**(vars(local) | {"centre": (local.centre - middle) * turn + origin, "axes": local.axes * turn}))


def _body(shape: Shape, cell: Floats, paint: Floats, eye: Floats) -> Surfels:
    place = np.concatenate([shape.roof[:, 0], shape.belt[:, 0], shape.glass, shape.pillar + np.array([-0.012, 0.012])])
    _, width, _ = graded_cells(np.unique(place) * shape.length, cell[0], 1.0)
    x = np.concatenate([[0.0], np.cumsum(width)])
    keys = _section(shape, x / shape.length)
    counts = np.maximum(np.ceil(np.array([0.14, 0.2, 0.3, 0.08, 0.42, 0.14, 0.62]) / (1.25 * cell[1])), 1).astype(int)
    half = np.concatenate([k + np.arange(n) / n for k, n in enumerate(counts)] + [[float(len(counts))]])
    right = np.stack([[np.interp(half, np.arange(len(counts) + 1), row) for row in key.T] for key in keys])
    outline = np.concatenate([right * [[-1], [1]], right[:, :, -2::-1]], axis=2)
    corners = np.stack([np.broadcast_to(x[:, None], outline[:, 0].shape), outline[:, 0], outline[:, 1]], axis=-1)
    centre, edge_u, edge_v = sheet_cells(corners)
    segment = np.repeat(np.arange(len(counts)), counts)
    segment = np.concatenate([segment, segment[::-1]])
    along, z = centre[..., 0] / shape.length, centre[..., 2]
    roof, belt = (np.interp(along, *line.T) for line in (shape.roof, shape.belt))
    rise = np.abs(edge_u[..., 2]) / edge_u[..., 0]

    pane = (segment == 4) & (along > shape.glass[0]) & (along < shape.glass[1]) & (roof - belt > 0.16)
    pane &= np.abs(along - shape.pillar) > 0.012
    pane |= (segment == 6) & (rise > 0.3) & (z > belt + 0.05) & (z < shape.roof[:, 1].max() - 0.03)
    arch = np.zeros(z.shape, dtype=bool)
    for axle in shape.axles:
        arch |= (segment <= 2) & (np.hypot((along - axle) * shape.length, z - _WHEEL) < _WHEEL + 0.06)
    lower = (segment == 0) & ~arch
    red = (along < 0.045) & (segment >= 2) & (segment <= 3) & ~arch
    white = (along > 0.93) & (segment >= 2) & (segment <= 3)
    seam = (segment < 4) & (np.abs(along - shape.pillar) < 0.014)

    albedo = np.broadcast_to(paint, centre.shape)
    for chosen, colour in (
        (lower, palette.PLASTIC), (seam, 0.45 * paint), (red, palette.TAIL_LIGHT), (white, palette.HEAD_LIGHT),
        (pane, np.full(3, 0.012)), (arch, np.full(3, 0.006)),
    ):  # fmt: skip
        albedo = np.where(chosen[..., None], colour, albedo)
    gloss = np.where(arch | lower, 0.0, np.where(pane, 0.10, 0.045))
    openness = np.where(arch, 0.15, np.clip(0.25 + 1.1 * z, 0.0, 1.0))
    glow = _mirrored(centre, edge_u, edge_v, gloss, eye + [shape.length / 2, 0, 0])
    return tiles(centre, edge_u, edge_v, SemanticClass.VEHICLE, albedo, glow=glow, openness=openness)


def _section(shape: Shape, along: Floats) -> Floats:
    """Corner points [len(along), 8, 2] of half a cross-section, sill to middle of the roof: half width and height [m]."""
    roof, belt = (np.interp(along, *line.T) for line in (shape.roof, shape.belt))
    end = np.maximum((np.abs(2 * along - 1) - 0.72) / 0.28, 0.0)
    wide = shape.width / 2 * (1 - 0.17 * end**2.5)
    sill = _SILL + 0.08 * end
    gap = np.maximum(roof - belt, 0.0)
    shoulder = 0.955 * wide
    top = shoulder - 0.34 * gap
    widths = [0.90 * wide, 0.985 * wide, wide, 0.985 * wide, shoulder, top, 0.86 * top, 0.0 * top]
    heights = [
        sill, sill + 0.22 * (belt - sill), sill + 0.55 * (belt - sill), belt - 0.07, belt,
        roof - np.minimum(0.07, 0.4 * gap), roof - 0.012, roof + 0.015,
    ]  # fmt: skip
    return np.stack([np.stack(widths, axis=1), np.stack(heights, axis=1)], axis=2)


def _ends(shape: Shape, cell: Floats, paint: Floats, eye: Floats) -> list[Surfels]:
    parts = []
    for along, outward in ((0.0, -1.0), (1.0, 1.0)):
        half_width, height = _section(shape, np.array([along]))[0, :6].T
        belt, roof = height[4], height[5]
        plate = (0.54, 0.66) if outward < 0 else (0.40, 0.51)
        lamp = (belt - 0.22, belt - 0.05)
        rows = np.unique([height[0], _BUMPER, *plate, *lamp, belt, *((belt + 0.08, roof - 0.12, roof) if roof > belt + 0.3 else ())])
        _, step, _ = graded_cells(rows, cell[1], 1.0)
        z = height[0] + np.concatenate([[0.0], np.cumsum(step)])
        _, step, _ = graded_cells([-1.0, -_LAMP, -_PLATE, _PLATE, _LAMP, 1.0], 2 * cell[1] / shape.width, 1.0)
        across = np.concatenate([[0.0], np.cumsum(step)])[:, None] - 1
        y = outward * across * np.interp(z, height, half_width)
        x = along * shape.length + outward * 0.09 * (1 - across**2) + 0 * z
        centre, edge_u, edge_v = sheet_cells(np.stack([x, y, np.broadcast_to(z, y.shape)], axis=-1))
        side, z = np.abs(centre[..., 1]) / (shape.width / 2), centre[..., 2]
        light = (side > _LAMP) & (z > lamp[0]) & (z < lamp[1])
        number = (side < _PLATE) & (z > plate[0]) & (z < plate[1])
        pane = (side < 0.8) & (z > belt + 0.08) & (z < roof - 0.12)
        grille = (outward > 0) & (side < _LAMP) & (z > 0.34) & (z < 0.60) & ~number
        albedo = np.broadcast_to(paint, centre.shape)
        for chosen, colour in (
            (z < _BUMPER, palette.PLASTIC), (grille, palette.PLASTIC), (number, palette.NUMBER_PLATE),
            (light, palette.TAIL_LIGHT if outward < 0 else palette.HEAD_LIGHT), (pane, np.full(3, 0.012)),
        ):  # fmt: skip
            albedo = np.where(chosen[..., None], colour, albedo)
        glow = _mirrored(centre, edge_u, edge_v, np.where(z < _BUMPER, 0.0, np.where(pane, 0.1, 0.045)), eye + [shape.length / 2, 0, 0])
        openness = np.clip(0.2 + 1.1 * z, 0.0, 1.0)
        parts.append(tiles(centre, edge_u, edge_v, SemanticClass.VEHICLE, albedo, glow=glow, openness=openness))
    return parts


def _wheels(shape: Shape, cell: Floats) -> list[Surfels]:
    n = int(np.clip(np.ceil(2 * _WHEEL / cell[1]), 5, 11))
    grid = (np.arange(n) + 0.5) / n * 2 - 1
    a, b = np.meshgrid(grid, grid, indexing="ij")
    radius, angle = np.hypot(a, b), np.arctan2(b, a)
    rim = np.where(np.cos(5 * angle) > -0.2, 1.0, 0.25) * (radius < 0.62)
    albedo = np.where((radius < 0.64)[..., None], palette.RIM * rim[..., None], palette.TYRE)
    kept = radius < 1.0
    parts = []
    for axle in shape.axles:
        for side in (-1.0, 1.0):
            centre = np.stack(
                [axle * shape.length - side * a * _WHEEL, np.full(a.shape, side * 0.99 * shape.width / 2), (b + 1) * _WHEEL],
                axis=-1,
            )[kept]
            step = 2 * _WHEEL / n
            parts.append(
                tiles(centre, [-side * step, 0, 0], [0, 0, step], SemanticClass.VEHICLE, albedo[kept], openness=0.6)
            )
    return parts


def _shade(shape: Shape) -> Surfels:
    """Dark sheets that close the space under the car, with the tyres' treads."""
    half, n = 0.40 * shape.width, 12
    y = (np.arange(n) + 0.5) / n * 2 - 1
    z = np.array([0.06, 0.17, 0.28])
    tread = np.where(np.abs(y) > 0.75, 0.014, 0.004)[:, None, None] * np.ones((n, 3, 3))
    parts = []
    for x, outward in ((shape.axles[0] * shape.length - _WHEEL, -1.0), (shape.axles[1] * shape.length + _WHEEL, 1.0)):
        yy, zz = np.meshgrid(outward * y * shape.width / 2 * 0.95, z, indexing="ij")
        centre = np.stack([np.full(yy.shape, x), yy, zz], axis=-1)
        step = outward * 0.95 * shape.width / n
        parts.append(tiles(centre, [0, step, 0], [0, 0, 0.11], SemanticClass.VEHICLE, tread, openness=0.3))
    m = 10
    x = shape.length * (shape.axles[0] + (shape.axles[1] - shape.axles[0]) * (np.arange(m) + 0.5) / m)
    step = shape.length * (shape.axles[1] - shape.axles[0]) / m
    for side in (-1.0, 1.0):
        centre = np.stack([x, np.full(m, side * half), np.full(m, 0.13)], axis=-1)
        parts.append(tiles(centre, [-side * step, 0, 0], [0, 0, 0.2], SemanticClass.VEHICLE, np.full(3, 0.004), openness=0.2))
    return join(parts)


def _mirrored(centre: Floats, edge_u: Floats, edge_v: Floats, gloss: Floats, eye: Floats) -> Floats:
    """Radiance [..., 3] that clear coat and glass mirror towards an eye on the road (Schlick 1994, 10.1111/1467-8659.1330233)."""
    normal = np.cross(edge_u, edge_v)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    view = eye - centre
    view /= np.linalg.norm(view, axis=-1, keepdims=True)
    cosine = np.clip((normal * view).sum(axis=-1), 0.0, 1.0)
    up = (2 * cosine[..., None] * normal - view)[..., 2:]
    share = gloss + (1 - gloss) * (1 - cosine) ** 5 * (gloss > 0)
    sky = np.clip((up - 0.30) / 0.25, 0.0, 1.0)
    road = np.clip(-up / 0.1 + 0.5, 0.0, 1.0)
    return np.minimum(share, 0.55)[..., None] * ((_HOUSES * (1 - sky) + _SKY * sky) * (1 - road) + _ROAD * road)
