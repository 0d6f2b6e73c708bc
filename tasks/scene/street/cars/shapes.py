"""The outlines of the parked cars."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SILL = 0.20
"""Height of the body's lower edge [m]."""


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


def _outline(*points: tuple[float, float]) -> Floats:
    return np.array(points)


_NOSE = ((0.94, 0.77), (0.985, 0.68), (1.0, 0.60))
_NOSE_BELT = ((0.94, 0.75), (0.985, 0.66), (1.0, 0.60))

SHAPES = {
    "hatchback": Shape(
        length=4.1,
        width=1.76,
        roof=_outline(
            (0, 0.84), (0.015, 0.95), (0.10, 1.36), (0.16, 1.44), (0.40, 1.47), (0.55, 1.42), (0.74, 0.97),
            (0.78, 0.93), *_NOSE,
        ),
        belt=_outline((0, 0.84), (0.015, 0.94), (0.15, 0.99), (0.60, 0.94), (0.78, 0.90), *_NOSE_BELT),
        glass=(0.12, 0.70),
        pillar=0.42,
    ),
    "saloon": Shape(
        length=4.6,
        width=1.81,
        roof=_outline(
            (0, 0.86), (0.01, 0.98), (0.14, 1.03), (0.27, 1.38), (0.36, 1.44), (0.52, 1.42), (0.69, 0.98),
            (0.73, 0.94), *_NOSE,
        ),
        belt=_outline((0, 0.86), (0.01, 0.95), (0.14, 0.99), (0.60, 0.94), (0.73, 0.91), *_NOSE_BELT),
        glass=(0.22, 0.66),
        pillar=0.44,
        axles=(0.205, 0.80),
    ),
    "estate": Shape(
        length=4.6,
        width=1.81,
        roof=_outline(
            (0, 0.86), (0.012, 0.98), (0.075, 1.38), (0.12, 1.45), (0.42, 1.48), (0.53, 1.44), (0.69, 0.98),
            (0.73, 0.94), *_NOSE,
        ),
        belt=_outline((0, 0.86), (0.012, 0.96), (0.15, 1.0), (0.60, 0.95), (0.73, 0.91), *_NOSE_BELT),
        glass=(0.09, 0.66),
        pillar=0.43,
        axles=(0.205, 0.80),
    ),
    "van": Shape(
        length=4.9,
        width=1.92,
        roof=_outline(
            (0, 1.80), (0.03, 1.90), (0.55, 1.93), (0.66, 1.86), (0.80, 1.18), (0.84, 1.11), (0.95, 0.93),
            (0.985, 0.78), (1, 0.66),
        ),
        belt=_outline((0, 1.06), (0.66, 1.08), (0.84, 1.05), (0.95, 0.90), (0.985, 0.76), (1, 0.66)),
        glass=(0.58, 0.76),
        pillar=0.60,
        axles=(0.19, 0.82),
    ),
}  # fmt: skip


def cross_section(shape: Shape, along: Floats) -> Floats:
    """Return the corner points of half a cross-section, from the sill to the middle of the roof.

    Parameters
    ----------
    shape : the car
    along : [n] places along its length [1]

    Returns
    -------
    float64 [n, 8, 2] half width and height of each corner [m]
    """
    roof, belt = (np.interp(along, *line.T) for line in (shape.roof, shape.belt))
    end = np.maximum((np.abs(2 * along - 1) - 0.72) / 0.28, 0.0)
    wide = shape.width / 2 * (1 - 0.17 * end**2.5)
    sill = SILL + 0.08 * end
    gap = np.maximum(roof - belt, 0.0)
    shoulder = 0.955 * wide
    top = shoulder - 0.34 * gap
    widths = [0.90 * wide, 0.985 * wide, wide, 0.985 * wide, shoulder, top, 0.86 * top, 0.0 * top]
    heights = [
        sill, sill + 0.22 * (belt - sill), sill + 0.55 * (belt - sill), belt - 0.07, belt,
        roof - np.minimum(0.07, 0.4 * gap), roof - 0.012, roof + 0.015,
    ]  # fmt: skip
    return np.stack([np.stack(widths, axis=1), np.stack(heights, axis=1)], axis=2)
