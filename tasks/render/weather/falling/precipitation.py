"""Falling precipitation as populations: how many, how large, how fast, and how much light they stop.

Everything is in world units: particles per cubic metre, metres per second, optical depth per metre. What is
drawn one by one near the camera (`tasks.render.weather.falling.particles`) and what stays a mean extinction
(`tasks.render.weather.atmosphere`) are two shares of the same population, so light is taken out once.
"""

from dataclasses import dataclass
from math import gamma

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class ParticleParameters:
    """One kind of precipitation: N(D) = intercept R^a exp(-slope R^b D), and what a particle of size D is like.

    Parameters
    ----------
    kind : rain for drops, snow for flakes; picks the form of the fall speed, and names the random stream
    intercept : N_0 at 1 mm/h, by diameter of the melted particle [mm-1 m-3]
    intercept_exponent : a [1]
    slope : Lambda at 1 mm/h [mm-1]
    slope_exponent : b [1]
    smallest_mm, largest_mm : melted diameters between which particles are drawn [mm]
    classes : number of size classes between them; a class falls at one speed [1]
    visible_diameter_ratio : diameter of the particle in the air by its melted diameter [1]
    cell_per_diameter : edge of a cell by the class's diameter; a few particles to a cell at the highest rates [1]
    fall_speed : coefficients of `atlas_fall_speed` or `power_fall_speed`
    extinction_efficiency : extinction by geometric cross-section [1]
    flutter_m : amplitude of the sideways flutter [m]
    flutter_hz : its frequency [Hz]
    smallest_drawn_px : projected diameter below which a particle is part of the mean extinction [px]
    scattering : share of the incident light that a particle sends on; 1 for clear water and ice [1]
    backlit_share : share of its light that comes from beyond it, the rest comes from the viewer's side [1]
    """

    kind: str
    intercept: float
    intercept_exponent: float
    slope: float
    slope_exponent: float
    smallest_mm: float
    largest_mm: float
    classes: int
    visible_diameter_ratio: float
    cell_per_diameter: float
    fall_speed: tuple[float, ...]
    extinction_efficiency: float
    flutter_m: float
    flutter_hz: float
    smallest_drawn_px: float
    scattering: float
    backlit_share: float


@dataclass(frozen=True, kw_only=True)
class NearField:
    """Where particles are drawn one by one.

    Parameters
    ----------
    nearest_m : distance from which particles are drawn; nearer ones are on the car, not in the picture [m]
    farthest_m : distance up to which even the largest are drawn [m]
    fade_share : share of a class's reach over which it fades into the mean extinction [1]
    aperture_mm : diameter of the lens opening, focused at infinity; it spreads near particles [mm]
    """

    nearest_m: float
    farthest_m: float
    fade_share: float
    aperture_mm: float


@dataclass(frozen=True, kw_only=True)
class Population:
    """The precipitation of one rate, by size class.

    Parameters
    ----------
    parameters : the kind it was made from
    rate_mm_h : water-equivalent rate [mm/h]
    slope_mm : Lambda at this rate [mm-1]
    edges_mm : float64 [M + 1] melted diameters between the classes [mm]
    density : float64 [M] particles per volume [m-3]
    cross_section : float64 [M] mean geometric cross-section of a particle [m2]
    speed : float64 [M] fall speed [m s-1]
    cell_m : float64 [M] edge of the cells in which the class is drawn; the same at every rate [m]
    extinction : extinction coefficient of the whole population, all sizes [m-1]
    """

    parameters: ParticleParameters
    rate_mm_h: float
    slope_mm: float
    edges_mm: NDArray[np.float64]
    density: NDArray[np.float64]
    cross_section: NDArray[np.float64]
    speed: NDArray[np.float64]
    cell_m: NDArray[np.float64]
    extinction: float


def exponential_moment(intercept: float, slope: float, order: float) -> float:
    """Integral of D^order intercept exp(-slope D) over all diameters (Marshall & Palmer 1948).

    Parameters
    ----------
    intercept : N_0 [mm-1 m-3]
    slope : Lambda [mm-1]
    order : power of the diameter [1]

    Returns
    -------
    float
        The moment [mm^order m-3].
    """
    return intercept * gamma(order + 1) / slope ** (order + 1)


def atlas_fall_speed(
    diameter_mm: NDArray[np.float64], coefficients: tuple[float, ...]
) -> NDArray[np.float64]:
    """Terminal speed of drops, v = A - B exp(-C D) (Atlas et al. 1973, doi:10.1029/RG011i001p00001).

    Parameters
    ----------
    diameter_mm : drop diameter [mm]
    coefficients : A [m s-1], B [m s-1], C [mm-1]

    Returns
    -------
    NDArray
        Speed, never negative: the fit leaves its range below 0.1 mm [m s-1].
    """
    A, B, C = coefficients
    return np.maximum(A - B * np.exp(-C * diameter_mm), 0.0)


