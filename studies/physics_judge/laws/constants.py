"""Constants of the car and the pavement that the auditor takes as given, and the closed forms of its laws.

Written from the paper's appendices alone: nothing here is shared with the model that made the telemetry.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

DT = 0.001
"""Tick interval [s]."""


@dataclass(frozen=True, kw_only=True)
class TyreTables:
    """Base curve and knots of one weather family.

    Parameters
    ----------
    burckhardt : c1, c2, c3 [1]
    surface_friction, efficiency, slip_stiffness, pitch_scale : mu_c, eta, beta and gamma at the knots [1]
    hold_s, release_s : tau_h and tau_r at the knots [s]
    """

    burckhardt: tuple[float, float, float]
    surface_friction: tuple[float, ...]
    efficiency: tuple[float, ...]
    slip_stiffness: tuple[float, ...]
    pitch_scale: tuple[float, ...]
    hold_s: tuple[float, ...]
    release_s: tuple[float, ...]

    def at(self, knots: tuple[float, ...], friction: float) -> float:
        """A table's value at a surface friction, end values held."""
        return float(np.interp(friction, self.surface_friction, knots))


@dataclass(frozen=True, kw_only=True)
class Constants:
    """Numbers of the frozen car and pavement, by the names of their catalogue files.

    Parameters
    ----------
    car : mechanical values in SI units
    surface : pavement values, units in their names
    tyres : tables of each weather family
    mode : paper or coupled
    ticks_per_frame : ticks from one frame to the next [1]
    steady_limit : explicit wheel step beyond which the wheels step implicitly, in time constants; 0 never [1]
    held_share : part of the hold time, up to the stop, over which the released deceleration is the mean [1]
    low_speed_rule : whether the low-speed rule replaces the deceleration that pitches the body
    tyre : entries of the property file of every wheel's tyre, as text; None where the families' Burckhardt curves are
        the tyre
    effects : numbers that the car adds to the plain laws, by name [units of the table of effects]
    forms : port and variable of each form outside that table
    policy : whether a policy braked, and no scenario
    """

    car: Mapping[str, float]
    surface: Mapping[str, float]
    tyres: Mapping[str, TyreTables]
    mode: str
    ticks_per_frame: float
    steady_limit: float = 0.0
    held_share: float = 0.0
    low_speed_rule: bool = True
    tyre: Mapping[str, str] | None = None
    effects: Mapping[str, float] = field(default_factory=dict)
    forms: tuple[tuple[str, str], ...] = ()
    policy: bool = False

    @property
    def mass(self) -> float:
        """Whole car [kg]."""
        return self.car["sprung_mass"] + self.car["unsprung_mass_f"] + self.car["unsprung_mass_r"]

    @property
    def wheelbase(self) -> float:
        """L_w [m]."""
        return self.car["cg_to_front_axle"] + self.car["cg_to_rear_axle"]

    def static_load(self, axle: str) -> float:
        """Axle load at rest [N] (paper, Appendix B).

        Parameters
        ----------
        axle : f or r
        """
        lever = self.car["cg_to_rear_axle" if axle == "f" else "cg_to_front_axle"]
        body = self.car["sprung_mass"] * lever / self.wheelbase
        return (body + self.car[f"unsprung_mass_{axle}"]) * self.car["gravity"]

    def brake_share(self, axle: str) -> float:
        """b_a [1].

        Parameters
        ----------
        axle : f or r
        """
        front = self.car["front_brake_share"]
        return front if axle == "f" else 1.0 - front


class ClipColumns(NamedTuple):
    """What the laws of a clip's motion relate.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    constants : car and pavement
    """

    ticks: Mapping[str, Floats]
    facts: Mapping[str, Any]
    constants: Constants


