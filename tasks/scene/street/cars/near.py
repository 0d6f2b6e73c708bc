"""Parked cars that a clip comes near: as fine as its camera resolves, in the light of the coarse ones."""

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tasks.scene.bodies.body import Body
from tasks.scene.bodies.vehicles import build_vehicle
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0
from tasks.scene.street.bend import integrate_course
from tasks.scene.street.cars.parked import COARSE, build_parked, draw_look, mirror_surroundings, place_body
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.near import choose_cell, measure_approach, replace_discs
from tasks.scene.street.objects import list_objects, own_gaussians
from tasks.scene.street.plan import Car, plan_street
from tasks.scene.surroundings import add_surroundings

Floats = NDArray[np.float64]

LEVELS = (0.045, 0.06, 0.08, 0.11, 0.15, 0.2)
"""Spacings of a car's discs: 25,000 to 1,500 discs a car [m]."""
CELL_PX = 4.5
"""Spacing where the clip comes nearest, with the focal length that its camera has [px]."""
_NORMAL_M = 0.4
"""Way that counts as much as a turn of the surface by a radian, for the light of the nearest coarse disc [m]."""
_ALIKE = 4
"""Coarse discs whose light is averaged [1]."""


def detail_cars(
    gaussians: Gaussians, layout: StreetLayout, seed: int, T_world_camera: Floats, focal_px: float
) -> Gaussians:
    """Return the street with fine cars in place of the coarse ones that a clip comes near; these come last.

    Parameters
    ----------
    gaussians : of the street with this layout and seed
    layout, seed : of the street
    T_world_camera : float64 [F, 4, 4] poses of the clip's camera [m]
    focal_px : its focal length [px]

    Returns
    -------
    Gaussians
        The same for the same arguments; the other Gaussians are bitwise unchanged and in their order.
    """
    cars, owners, classes = _list_owners(layout, seed)
    first = len(gaussians) - len(owners)
    own_gaussians(gaussians, owners, classes)
    line = integrate_course(layout)
    gone, parts = [], []
    for number, car in enumerate(cars, start=1):
        foot = line.to_world(np.array([[car.station, car.lateral, 0.0]]))[0]
        distance, nearest = measure_approach(foot + np.array([0.0, 0.0, 0.7]), T_world_camera)
        cell = choose_cell(CELL_PX, distance, focal_px, LEVELS)
        if cell is None:
            continue
        rows = first + np.flatnonzero(owners == number)
        gone.append(rows)
        coarse: dict[str, Any] = {
            member.name: value[rows]
            for member in fields(Gaussians)
            if isinstance(value := getattr(gaussians, member.name), np.ndarray)
        }
        axes = line.to_world_directions(np.full(3, car.station), np.diag([car.facing, car.facing, 1.0]))
        eye = (axes * (T_world_camera[nearest, :3, 3] - foot)).sum(axis=1)
        parts.append(_light_fine(_make_fine(layout, seed, car, cell), replace(gaussians, **coarse), eye))
    if not parts:
        return gaussians
    return replace_discs(gaussians, np.concatenate(gone), parts)


@dataclass(frozen=True, kw_only=True)
class _FineCar:
    """A fine car, and the coarse discs from which each of its own takes its light.

    Parameters
    ----------
    members : of its `Gaussians`, but for those that the light decides
    body : in its own axes
    coarse_albedo, coarse_glow : float64 [M, 3] reflectance and mirrored radiance of the coarse discs [1]
    nearest : int64 [N, `_ALIKE`] coarse discs [1]
    weight : float64 [N, `_ALIKE`] of the light of each [1]
    """

    members: dict[str, NDArray[np.generic]]
    body: Body
    coarse_albedo: Floats
    coarse_glow: Floats
    nearest: NDArray[np.int64]
    weight: Floats


@lru_cache(maxsize=16)
def _make_fine(layout: StreetLayout, seed: int, car: Car, cell: float) -> _FineCar:
    line, body = integrate_course(layout), build_parked(car, seed, cell)
    old, new = (place_body(one, car) for one in (build_parked(car, seed, COARSE), body))
    places = [np.concatenate([s.centre, _NORMAL_M * s.axes[:, 2]], axis=1) for s in (old, new)]
    away, nearest = cKDTree(places[0]).query(places[1], k=_ALIKE)
    weight = 1 / (away + 0.02) ** 2
    station = new.centre[:, 0]
    members: dict[str, Any] = {
        "means": line.to_world(new.centre).astype(np.float32),
        "quats_wxyz": line.to_world_quaternions(station, new.axes).astype(np.float32),
        "scales": body.gaussians.scales,
        "opacities": body.gaussians.opacities,
        "normals": line.to_world_directions(station, new.axes[:, 2]).astype(np.float32),
        "class_id": body.gaussians.class_id,
        "surroundings": _count_surroundings(car.model, draw_look(car, seed)[1], cell),
    }
    return _FineCar(
        members=members, body=body, coarse_albedo=old.albedo, coarse_glow=old.glow,
        nearest=nearest, weight=weight / weight.sum(axis=1, keepdims=True),
    )  # fmt: skip


def _light_fine(car: _FineCar, coarse: Gaussians, eye: Floats) -> Gaussians:
    """Return the fine discs in the light of the coarse ones, and what they mirror to an eye in the body's axes [m]."""
    glow = mirror_surroundings(car.body, eye)
    radiance = np.maximum(coarse.sh[:, 0].astype(np.float64) * C0 + 0.5, 0)
    light = np.maximum(radiance - car.coarse_glow, 0) / car.coarse_albedo
    colour = car.body.albedo * np.einsum("nk,nkc->nc", car.weight, light[car.nearest]) + glow
    out: dict[str, Any] = car.members | {"sh": ((colour - 0.5) / C0).astype(np.float32)[:, None]}
    if coarse.surroundings is None:
        out["surroundings"] = None
    if coarse.light is not None:
        shares = np.einsum("nk,nkc->nc", car.weight, coarse.light[car.nearest].astype(np.float64))
        shares[:, 3] = glow.sum(axis=1) / np.maximum(colour.sum(axis=1), 1e-9)
        out["light"] = np.clip(shares, 0, 1).astype(np.float32)
    return replace(coarse, **out)


@lru_cache(maxsize=4)
def _list_owners(
    layout: StreetLayout, seed: int
) -> tuple[tuple[Car, ...], NDArray[np.int32], NDArray[np.uint8]]:
    """Return the cars of a street, and the owner and the class of each of its last Gaussians."""
    _, owners, classes = list_objects(layout, seed)
    return plan_street(layout, seed).cars, owners, classes


@lru_cache(maxsize=128)
def _count_surroundings(model: str, plate: int, cell: float) -> NDArray[np.float32] | None:
    return add_surroundings(build_vehicle(model, cell=cell, seed=plate).gaussians).surroundings