def power_fall_speed(
    diameter_mm: NDArray[np.float64], coefficients: tuple[float, ...]
) -> NDArray[np.float64]:
    """Fall speed of snowflakes, v = A D^B (Locatelli & Hobbs 1974, doi:10.1029/JC079i015p02185).

    Parameters
    ----------
    diameter_mm : diameter of the flake in the air [mm]
    coefficients : A [m s-1 mm-B], B [1]

    Returns
    -------
    NDArray
        Speed [m s-1].
    """
    A, B = coefficients
    return A * diameter_mm**B


FALL_SPEED = {"rain": atlas_fall_speed, "snow": power_fall_speed}


def make_population(parameters: ParticleParameters, rate_mm_h: float) -> Population:
    """The particles in the air at one precipitation rate.

    Parameters
    ----------
    parameters : the kind of precipitation
    rate_mm_h : water-equivalent rate [mm/h]

    Returns
    -------
    Population

    Raises
    ------
    InputError
        The rate is not a positive number, or no fall-speed model has the kind's name.
    """
    p = parameters
    problems = []
    if not (np.isfinite(rate_mm_h) and rate_mm_h > 0):
        problems.append(f"precipitation: the rate must be positive; it is {rate_mm_h:g} mm/h")
    if p.kind not in FALL_SPEED:
        problems.append(
            f"precipitation: kind must be one of {', '.join(sorted(FALL_SPEED))}; it is {p.kind!r}"
        )
    if problems:
        raise InputError(problems)
    N0 = p.intercept * rate_mm_h**p.intercept_exponent
    slope = p.slope * rate_mm_h**p.slope_exponent
    edges = np.linspace(p.smallest_mm, p.largest_mm, p.classes + 1)
    below = np.exp(-slope * edges)
    density = N0 / slope * (below[:-1] - below[1:])
    # integral of D^2 exp(-slope D), by parts
    second = below * (edges**2 / slope + 2 * edges / slope**2 + 2 / slope**3)
    mean_square = N0 * (second[:-1] - second[1:]) / density
    ratio = p.visible_diameter_ratio
    to_area = np.pi / 4 * (1e-3 * ratio) ** 2
    middle = (edges[:-1] + edges[1:]) / 2
    return Population(
        parameters=p,
        rate_mm_h=rate_mm_h,
        slope_mm=slope,
        edges_mm=edges,
        density=density,
        cross_section=to_area * mean_square,
        speed=FALL_SPEED[p.kind](middle * ratio, p.fall_speed),
        cell_m=p.cell_per_diameter * edges[1:] * ratio * 1e-3,
        extinction=p.extinction_efficiency * to_area * exponential_moment(N0, slope, 2),
    )


def drawn_reach(population: Population, near: NearField, focal_px: float) -> NDArray[np.float64]:
    """Distance up to which each class is drawn particle by particle.

    Parameters
    ----------
    population : the precipitation
    near : limits of the near field
    focal_px : focal length of the camera [px]

    Returns
    -------
    float64 [M] distance; 0 for a class that is never large enough [m]
    """
    p = population.parameters
    middle = 0.5e-3 * (population.edges_mm[:-1] + population.edges_mm[1:]) * p.visible_diameter_ratio
    reach = np.minimum(middle * focal_px / p.smallest_drawn_px, near.farthest_m)
    return np.where(reach * (1 - near.fade_share) > near.nearest_m, reach, 0.0)


def drawn_optical_depth(
    population: Population, near: NearField, focal_px: float, distance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Optical depth, up to a distance, of the particles that are drawn one by one.

    A class counts in full from ``nearest_m`` to ``reach (1 - fade_share)`` and fades linearly to its reach,
    exactly as the drawing fades it.

    Parameters
    ----------
    population : the precipitation
    near : limits of the near field
    focal_px : focal length of the camera [px]
    distance : float64 [...] distances from the camera [m]

    Returns
    -------
    float64 [...] optical depth [1]
    """
    reach = drawn_reach(population, near, focal_px)
    total = np.zeros_like(np.asarray(distance, dtype=np.float64))
    for density, area, far in zip(population.density, population.cross_section, reach, strict=True):
        if far == 0:
            continue
        start = far * (1 - near.fade_share)
        full = np.clip(distance, near.nearest_m, start) - near.nearest_m
        into = np.clip(distance, start, far) - start
        total += density * area * (full + into - into**2 / (2 * (far - start)))
    return total
