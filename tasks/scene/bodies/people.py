"""Pedestrians and bicyclists: dummies of the sizes of ISO 19206, in mid-stride or on the saddle."""

from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.conventions import SemanticClass
from tasks.scene.bodies.body import Body, Finish, join_discs, make_body
from tasks.scene.bodies.solids import Discs, cover_surface, limb_distance, smooth_union, tangents

Floats = NDArray[np.float64]

STATURE = {"adult": 1.80, "child": 1.15}
"""Height of the dummies of ISO 19206-2:2018 [m]."""
BICYCLE = (1.89, 0.50, 1.86)
"""Length, width and height of bicycle and rider, after the bicyclist target of ISO 19206-4:2020 and Euro NCAP [m]."""
_WHEEL, _TYRE = 0.345, 0.018
"""Radius of a wheel and of its tyre [m]."""


class Part(IntEnum):
    """Materials of people and bicycles."""

    SKIN = 0
    HAIR = 1
    SHIRT = 2
    TROUSERS = 3
    SHOES = 4
    RUBBER = 5
    METAL = 6


Limb = tuple[Part, Sequence[float], Sequence[float], float, float]
"""Material, two ends [m] and the radius at each [m]."""

_WALKER: tuple[Limb, ...] = (
    (Part.SHIRT, (0, 0.09, 1.38), (0, -0.09, 1.38), 0.115, 0.115),
    (Part.SHIRT, (0, 0, 1.36), (0, 0, 1.0), 0.155, 0.135),
    (Part.TROUSERS, (0, 0.05, 0.97), (0, -0.05, 0.97), 0.135, 0.135),
    (Part.SKIN, (0, 0, 1.45), (0.01, 0, 1.56), 0.055, 0.055),
    (Part.SKIN, (0.02, 0, 1.64), (0.015, 0, 1.68), 0.092, 0.100),
    (Part.HAIR, (-0.02, 0, 1.70), (-0.02, 0, 1.70), 0.105, 0.100),
    (Part.TROUSERS, (0, 0.09, 0.92), (0.20, 0.09, 0.50), 0.09, 0.065),
    (Part.TROUSERS, (0.20, 0.09, 0.50), (0.27, 0.09, 0.10), 0.065, 0.045),
    (Part.SHOES, (0.25, 0.09, 0.05), (0.41, 0.09, 0.05), 0.048, 0.040),
    (Part.TROUSERS, (0, -0.09, 0.92), (-0.05, -0.09, 0.50), 0.09, 0.065),
    (Part.TROUSERS, (-0.05, -0.09, 0.50), (-0.33, -0.09, 0.15), 0.065, 0.045),
    (Part.SHOES, (-0.36, -0.09, 0.10), (-0.24, -0.09, 0.045), 0.045, 0.042),
    (Part.SHIRT, (0, 0.20, 1.40), (-0.12, 0.24, 1.12), 0.055, 0.045),
    (Part.SKIN, (-0.12, 0.24, 1.12), (-0.02, 0.23, 0.86), 0.042, 0.036),
    (Part.SHIRT, (0, -0.20, 1.40), (0.08, -0.24, 1.12), 0.055, 0.045),
    (Part.SKIN, (0.08, -0.24, 1.12), (0.26, -0.22, 0.93), 0.042, 0.036),
)
"""A walker of 1.80 m."""
_RIDER: tuple[Limb, ...] = (
    (Part.SHIRT, (0.10, 0.10, 1.42), (0.10, -0.10, 1.42), 0.105, 0.105),
    (Part.SHIRT, (0.08, 0, 1.40), (-0.22, 0, 1.06), 0.145, 0.135),
    (Part.TROUSERS, (-0.25, 0.07, 1.00), (-0.25, -0.07, 1.00), 0.125, 0.125),
    (Part.SKIN, (0.14, 0, 1.50), (0.17, 0, 1.62), 0.055, 0.055),
    (Part.SKIN, (0.19, 0, 1.69), (0.19, 0, 1.72), 0.090, 0.098),
    (Part.HAIR, (0.16, 0, 1.745), (0.16, 0, 1.745), 0.108, 0.108),
    (Part.TROUSERS, (-0.22, 0.10, 0.97), (0.16, 0.11, 0.80), 0.085, 0.065),
    (Part.TROUSERS, (0.16, 0.11, 0.80), (0.06, 0.12, 0.42), 0.062, 0.045),
    (Part.SHOES, (0.03, 0.12, 0.38), (0.17, 0.12, 0.36), 0.045, 0.038),
    (Part.TROUSERS, (-0.22, -0.10, 0.97), (0.08, -0.11, 0.62), 0.085, 0.065),
    (Part.TROUSERS, (0.08, -0.11, 0.62), (-0.10, -0.12, 0.24), 0.062, 0.045),
    (Part.SHOES, (-0.13, -0.12, 0.18), (0.01, -0.12, 0.17), 0.045, 0.038),
    (Part.SHIRT, (0.10, 0.20, 1.42), (0.28, 0.24, 1.18), 0.052, 0.043),
    (Part.SKIN, (0.28, 0.24, 1.18), (0.46, 0.22, 1.06), 0.040, 0.036),
    (Part.SHIRT, (0.10, -0.20, 1.42), (0.28, -0.24, 1.18), 0.052, 0.043),
    (Part.SKIN, (0.28, -0.24, 1.18), (0.46, -0.22, 1.06), 0.040, 0.036),
)
"""A rider of 1.80 m on a bicycle whose wheels touch the ground at -0.60 and 0.60 m."""
_FRAME: tuple[Limb, ...] = (
    (Part.METAL, (-0.10, 0, 0.29), (-0.26, 0, 0.92), 0.018, 0.016),
    (Part.METAL, (-0.10, 0, 0.29), (0.36, 0, 0.78), 0.020, 0.020),
    (Part.METAL, (-0.22, 0, 0.80), (0.36, 0, 0.86), 0.016, 0.016),
    (Part.METAL, (-0.60, 0.05, _WHEEL), (-0.10, 0.03, 0.29), 0.011, 0.011),
    (Part.METAL, (-0.60, -0.05, _WHEEL), (-0.10, -0.03, 0.29), 0.011, 0.011),
    (Part.METAL, (-0.60, 0.05, _WHEEL), (-0.22, 0.02, 0.80), 0.010, 0.010),
    (Part.METAL, (-0.60, -0.05, _WHEEL), (-0.22, -0.02, 0.80), 0.010, 0.010),
    (Part.METAL, (0.36, 0, 0.95), (0.60, 0.05, _WHEEL), 0.016, 0.011),
    (Part.METAL, (0.36, 0, 0.78), (0.60, -0.05, _WHEEL), 0.016, 0.011),
    (Part.RUBBER, (0.40, 0.25, 1.04), (0.40, -0.25, 1.04), 0.016, 0.016),
    (Part.RUBBER, (-0.36, 0, 0.95), (-0.14, 0, 0.94), 0.07, 0.03),
)
_TUBE_CELL = 0.028


