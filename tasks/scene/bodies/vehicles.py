"""Cars, vans and trucks: cut from side view, plan and cross-section, with glass, lamps, plates and wheels."""

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from tasks.conventions import SemanticClass
from tasks.scene.bodies.body import Body, Finish, join_discs, make_body, mirror_discs
from tasks.scene.bodies.solids import Discs, cover_surface, smooth_overlap, smooth_union

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]


class Part(IntEnum):
    """Materials of a vehicle."""

    PAINT = 0
    GLASS = 1
    PLASTIC = 2
    HEAD_LAMP = 3
    TAIL_LAMP = 4
    PLATE = 5
    SEAM = 6
    DARK = 7
    TYRE = 8
    RIM = 9
    CHROME = 10
    LETTER = 11


@dataclass(frozen=True, kw_only=True)
class Shape:
    """Side view of a vehicle from its tail (0) to its nose (1), heights by its own height.

    Parameters
    ----------
    roof : (place, height) of the outline from tail to nose [1]
    belt : height of the line under the side windows at the tail and at the nose [1]
    glass : places of the rearmost and the foremost side window [1]
    doors : places of the seams of the side doors [1]
    pillars : places of the pillars between the side windows [1]
    axles : places of the axles [1]
    size : usual length, width and height [m]
    wheel : radius of a wheel [m]
    lean : inward slope of the side windows [1]
    """

    roof: tuple[tuple[float, float], ...]
    belt: tuple[float, float]
    glass: tuple[float, float]
    doors: tuple[float, ...]
    pillars: tuple[float, ...]
    axles: tuple[float, float]
    size: tuple[float, float, float]
    wheel: float = 0.315
    lean: float = 0.36


_NOSE = ((0.955, 0.52), (0.985, 0.47), (1.0, 0.40))
SHAPES = {
    "hatchback": Shape(
        roof=((0, 0.60), (0.02, 0.67), (0.10, 0.93), (0.17, 0.985), (0.36, 1.0), (0.50, 0.975), (0.58, 0.92),
              (0.73, 0.685), (0.80, 0.645), (0.90, 0.59), *_NOSE),
        belt=(0.68, 0.61), glass=(0.10, 0.70), doors=(0.27, 0.45, 0.69), pillars=(0.25, 0.445),
        axles=(0.19, 0.80), size=(4.1, 1.76, 1.47),
    ),
    "saloon": Shape(
        roof=((0, 0.62), (0.015, 0.69), (0.13, 0.72), (0.17, 0.75), (0.27, 0.95), (0.34, 0.995), (0.42, 1.0),
              (0.52, 0.975), (0.59, 0.915), (0.705, 0.685), (0.78, 0.645), (0.89, 0.58), *_NOSE),
        belt=(0.69, 0.625), glass=(0.20, 0.67), doors=(0.26, 0.45, 0.67), pillars=(0.445,),
        axles=(0.205, 0.80), size=(4.6, 1.81, 1.45),
    ),
    "estate": Shape(
        roof=((0, 0.60), (0.015, 0.67), (0.065, 0.91), (0.12, 0.975), (0.35, 1.0), (0.50, 0.975), (0.58, 0.92),
              (0.705, 0.675), (0.78, 0.63), (0.89, 0.57), *_NOSE),
        belt=(0.68, 0.61), glass=(0.07, 0.67), doors=(0.26, 0.45, 0.67), pillars=(0.25, 0.445),
        axles=(0.205, 0.80), size=(4.6, 1.81, 1.48),
    ),
    "suv": Shape(
        roof=((0, 0.58), (0.012, 0.64), (0.06, 0.90), (0.11, 0.97), (0.34, 1.0), (0.52, 0.98), (0.59, 0.94),
              (0.72, 0.72), (0.79, 0.685), (0.92, 0.63), (0.965, 0.57), (0.99, 0.50), (1.0, 0.42)),
        belt=(0.70, 0.64), glass=(0.07, 0.69), doors=(0.26, 0.45, 0.69), pillars=(0.25, 0.445),
        axles=(0.19, 0.81), size=(4.5, 1.86, 1.66), wheel=0.355, lean=0.30,
    ),
    "van": Shape(
        roof=((0, 0.92), (0.015, 0.97), (0.04, 0.99), (0.50, 1.0), (0.66, 0.985), (0.71, 0.94), (0.83, 0.635),
              (0.87, 0.585), (0.95, 0.49), (0.985, 0.43), (1.0, 0.36)),
        belt=(0.56, 0.545), glass=(0.60, 0.80), doors=(0.60, 0.80), pillars=(0.60,),
        axles=(0.19, 0.82), size=(4.95, 1.93, 1.95), wheel=0.33, lean=0.16,
    ),
    "truck": Shape(
        roof=((0, 0.985), (0.004, 0.995), (0.02, 1.0), (0.745, 1.0), (0.75, 0.99), (0.755, 0.86), (0.76, 0.80),
              (0.80, 0.80), (0.97, 0.785), (0.985, 0.74), (1.0, 0.56)),
        belt=(0.52, 0.52), glass=(0.80, 0.985), doors=(0.79, 0.955), pillars=(),
        axles=(0.20, 0.86), size=(7.5, 2.45, 3.4), wheel=0.45, lean=0.04,
    ),
}  # fmt: skip
"""Side views; chosen after usual vehicles, not measured."""