def read_grade(ticks: Mapping[str, Floats]) -> Floats:
    """Return the grade at each tick [N] [1]; 0 where an older dataset has none, whose roads were felt as level.

    Parameters
    ----------
    ticks : columns of the tick table
    """
    if "road_grade" not in ticks:
        return np.zeros(len(ticks["station"]))
    return np.nan_to_num(np.asarray(ticks["road_grade"], np.float64))


def find_climb(ticks: Mapping[str, Floats], constants: Constants) -> tuple[Floats, Floats, Floats]:
    """Return the deceleration that the grade causes [m/s2]: at each tick, half a tick later, and what is open there.

    Between two ticks the grade may bend once.

    Parameters
    ----------
    ticks : columns of the tick table
    constants : car and pavement
    """
    climb = constants.car["gravity"] * read_grade(ticks)
    bend = np.abs(np.diff(climb, 2, prepend=climb[:1], append=climb[-1:]))
    return climb, 0.5 * (climb[1:] + climb[:-1]), np.maximum(bend[1:], bend[:-1])


def compute_burckhardt_friction(slip: Floats, base: tuple[float, float, float]) -> Floats:
    """b(kappa) (paper, Appendix B).

    Parameters
    ----------
    slip : kappa, any shape [1]
    base : c1, c2, c3 [1]
    """
    c1, c2, c3 = base
    return c1 * (1.0 - np.exp(-c2 * slip)) - c3 * slip


def peak_slip(base: tuple[float, float, float]) -> float:
    """Slip at the top of the base curve, where its derivative vanishes [1].

    Parameters
    ----------
    base : c1, c2, c3 [1]
    """
    c1, c2, c3 = base
    return min(float(np.log(c1 * c2 / c3)) / c2, 1.0)


def raised_cosine(station: Floats, center: float, length: float, height: float) -> tuple[Floats, Floats]:
    """Height [m] and slope [1] of the road feature (paper, Eq. shared_road_profile).

    Parameters
    ----------
    station : any shape [m]
    center, length, height : s_g, L_g and A_g [m]
    """
    if height == 0.0:
        return np.zeros_like(station), np.zeros_like(station)
    wave = 2.0 * np.pi / length
    offset = station - center
    inside = np.abs(offset) <= 0.5 * length
    rise = np.where(inside, 0.5 * height * (1.0 + np.cos(wave * offset)), 0.0)
    return rise, np.where(inside, -0.5 * height * wave * np.sin(wave * offset), 0.0)


def pressure_at(since_onset: Floats, peak: float, ramp: float, hold: float, release: float) -> Floats:
    """Ramp, hold and release [MPa].

    Parameters
    ----------
    since_onset : any shape [s]
    peak : [MPa]
    ramp, hold, release : durations; an infinite hold never releases [s]
    """
    corners = [0.0, max(ramp, 1e-12)]
    heights = [0.0, peak]
    if np.isfinite(hold):
        corners += [corners[-1] + hold, corners[-1] + hold + max(release, 1e-12)]
        heights += [peak, 0.0]
    return np.interp(since_onset, corners, heights)


def derive_surface(weather: str, rate: float, hours: float, surface: Mapping[str, float]) -> dict[str, float]:
    """Film, snow, coverage and mu_c from the precipitation (paper, Appendix E).

    Parameters
    ----------
    weather : name of a row of `SURFACE_FORMS`
    rate : precipitation [mm/h]
    hours : snow accumulation time [h]
    surface : pavement values
    """
    form = SURFACE_FORMS[weather]
    film, snow = form.film(rate, surface), form.snow(rate, hours, surface)
    cover = min(1.0, snow / surface["full_cover_depth_mm"])
    return {
        "film_depth_mm": film,
        "snow_depth_mm": snow,
        "snow_coverage": cover,
        "surface_friction": form.friction(film, cover, surface),
    }


def _draining_film(rate: float, surface: Mapping[str, float]) -> float:
    bases = (
        ("texture", surface["texture_depth_mm"]),
        ("length", surface["drainage_length"]),
        ("rate", rate),
        ("crossfall", surface["crossfall"]),
    )
    return float(
        surface["film_coefficient"]
        * np.prod([base ** surface[f"film_{name}_exponent"] for name, base in bases])
    )


