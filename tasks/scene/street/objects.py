"""Cars and furniture of the built-in street one by one: their boxes, and which Gaussians belong to which.

``build_street`` builds these objects last and in the same order: so the last Gaussians of the scene are theirs, and
nothing about them has to be kept in the scene.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians
from tasks.scene.street.bend import Course, integrate_course
from tasks.scene.street.cars.parked import list_cars
from tasks.scene.street.furniture import list_furniture
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.plan import plan_street
from tasks.scene.street.surfels import OVERLAP, Surfels

KINDS = ("car", "lamp", "sign", "bollard", "bin", "letter box")
"""Kinds of object."""


@dataclass(frozen=True, kw_only=True)
class StreetObject:
    """One object with the box around it.

    Parameters
    ----------
    number : from 1 on, the same for a seed and a layout [1]
    kind : of `KINDS`
    centre : float64 [3] middle of the box in the world [m]
    size : float64 [3] along its heading, across, and upward [m]
    heading : counter-clockwise from the world's x; of a car its nose, of others the road's direction [rad]
    pitch : of that direction below the horizon, which a car has on a hill; others stand upright [rad]
    """

    number: int
    kind: str
    centre: NDArray[np.float64]
    size: NDArray[np.float64]
    heading: float
    pitch: float = 0.0


def list_objects(
    layout: StreetLayout, seed: int = 2025
) -> tuple[tuple[StreetObject, ...], NDArray[np.int32], NDArray[np.uint8]]:
    """Return the objects, and the number of the object and the class of each of the last Gaussians of the street.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    line, plan = integrate_course(layout), plan_street(layout, seed)
    cars = [("car", car.facing, surfels)
            for car, surfels in zip(plan.cars, list_cars(plan.cars, seed), strict=True)]  # fmt: skip
    furniture = [(kind, 1, surfels) for kind, surfels in list_furniture(layout, plan, seed)]
    built = [*cars, *furniture]
    objects = tuple(
        _describe(number, kind, facing, surfels, line)
        for number, (kind, facing, surfels) in enumerate(built, start=1)
    )
    owners = np.repeat(np.arange(1, len(built) + 1, dtype=np.int32), [len(surfels) for *_, surfels in built])
    return objects, owners, np.concatenate([surfels.class_id for *_, surfels in built])


def own_gaussians(
    gaussians: Gaussians, owners: NDArray[np.int32], classes: NDArray[np.uint8]
) -> NDArray[np.int32]:
    """Return the number of the object of every Gaussian of the street; 0 where it belongs to none.

    Parameters
    ----------
    gaussians : of the street
    owners, classes : of its last Gaussians, as `list_objects` gives them

    Raises
    ------
    InputError
        If the last Gaussians have other classes: it is no street of this layout and seed.
    """
    first = len(gaussians) - len(owners)
    if first < 0 or not np.array_equal(gaussians.class_id[first:], classes):
        raise InputError(
            "the scene must be the built-in street of this version: its last Gaussians are other objects"
        )
    return np.concatenate([np.zeros(first, np.int32), owners])


def _describe(number: int, kind: str, facing: int, surfels: Surfels, line: Course) -> StreetObject:
    # to the corner of its cell, whose edge is a standard deviation over OVERLAP
    reach = 0.5 / OVERLAP * np.einsum("nk,nkj->nj", surfels.scale, np.abs(surfels.axes[:, :2]))
    low, high = (surfels.centre - reach).min(axis=0), (surfels.centre + reach).max(axis=0)
    middle = (low + high) / 2
    slope = float(np.arcsin(np.interp(middle[0], line.station, line.grade))) if kind == "car" else 0.0
    return StreetObject(
        number=number,
        kind=kind,
        centre=line.to_world(middle[None])[0],
        size=high - low,
        heading=float(line.heading_at(middle[0])) + (np.pi if facing < 0 else 0.0),
        pitch=-facing * slope,
    )
