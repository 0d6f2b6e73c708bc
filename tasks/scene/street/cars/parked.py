"""Parked cars: their bodies in the street, and the shade they cast."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.bodies.body import Body
from tasks.scene.bodies.solids import tangents
from tasks.scene.bodies.vehicles import SHAPES, build_vehicle
from tasks.scene.street import palette
from tasks.scene.street.layout import EYE_HEIGHT
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Car
from tasks.scene.street.surfels import Surfels

Floats = NDArray[np.float64]

COARSE = 0.26
"""Spacing of the discs of a car that no clip comes near [m]."""
_SILL = 0.20
_SEEN_FROM = 9.0
"""Distance before the car from which its mirror images are right [m]."""
_MOST_MIRRORED = 0.55
_SKY, _HOUSES, _ROAD = (
    np.array([0.42, 0.52, 0.68]),
    np.array([0.16, 0.15, 0.14]),
    np.array([0.13, 0.13, 0.125]),
)
_RIDGE, _RIDGE_WAVES = (0.75, 0.08, 0.06), (2, 5, 11)
"""Height of the mirrored houses by their distance, its variation, and width of their edge; its waves a turn [1]."""


def list_cars(parked: tuple[Car, ...], seed: int) -> list[Surfels]:
    """Build the surfels of each parked car, class vehicle.

    Parameters
    ----------
    parked : the cars
    seed : the street's seed [1]
    """
    return [place_body(build_parked(car, seed, COARSE), car) for car in parked]


def build_parked(car: Car, seed: int, cell: float) -> Body:
    """Build the body of a parked car.

    Parameters
    ----------
    car : its kind and number
    seed : the street's seed, which draws its colour [1]
    cell : spacing of its discs [m]
    """
    paint, plate = draw_look(car, seed)
    return build_vehicle(car.model, colour=paint, cell=cell, seed=plate)


def draw_look(car: Car, seed: int) -> tuple[Floats, int]:
    """Draw the reflectance of a car's paint, float64 [3] [1], and the seed of its plates.

    Parameters
    ----------
    car : its number
    seed : the street's seed [1]
    """
    rng = named_generator(seed, f"car {car.number}")
    return palette.CAR_PAINT[rng.integers(len(palette.CAR_PAINT))], int(rng.integers(4))


def place_body(body: Body, car: Car) -> Surfels:
    """Return a body in the place of a parked car, with what its lacquer and glass mirror.

    Parameters
    ----------
    body : of the car
    car : where it stands and which way it faces
    """
    turn = np.array([car.facing, car.facing, 1.0])
    centre = body.gaussians.means.astype(np.float64)
    normal = body.gaussians.normals.astype(np.float64)
    eye = np.array([-car.facing * _SEEN_FROM, -car.facing * car.lateral, EYE_HEIGHT])
    return Surfels(
        centre=centre * turn + np.array([car.station, car.lateral, 0.0]),
        axes=np.stack([*tangents(normal), normal], axis=1) * turn,
        scale=body.gaussians.scales[:, :2].astype(np.float64),
        albedo=body.albedo,
        glow=mirror_surroundings(body, eye),
        openness=body.openness,
        opacity=body.gaussians.opacities.astype(np.float64),
        class_id=np.full(len(centre), SemanticClass.VEHICLE, dtype=np.uint8),
    )


def car_boxes(parked: tuple[Car, ...]) -> Floats:
    """Return the boxes [K, 2, 3] that cast the cars' shadows: body and cabin, slightly inside the surface [m]."""
    boxes = []
    for car in parked:
        shape = SHAPES[car.model]
        length, width, top = shape.size
        lower = (0.02, 0.98, 0.92, _SILL + 0.05, 0.48 * top)
        cabin = (shape.glass[0] + 0.05, shape.glass[1] - 0.08, 0.70, 0.47 * top, top - 0.12)
        for tail, nose, narrow, low, high in (lower, cabin):
            s = sorted(car.station + car.facing * length * (end - 0.5) for end in (tail, nose))
            half = narrow * width / 2
            boxes.append([[s[0], car.lateral - half, low], [s[1], car.lateral + half, high]])
    return np.array(boxes).reshape(-1, 2, 3)


def car_footprints(parked: tuple[Car, ...]) -> Floats:
    """Return the ground under the cars [K, 2, 2]: lowest and highest station and lateral position [m]."""
    rectangles = []
    for car in parked:
        length, width = 0.46 * SHAPES[car.model].size[0], 0.42 * SHAPES[car.model].size[1]
        rectangles.append([[car.station + k * length, car.lateral + k * width] for k in (-1, 1)])
    return np.array(rectangles).reshape(-1, 2, 2)


def mirror_surroundings(body: Body, eye: Floats) -> Floats:
    """Return the radiance [N, 3] that a body mirrors, after Schlick (1994), doi:10.1111/1467-8659.1330233.

    It is that of sky, of houses along the road, and of the road itself.

    Parameters
    ----------
    body : in its own axes
    eye : float64 [3] to which it is mirrored, in the same axes [m]
    """
    normal, gloss = body.gaussians.normals.astype(np.float64), body.gloss
    view = eye - body.gaussians.means
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    cosine = np.clip((normal * view).sum(axis=1), 0.0, 1.0)
    along = 2 * cosine[:, None] * normal - view
    up, turn = along[:, 2:], np.arctan2(along[:, 1:2], along[:, :1])
    share = gloss + (1 - gloss) * (1 - cosine) ** 5 * (gloss > 0)
    waves = sum(np.sin(k * turn + k * k) / np.sqrt(k) for k in _RIDGE_WAVES)
    ridge = np.sin(np.arctan(np.maximum(_RIDGE[0] * np.abs(np.sin(turn)) + _RIDGE[1] * waves, 0.02)))
    sky = np.clip((up - ridge) / _RIDGE[2] + 0.5, 0.0, 1.0)
    road = np.clip(-up / 0.1 + 0.5, 0.0, 1.0)
    fronts = _HOUSES * (1 + 0.5 * np.sign(np.sin(19 * turn)) * np.clip(4 * up * (1 - up / ridge), 0, 1))
    around = (fronts * (1 - sky) + _SKY * sky) * (1 - road) + _ROAD * road
    return np.minimum(share, _MOST_MIRRORED)[:, None] * around
