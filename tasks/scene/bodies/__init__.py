"""Rigid bodies of road users as Gaussians: cars, vans, trucks, pedestrians, bicycles."""

import numpy as np
from numpy.typing import ArrayLike

from tasks.scene.bodies.body import Body
from tasks.scene.bodies.people import BICYCLE, STATURE, build_bicyclist, build_person
from tasks.scene.bodies.vehicles import SHAPES, build_vehicle

VEHICLES = ("car", *SHAPES)
"""Kinds of vehicle; a car is a hatchback."""
KINDS = (*VEHICLES, *STATURE, "bicycle")
"""Kinds of body: vehicles, pedestrians by age, and a bicycle with its rider."""

__all__ = ["BICYCLE", "KINDS", "VEHICLES", "Body", "build_body", "build_vehicle"]


def build_body(
    kind: str,
    length: float | None = None,
    width: float | None = None,
    height: float | None = None,
    colour: ArrayLike | None = None,
    cell: float | None = None,
    seed: int = 0,
) -> Body:
    """Return a road user as a rigid Gaussian body.

    Parameters
    ----------
    kind : of `KINDS`
    length, width, height : outer dimensions; None takes the kind's own; of people and bicycles the height sets all [m]
    colour : [3] reflectance of the paint or of the shirt, linear light; None takes a usual one [1]
    cell : spacing of its discs; None takes 0.055 m of a vehicle, some 15,000, and 0.03 m of a person [m]
    seed : draws the number on a vehicle's plates [1]

    Returns
    -------
    Body
        The same arguments give the same bytes.
    """
    if kind in VEHICLES:
        paint = np.array((0.35, 0.35, 0.34)) if colour is None else np.asarray(colour, dtype=np.float64)
        return build_vehicle(kind, length, width, height, paint, 0.055 if cell is None else cell, seed)
    given = {"colour": colour, "cell": cell}
    options = {name: value for name, value in given.items() if value is not None}
    if kind in STATURE:
        return build_person(kind, height, **options)  # type: ignore[arg-type]
    return build_bicyclist(height, **options)  # type: ignore[arg-type]