def _fallen_snow(rate: float, hours: float, surface: Mapping[str, float]) -> float:
    return rate * hours * surface["water_density"] / surface["fresh_snow_density"]


def compute_wet_friction(speed: Floats | float, film: float, surface: Mapping[str, float]) -> Floats:
    """Return friction under a film by speed, any shape [1]: what wet texture leaves, less the load that water carries.

    Parameters
    ----------
    speed : any shape [m/s]
    film : from the bottom of the texture [mm]
    surface : pavement values with those of ``wet_friction: by-speed``
    """
    v, above = np.asarray(speed, np.float64), max(0.0, film - surface["texture_depth_mm"])
    share = -np.expm1(-np.power(above / surface["wet_planing_film_mm"], surface["wet_planing_exponent"]))
    pressure = np.clip(np.square(3.6 * v / 6.36) / surface["wet_tyre_pressure_kpa"], 0.0, 1.0)
    texture = surface["wet_friction"] * np.exp(-v / surface["wet_decay_speed"])
    return np.asarray(np.maximum(texture * (1.0 - share * pressure), surface["wet_planing_friction"]))


def grips_by_speed(surface: Mapping[str, float]) -> bool:
    """Return whether wet friction depends on speed."""
    return bool(np.isfinite(surface.get("wet_friction", np.nan)))


def _wet_friction(film: float, cover: float, surface: Mapping[str, float]) -> float:
    if grips_by_speed(surface):
        return float(compute_wet_friction(surface["wet_reference_speed"], film, surface))
    flooded = surface["flooded_friction"]
    return flooded + (surface["dry_friction"] - flooded) * float(np.exp(-film / surface["film_decay_mm"]))


def _snow_friction(film: float, cover: float, surface: Mapping[str, float]) -> float:
    wet = surface["bare_wet_friction"]
    return wet - (wet - surface["snow_friction"]) * cover


@dataclass(frozen=True, kw_only=True)
class SurfaceForm:
    """Closed forms of one kind of weather.

    Parameters
    ----------
    film : rate [mm/h] and pavement to the film's depth [mm]
    snow : rate [mm/h], hours [h] and pavement to the snow's depth [mm]
    friction : film [mm], coverage [1] and pavement to mu_c [1]
    feeds : columns of the clip's row that each of its columns follows from
    """

    film: Callable[[float, Mapping[str, float]], float] = lambda rate, surface: 0.0
    snow: Callable[[float, float, Mapping[str, float]], float] = lambda rate, hours, surface: 0.0
    friction: Callable[[float, float, Mapping[str, float]], float]
    feeds: Mapping[str, str] = field(default_factory=dict)


SURFACE_FORMS: Mapping[str, SurfaceForm] = {
    "dry": SurfaceForm(friction=lambda film, cover, surface: surface["dry_friction"]),
    "rain": SurfaceForm(
        film=_draining_film,
        friction=_wet_friction,
        feeds={
            "film_depth_mm": "clips.precipitation_mm_h",
            "surface_friction": "clips.film_depth_mm",
        },
    ),
    "snow": SurfaceForm(
        snow=_fallen_snow,
        friction=_snow_friction,
        feeds={
            "snow_depth_mm": "clips.precipitation_mm_h clips.snow_accumulation_h",
            "snow_coverage": "clips.snow_depth_mm",
            "surface_friction": "clips.snow_coverage",
        },
    ),
    "ice": SurfaceForm(
        film=lambda rate, surface: surface["glaze_mm"],
        friction=lambda film, cover, surface: surface["ice_friction"],
    ),
    "fog": SurfaceForm(friction=lambda film, cover, surface: surface["dry_friction"]),
}
"""The judge's own table of weathers, by the name of the kind."""
