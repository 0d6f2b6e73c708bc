"""The vehicle: specified mechanical values, frozen empirical tables, and the response that they give on one surface."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.surface.weather import WEATHERS, find_weather
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.tyres.burckhardt import BurckhardtCurve
from tasks.vehicle.tyres.contract import Curve, Tyre, scale_curve


@dataclass(frozen=True, kw_only=True)
class TyreFamily:
    """Tyre curve and frozen calibration of one weather family (paper, Table frozen_empirical_params).

    Parameters
    ----------
    burckhardt : base curve
    surface_friction : ascending knots mu_c of the tables below [1]
    efficiency : eta_tire at each knot, scales mu_c to the tyre's peak [1]
    slip_stiffness : beta_kappa at each knot, scales slip [1]
    pitch_scale : gamma_theta at each knot, scales the brake-pitch moment of paper mode [1]
    hold_s : tau_h at each knot, low-speed hold of paper mode [s]
    release_s : tau_r at each knot, low-speed release of paper mode [s]
    """

    burckhardt: BurckhardtCurve
    surface_friction: tuple[float, ...]
    efficiency: tuple[float, ...]
    slip_stiffness: tuple[float, ...]
    pitch_scale: tuple[float, ...]
    hold_s: tuple[float, ...]
    release_s: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """One vehicle (paper, Tables frozen_physical_params and frozen_empirical_params).

    Parameters
    ----------
    name : name of the catalogue entry
    sprung_mass : m_s [kg]
    unsprung_mass_f, unsprung_mass_r : m_u of each axle [kg]
    cg_to_front_axle, cg_to_rear_axle : l_f and l_r [m]
    cg_height : h_cg above the road [m]
    pitch_inertia : I_y of the sprung body [kg m2]
    suspension_stiffness_f, suspension_stiffness_r : k_s of each axle [N/m]
    suspension_damping_f, suspension_damping_r : c_s of each axle [N s/m]
    tyre_stiffness_f, tyre_stiffness_r : vertical, k_t of each axle [N/m]
    wheel_radius : effective rolling radius, R [m]
    wheel_inertia_f, wheel_inertia_r : I_w of each axle [kg m2]
    brake_gain : torque of both axles together per pressure, K_p [N m/MPa]
    front_brake_share : b_f; the rear has the rest [1]
    abs_release_width : delta_a, relative to the target slip [1]
    abs_build_rate, abs_release_rate : largest rates of the ABS torque scale [1/s]
    coast_deceleration : a_coast [m/s2]
    hold_ratio : rho_h of the low-speed pitch rule [1]
    coupled_pitch_scale : extra brake-pitch scale on road features in paper mode [1]
    static_pitch : body pitch at rest, nose-down positive; the rollout's pitch excludes it [rad]
    slip_speed_floor : v_epsilon of the slip's denominator [m/s]
    stop_speed : the vehicle stands at or below it [m/s]
    lock_speed : in coupled mode, wheel speed below which brake friction turns proportional to it [rad/s]
    gravity : g [m/s2]
    families : its own tyre family of each kind of weather that it was fitted in
    shared_families : tyre families that the kinds of weather bring, for the others
    tyre : Magic Formula of every wheel; None where the families' Burckhardt curves are the tyre
    effects : numbers of ``tasks.vehicle.effects.table`` that the model adds; none in the paper's model
    forms : forms outside the library that the model adds; none in the paper's model
    """

    name: str
    sprung_mass: float
    unsprung_mass_f: float
    unsprung_mass_r: float
    cg_to_front_axle: float
    cg_to_rear_axle: float
    cg_height: float
    pitch_inertia: float
    suspension_stiffness_f: float
    suspension_stiffness_r: float
    suspension_damping_f: float
    suspension_damping_r: float
    tyre_stiffness_f: float
    tyre_stiffness_r: float
    wheel_radius: float
    wheel_inertia_f: float
    wheel_inertia_r: float
    brake_gain: float
    front_brake_share: float
    abs_release_width: float
    abs_build_rate: float
    abs_release_rate: float
    coast_deceleration: float
    hold_ratio: float
    coupled_pitch_scale: float
    static_pitch: float
    slip_speed_floor: float
    stop_speed: float
    lock_speed: float
    gravity: float
    families: Mapping[str, TyreFamily]
    tyre: Curve | None = None
    effects: Mapping[str, float] = field(default_factory=dict)
    forms: tuple[Form, ...] = ()
    shared_families: Mapping[str, TyreFamily] = field(default_factory=dict)

    def find_tyre_family(self, weather: str) -> TyreFamily:
        """Return the tyre family in a kind of weather: the vehicle's own, else the one that the kind brings.

        Parameters
        ----------
        weather : name of the kind

        Raises
        ------
        InputError
            If there is no such kind, or neither has a family for it.
        """
        name = find_weather(weather).tyre_family
        family = self.families.get(name, self.shared_families.get(name))
        if family is None:
            raise InputError(
                f"vehicle {self.name} has no tyre family for weather {weather}, only for {', '.join(self.families)}:"
                f" add families.{name} to its file"
            )
        return family

    def find_weathers(self) -> list[str]:
        """Return the kinds of weather in which the vehicle has a tyre family."""
        return [
            name
            for name, row in WEATHERS.items()
            if row.tyre_family in self.families or row.tyre_family in self.shared_families
        ]

    def find_curve(self, weather: str) -> Curve:
        """Return the curve that is scaled to a surface: the vehicle's own, else that of the tyre family.

        Parameters
        ----------
        weather : name of the kind

        Raises
        ------
        InputError
            As `find_tyre_family` raises it.
        """
        return self.find_tyre_family(weather).burckhardt if self.tyre is None else self.tyre

    @property
    def mass(self) -> float:
        """Return the mass of body and axles [kg]."""
        return self.sprung_mass + self.unsprung_mass_f + self.unsprung_mass_r

    @property
    def wheelbase(self) -> float:
        """Return the distance between the axles, L_w [m]."""
        return self.cg_to_front_axle + self.cg_to_rear_axle

    @property
    def static_axle_loads(self) -> tuple[float, float]:
        """Return the front and rear axle load at rest on a level road [N] (paper, Appendix B)."""
        weight = self.sprung_mass * self.gravity
        return (
            weight * self.cg_to_rear_axle / self.wheelbase + self.unsprung_mass_f * self.gravity,
            weight * self.cg_to_front_axle / self.wheelbase + self.unsprung_mass_r * self.gravity,
        )


@dataclass(frozen=True, kw_only=True)
class SurfaceResponse:
    """Values of the frozen tables on one surface.

    Parameters
    ----------
    tyre : the tyre on this surface, its curve scaled to the peak
    slip_stiffness : beta_kappa [1]
    pitch_scale : gamma_theta [1]
    hold_s, release_s : tau_h and tau_r [s]
    extrapolated : the surface friction lies outside the knots, so the end values hold
    wet : water lies on the road
    """

    tyre: Tyre
    slip_stiffness: float
    pitch_scale: float
    hold_s: float
    release_s: float
    extrapolated: bool
    wet: bool


@register_jitable
def compute_tyre_scale(
    surface_friction: float,
    knots: NDArray[np.float64],
    efficiency: NDArray[np.float64],
    slip_stiffness: NDArray[np.float64],
) -> tuple[float, float]:
    """Return the tyre's peak mu_eff and its slip stiffness beta at one surface friction [1].

    Parameters
    ----------
    surface_friction : mu_c [1]
    knots, efficiency, slip_stiffness : float64 [K] a tyre family's tables [1]
    """
    peak = interpolate_knots(surface_friction, knots, efficiency) * surface_friction
    return peak, interpolate_knots(surface_friction, knots, slip_stiffness)


@register_jitable
def interpolate_knots(x: float, knots: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Return the value of a piecewise-linear table, constant beyond its ends [of the values].

    It is `numpy.interp`, to the bit; Numba's takes memory for its result, which a compiled drive cannot have.

    Parameters
    ----------
    x : where to look [unit of the knots]
    knots : float64 [K] ascending [unit of x]
    values : float64 [K] at the knots
    """
    last = len(knots) - 1
    if not x < knots[last]:
        return float(values[last])
    if x < knots[0]:
        return float(values[0])
    k = 0
    while x >= knots[k + 1]:
        k += 1
    slope = (values[k + 1] - values[k]) / (knots[k + 1] - knots[k])
    return float(slope * (x - knots[k]) + values[k])


def compute_surface_response(vehicle: Vehicle, family: str, surface_friction: float) -> SurfaceResponse:
    """Return tyre curve and pitch calibration at one surface friction: piecewise linear, constant beyond the end knots.

    Parameters
    ----------
    vehicle : vehicle with the tables
    family : name of a kind of weather
    surface_friction : mu_c [1]
    """
    table = vehicle.find_tyre_family(family)
    knots = np.array(table.surface_friction)

    def interpolate(values: tuple[float, ...]) -> float:
        return interpolate_knots(surface_friction, knots, np.array(values))

    peak, slip_stiffness = compute_tyre_scale(
        surface_friction, knots, np.array(table.efficiency), np.array(table.slip_stiffness)
    )
    # The knots are printed with six digits, so a friction within their rounding is on the end knot.
    rounding = 5e-7
    return SurfaceResponse(
        tyre=scale_curve(vehicle.find_curve(family), peak, slip_stiffness),
        slip_stiffness=slip_stiffness,
        pitch_scale=interpolate(table.pitch_scale),
        hold_s=interpolate(table.hold_s),
        release_s=interpolate(table.release_s),
        extrapolated=not knots[0] - rounding <= surface_friction <= knots[-1] + rounding,
        wet=find_weather(family).wet,
    )