_EDGE = 0.09
_COARSE = 0.15
"""Spacing from which the borders of materials are cut once alone [m]."""
_PLATE = (0.26, 0.055)
"""Half width and half height of a number plate: 520 mm x 110 mm, Regulation (EC) 2411/98 and DIN 74069 [m]."""


def build_vehicle(
    kind: str,
    length: float | None = None,
    width: float | None = None,
    height: float | None = None,
    colour: ArrayLike = (0.35, 0.35, 0.34),
    cell: float = 0.055,
    seed: int = 0,
) -> Body:
    """Return a vehicle as a rigid Gaussian body.

    Parameters
    ----------
    kind : of `SHAPES`, or "car", which is a hatchback
    length, width, height : outer dimensions; None takes the kind's own [m]
    colour : [3] reflectance of its paint, linear light [1]
    cell : spacing of its discs: 0.055 makes some 16,000 of a car, and their number goes with its square [m]
    seed : draws the number on its plates [1]

    Returns
    -------
    Body
        Class vehicle. The same arguments give the same bytes.
    """
    shape = SHAPES["hatchback" if kind == "car" else kind]
    own = shape.size
    size = (
        own[0] if length is None else float(length),
        own[1] if width is None else float(width),
        own[2] if height is None else float(height),
    )
    discs = _build_discs("hatchback" if kind == "car" else kind, size, float(cell), int(seed))
    red, green, blue = np.asarray(colour, dtype=np.float64)
    finishes = FINISHES | {Part.PAINT: Finish(albedo=(float(red), float(green), float(blue)), gloss=0.045)}
    z = discs.centre[:, 2]
    openness = np.where(discs.material == Part.DARK, 0.12, np.clip(0.30 + 1.0 * z, 0.0, 1.0))
    openness = np.where(discs.normal[:, 2] < -0.5, 0.15, openness)
    return make_body(discs, finishes, SemanticClass.VEHICLE, size, openness)