def build_person(
    kind: str, height: float | None = None, colour: ArrayLike = (0.20, 0.25, 0.45), cell: float = 0.03
) -> Body:
    """Return a pedestrian in mid-stride as a rigid Gaussian body.

    Parameters
    ----------
    kind : of `STATURE`
    height : stature; None takes the dummy's [m]
    colour : [3] reflectance of the shirt, linear light [1]
    cell : spacing of the discs [m]
    """
    stature = STATURE[kind] if height is None else float(height)
    share = stature / STATURE["adult"]
    discs = _cover_limbs(_WALKER, cell / share, 0.75 if kind == "child" else 0.0)
    return _dress(
        _scale(discs, stature / discs.centre[:, 2].max()), colour, (0.85 * share, 0.56 * share, stature)
    )


def build_bicyclist(
    height: float | None = None, colour: ArrayLike = (0.45, 0.10, 0.08), cell: float = 0.03
) -> Body:
    """Return a bicycle with its rider as a rigid Gaussian body.

    Parameters
    ----------
    height : of both together; None takes that of the target [m]
    colour : [3] reflectance of the shirt, linear light [1]
    cell : spacing of the rider's discs [m]
    """
    length, width, own = BICYCLE
    share = 1.0 if height is None else float(height) / own
    discs = join_discs([_cover_limbs(_RIDER, cell / share, 0.0), _build_bicycle()])
    return _dress(_scale(discs, share), colour, (length * share, width * share, own * share))


