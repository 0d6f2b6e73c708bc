""" "Constants of the car and the pavement that the auditor takes as given, and the closed forms of its laws.

Written from the paper's appendices alone: nothing here is shared with the model that made the telemetry.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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
    """

    car: Mapping[str, float]
    surface: Mapping[str, float]
    tyres: Mapping[str, TyreTables]
    mode: str

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


def burckhardt(slip: Floats, base: tuple[float, float, float]) -> Floats:
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
    weather : dry, rain or snow
    rate : precipitation [mm/h]
    hours : snow accumulation time [h]
    surface : pavement values
    """
    film = snow = 0.0
    if weather == "rain":
        film = surface["film_coefficient"] * np.prod(
            [
                base ** surface[f"film_{name}_exponent"]
                for name, base in (
                    ("texture", surface["texture_depth_mm"]),
                    ("length", surface["drainage_length"]),
                    ("rate", rate),
                    ("crossfall", surface["crossfall"]),
                )
            ]
        )
    if weather == "snow":
        snow = rate * hours * surface["water_density"] / surface["fresh_snow_density"]
    cover = min(1.0, snow / surface["full_cover_depth_mm"])
    dry, flooded, wet = surface["dry_friction"], surface["flooded_friction"], surface["bare_wet_friction"]
    friction = {
        "dry": dry,
        "rain": flooded + (dry - flooded) * float(np.exp(-film / surface["film_decay_mm"])),
        "snow": wet - (wet - surface["snow_friction"]) * cover,
    }[weather]
    return {
        "film_depth_mm": float(film),
        "snow_depth_mm": snow,
        "snow_coverage": cover,
        "surface_friction": friction,
    }