FINISHES: dict[int, Finish] = {
    Part.GLASS: Finish(albedo=(0.030, 0.030, 0.030), gloss=0.04),
    Part.PLASTIC: Finish(albedo=(0.024, 0.024, 0.026)),
    Part.HEAD_LAMP: Finish(albedo=(0.62, 0.66, 0.68), gloss=0.10),
    Part.TAIL_LAMP: Finish(albedo=(0.36, 0.010, 0.012), gloss=0.06),
    Part.PLATE: Finish(albedo=(0.68, 0.68, 0.64)),
    Part.SEAM: Finish(albedo=(0.010, 0.010, 0.010)),
    Part.DARK: Finish(albedo=(0.006, 0.006, 0.006)),
    Part.TYRE: Finish(albedo=(0.020, 0.020, 0.021)),
    Part.RIM: Finish(albedo=(0.36, 0.37, 0.38), gloss=0.05),
    Part.CHROME: Finish(albedo=(0.45, 0.46, 0.47), gloss=0.20),
    Part.LETTER: Finish(albedo=(0.012, 0.012, 0.014)),
}
"""Finishes of what is not painted; chosen, as the street's palette. Glass mirrors as one face of float glass does, of
refractive index 1.5 (EN 572-1), in front of a cabin that sends 3 % of the light back."""