def _dress(discs: Discs, colour: ArrayLike, size: tuple[float, float, float]) -> Body:
    red, green, blue = np.asarray(colour, dtype=np.float64)
    finishes: dict[int, Finish] = {
        **FINISHES,
        Part.SHIRT: Finish(albedo=(float(red), float(green), float(blue))),
    }
    openness = np.clip(0.45 + 0.4 * discs.centre[:, 2] / size[2] + 0.2 * discs.normal[:, 2], 0.15, 1.0)
    return make_body(discs, finishes, SemanticClass.OTHER, size, openness)


FINISHES: dict[int, Finish] = {
    Part.SKIN: Finish(albedo=(0.42, 0.26, 0.19)),
    Part.HAIR: Finish(albedo=(0.045, 0.030, 0.020)),
    Part.TROUSERS: Finish(albedo=(0.035, 0.045, 0.075)),
    Part.SHOES: Finish(albedo=(0.020, 0.018, 0.016)),
    Part.RUBBER: Finish(albedo=(0.020, 0.020, 0.021)),
    Part.METAL: Finish(albedo=(0.10, 0.11, 0.12), gloss=0.05),
}
"""Finishes of what has no colour of its own; chosen, not measured."""


def _scale(discs: Discs, share: float) -> Discs:
    return Discs(
        centre=discs.centre * share, normal=discs.normal, cell=discs.cell * share, material=discs.material
    )


@lru_cache(maxsize=8)
def _cover_limbs(limbs: tuple[Limb, ...], cell: float, larger_head: float) -> Discs:
    """Cover a body of limbs; a child's head is larger by its body, by ``larger_head`` of 0.4."""

    def parts(points: Floats) -> Floats:
        grown = [0.4 * larger_head * thick if part in {Part.HAIR, Part.SKIN} and start[2] > 1.6 else 0.0
                 for part, start, _, thick, _ in limbs]  # fmt: skip
        return np.stack(
            [
                limb_distance(points, start, np.add(stop, (0, 0, 1e-6)), thick + more, thin + more)
                for (_, start, stop, thick, thin), more in zip(limbs, grown, strict=True)
            ]
        )

    def distance(points: Floats) -> Floats:
        every = parts(points)
        body = every[0]
        for limb in every[1:]:
            body = smooth_union(body, limb, 0.03)
        return body

    def material(points: Floats, normal: Floats) -> NDArray[np.int64]:
        every = parts(points)
        number = np.array([int(part) for part, *_ in limbs])
        return number[every.argmin(axis=0)]

    return cover_surface(distance, (-0.5, -0.32, 0.0), (0.62, 0.32, 1.9), cell, material, 1)


@lru_cache(maxsize=1)
def _build_bicycle() -> Discs:
    turn = np.linspace(0, 2 * np.pi, 73)
    parts = []
    for hub in (-0.60, 0.60):
        away = _WHEEL - _TYRE
        rim = np.stack([hub + away * np.cos(turn), 0 * turn, _WHEEL + away * np.sin(turn)], axis=1)
        parts += [_cover_tube(a, b, _TYRE, Part.RUBBER) for a, b in pairwise(rim)]
        spokes = np.array([hub, 0, _WHEEL]) + 0.93 * (rim[:-1:4] - np.array([hub, 0, _WHEEL]))
        parts += [_cover_tube(np.array([hub, 0, _WHEEL]), end, 0.003, Part.METAL) for end in spokes]
    parts += [
        _cover_tube(np.asarray(a, float), np.asarray(b, float), thick, part)
        for part, a, b, thick, _ in _FRAME
    ]
    return join_discs(parts)


def _cover_tube(start: Floats, stop: Floats, radius: float, part: Part) -> Discs:
    """Return discs around a thin tube."""
    run = stop - start
    length = float(np.linalg.norm(run))
    around = max(int(np.ceil(2 * np.pi * radius / _TUBE_CELL)), 3)
    cell = 2 * np.pi * radius / around if around > 3 else max(2 * np.pi * radius / 3, 0.5 * _TUBE_CELL)
    count = max(int(np.ceil(length / cell)), 1)
    axis = (run / length)[None]
    first, second = tangents(axis)
    angle = 2 * np.pi * np.arange(around) / around
    normal = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    place = start + (np.arange(count)[:, None] + 0.5) / count * run
    return Discs(
        centre=(place[:, None] + radius * normal).reshape(-1, 3),
        normal=np.tile(normal, (count, 1)),
        cell=np.full(count * around, cell),
        material=np.full(count * around, int(part)),
    )