class _Bodywork:
    """Solid and materials of the bodywork of one shape and size; the axes are the body's."""

    def __init__(self, shape: Shape, size: tuple[float, float, float], seed: int) -> None:
        self.shape, self.seed = shape, seed
        self.length, self.width, self.height = size
        place, height = np.array(shape.roof).T
        self.roof = PchipInterpolator(place, height * self.height)
        self.rise = self.roof.derivative()
        self.tall = self.height > 2.5
        self.sill = 0.20 if not self.tall else 0.55
        self.nose_top, self.tail_top = height[-1] * self.height, height[0] * self.height

    def distance(self, points: Floats) -> Floats:
        """Return the signed distance from the bodywork without its wheels [m]."""
        x, y, z = points.T
        y = np.abs(y)
        along = np.clip(x / self.length + 0.5, 0, 1)
        slope = self.rise(along) / self.length
        top = (z - self.roof(along) + 0.03 * (y / (self.width / 2)) ** 2) / np.sqrt(1 + slope**2)
        side = y - self.half_width(along, z)
        across = np.minimum(y / (self.width / 2), 1.2)
        bow, stern = (0.05, 0.02) if self.tall else (0.17, 0.09)
        front = x - (
            self.length / 2 - bow * across**2.6 - 0.25 * np.maximum(0.45 * self.nose_top - z, 0) ** 2
        )
        back = -x - (self.length / 2 - stern * across**2.6 - 0.10 * np.maximum(z - self.tail_top, 0))
        floor = self.sill - z
        ends = smooth_overlap(front, back, _EDGE)
        body = smooth_overlap(smooth_overlap(top, side, _EDGE), ends, 1.4 * _EDGE)
        body = smooth_overlap(body, floor, _EDGE)
        for axle in self.shape.axles:
            near = np.hypot(x - (axle - 0.5) * self.length, z - self.shape.wheel)
            arch = np.maximum(near - self.shape.wheel - 0.055, self.width / 2 - 0.32 - y)
            body = np.maximum(body, -arch)
        if self.tall:
            # the gap between cab and box, and the box above the wheels
            gap = np.maximum(np.abs(along - 0.772) - 0.012, 0.9 - z)
            body = np.maximum(body, -gap)
        return smooth_union(body, self._mirror(x, y, z), 0.02)

    def _mirror(self, x: Floats, y: Floats, z: Floats) -> Floats:
        foot = self.shape.glass[1] - (0.035 if not self.tall else 0.0)
        middle = np.array([(foot - 0.5) * self.length, self.width / 2 + 0.06, self.belt_at(foot) + 0.08])
        half = np.array([0.05, 0.11, 0.075]) if not self.tall else np.array([0.05, 0.10, 0.25])
        away = np.stack([x, y, z], axis=1) - middle
        return (np.linalg.norm(away / half, axis=1) - 1) * float(half.min())

    def belt_at(self, along: ArrayLike) -> Floats:
        """Return the height of the line under the side windows [m]."""
        back, front = self.shape.belt
        return (back + (front - back) * np.asarray(along, dtype=np.float64)) * self.height

    def half_width(self, along: Floats, z: Floats) -> Floats:
        """Return half the width at a place along the body and a height [m]."""
        half = self.width / 2
        belt = self.belt_at(along)
        end = np.abs(2 * along - 1)
        plan = 1 - (0.02 if self.tall else 0.07) * end**4
        low = np.clip((0.62 * belt - z) / (0.62 * belt), 0, 1)
        high = np.clip((z - 0.62 * belt) / (0.38 * belt), 0, 1)
        flank = 1 - 0.07 * low**1.6 - 0.035 * np.minimum(high, 1) ** 2
        return half * plan * flank - self.shape.lean * np.maximum(z - belt, 0)

    def material(self, points: Floats, normal: Floats) -> Numbers:
        """Return the material of places on the surface."""
        shape, part = self.shape, np.full(len(points), Part.PAINT, dtype=np.int64)
        x, y, z = points.T
        along, y = np.clip(x / self.length + 0.5, 0, 1), np.abs(y)
        belt, roof = self.belt_at(along), self.roof(along)
        half = self.half_width(along, z)
        front, back = normal[:, 0] > 0.55, normal[:, 0] < -0.55
        side = np.abs(normal[:, 1]) > 0.6

        seams = np.zeros(len(points), dtype=bool)
        for door in shape.doors:
            seams |= side & (np.abs(along - door) * self.length < 0.011) & (z > self.sill + 0.1) & (z < belt)
        bonnet = (np.abs(along - shape.glass[1] - 0.05) * self.length < 0.012) & (normal[:, 2] > 0.6)
        part[seams | (bonnet & (not self.tall))] = Part.SEAM
        low = z < self.sill + (0.13 if not self.tall else 0.25)
        part[low] = Part.PLASTIC

        window = (
            side
            & (z > belt + 0.025)
            & (z < roof - 0.085)
            & (along > shape.glass[0])
            & (along < shape.glass[1])
        )
        pillar = np.abs(along[:, None] - shape.pillars).min(axis=1, initial=1) < 0.035 / self.length
        handle = np.zeros(len(points), dtype=bool)
        for door in shape.doors[:-1]:
            from_seam = (along - door) * self.length
            handle |= side & (from_seam > 0.05) & (from_seam < 0.21) & (np.abs(z - belt + 0.12) < 0.018)
        part[handle] = Part.CHROME
        cowl, top = self.belt_at(shape.glass[1]), self.height
        rake = (normal[:, 0] > 0.25) & (z > float(cowl) + 0.06) & (z < 0.955 * top) & (y < half - 0.09)
        if self.tall:
            rake &= (z < 0.76 * top) & (along > 0.9)
        rear = (normal[:, 0] < -0.25) & (z > self.belt_at(0.0) + 0.05) & (z < 0.94 * top) & (y < half - 0.11)
        rear &= along < 0.45
        rear &= not self.tall
        if shape.roof[0][1] > 0.8:
            rear &= y > 0.03  # two wings of a van's door
        part[window | rake | rear] = Part.GLASS
        part[window & pillar] = Part.PLASTIC

        nose, tail = front & (along > 0.8), back & (along < 0.2)
        lamp = 0.80 * self.nose_top if not self.tall else 0.27 * self.height
        part[
            (along > 0.925) & (y > 0.60 * half) & (np.abs(z - lamp - 0.05) < 0.075) & (normal[:, 0] > 0.15)
        ] = Part.HEAD_LAMP
        grille = nose & (y < 0.55 * half) & (z > 0.62 * lamp) & (z < 0.98 * lamp)
        part[grille] = np.where((z[grille] % 0.06) < 0.017, Part.CHROME, Part.DARK)
        part[nose & (y < 0.75 * half) & (z > self.sill + 0.04) & (z < 0.5 * lamp)] = Part.DARK
        light = min(0.86 * self.tail_top, 1.05)
        if self.tall:
            part[tail & (y > 0.80 * half) & (np.abs(z - 0.85) < 0.11)] = Part.TAIL_LAMP
        else:
            red = (along < 0.075) & (y > 0.62 * half) & (np.abs(z - light) < 0.125) & (normal[:, 0] < -0.12)
            part[red] = np.where(np.abs(z[red] - light + 0.045) < 0.017, Part.CHROME, Part.TAIL_LAMP)
            part[tail & (y < 0.25 * half) & (np.abs(z - 0.955 * top) < 0.02)] = Part.TAIL_LAMP
        for face, middle in ((nose, 0.60 * lamp), (tail, light - 0.17 if not self.tall else 0.85)):
            plate = face & (y < _PLATE[0]) & (np.abs(z - middle) < _PLATE[1])
            part[plate] = Part.PLATE
            column = np.floor((points[plate, 1] + _PLATE[0]) / 0.057).astype(int)
            drawn = np.random.Generator(np.random.Philox(self.seed)).integers(0, 3, 12)[
                np.clip(column, 0, 11)
            ]
            inner = (points[plate, 1] + _PLATE[0]) / 0.057 % 1
            ink = (
                (np.abs(z[plate] - middle) < 0.036)
                & (np.abs(inner - 0.5) < 0.16 + 0.08 * drawn)
                & (drawn < 2)
            )
            part[np.flatnonzero(plate)[ink]] = Part.LETTER
        axles = (np.array(shape.axles) - 0.5) * self.length
        away = np.hypot(x[:, None] - axles, z[:, None] - shape.wheel).min(axis=1)
        part[(away < shape.wheel + 0.075) | (normal[:, 2] < -0.6)] = Part.DARK
        return part


def _wheel(shape: Shape, size: tuple[float, float, float], axle: float, cell: float, finer: int) -> Discs:
    """Return the discs of the left wheel of an axle, without its inner side."""
    middle = np.array([(axle - 0.5) * size[0], size[1] / 2 - 0.125, shape.wheel])
    broad = 0.11 if size[2] < 2.5 else 0.15

    def distance(points: Floats) -> Floats:
        away = points - middle
        radius, across = np.hypot(away[:, 0], away[:, 2]), np.abs(away[:, 1])
        dish = 0.035 * np.clip(1 - radius / (0.66 * shape.wheel), 0, 1) ** 0.5
        return smooth_overlap(radius - shape.wheel, across - broad + dish, 0.045)

    def material(points: Floats, normal: Floats) -> Numbers:
        away = points - middle
        radius, angle = np.hypot(away[:, 0], away[:, 2]) / shape.wheel, np.arctan2(away[:, 2], away[:, 0])
        outside = away[:, 1] > 0.5 * broad
        spoke = radius * np.abs(np.sin(2.5 * angle)) < 0.15 + 0.15 * radius
        rim = outside & (radius < 0.66) & (spoke | (radius > 0.60) | (radius < 0.2))
        return np.where(rim, Part.RIM, np.where(outside & (radius < 0.66), Part.DARK, Part.TYRE)).astype(
            np.int64
        )

    reach = np.array([shape.wheel + 0.02, broad + 0.02, shape.wheel + 0.02])
    low = middle - reach * [1, 0.6, 1]
    return cover_surface(distance, low, middle + reach, 0.8 * cell, material, finer)


@lru_cache(maxsize=32)
def _build_discs(kind: str, size: tuple[float, float, float], cell: float, seed: int) -> Discs:
    shape = SHAPES[kind]
    bodywork = _Bodywork(shape, size, seed)
    length, width, height = size
    low, high = [-length / 2 - 0.02, 0.0, 0.0], [length / 2 + 0.02, width / 2 + 0.2, height + 0.06]
    finer = 2 if cell < _COARSE else 1
    body = cover_surface(bodywork.distance, low, high, cell, bodywork.material, finer)
    wheels = [_wheel(shape, size, axle, cell, finer) for axle in shape.axles]
    half = join_discs([body, *wheels])
    kept = half.centre[:, 1] > 0
    left = {name: getattr(half, name)[kept] for name in Discs.__dataclass_fields__}
    return mirror_discs(Discs(**left))
