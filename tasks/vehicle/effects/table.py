"""The table of effects: every number that a fit may give a vehicle, its road or its instruments.

Units, bounds, the order of a parameter vector, the values that the kernels take, the checks of catalogue files and
the numbers of a grown vehicle all derive from these rows. A new effect is one row here and one equation at its port.
"""

from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError

Kind = Literal["added", "scaled", "shifted"]

GILLESPIE = "Gillespie (1992), Fundamentals of Vehicle Dynamics, SAE R-114"
ISO_15037 = "ISO 15037-1:2019, measured variables and their errors"
LIMPERT = "Limpert (2011), Brake Design and Safety, SAE R-398"
MITSCHKE = "Mitschke and Wallentowitz (2014), Dynamik der Kraftfahrzeuge, doi:10.1007/978-3-658-05068-9"
PACEJKA = "Pacejka (2012), Tire and Vehicle Dynamics, doi:10.1016/C2010-0-68548-8"
PAPER = "paper, Table of frozen physical parameters"
DIXON = "Dixon (2007), The Shock Absorber Handbook, doi:10.1002/9780470516430"
HORNE = "Horne and Dreher (1963), NASA TN D-2056"
SHOOP = "Shoop et al. (2006), J. Terramechanics 43, doi:10.1016/j.jterra.2005.03.002"
ZEGELAAR = "Zegelaar (1998), The dynamic response of tyres to brake torque variations and road unevennesses"
RILL = "Hirschberg, Rill and Weinfurter (2007), Tire model TMeasy, doi:10.1080/00423110701776284"
DAHL = "Dahl (1968), A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1"
DECLARED = "declared, from the residuals of the multibody reference"


@dataclass(frozen=True)
class EffectParameter:
    """One number that a fit may move; 0 is the plain model, except for thresholds, which act with their effect only.

    Parameters
    ----------
    name : unique
    effect : name of the effect that the number belongs to, as tables print it
    unit : unit, as catalogue files write it
    port : port where it enters the equations of motion
    kind : added is a number of its own in the equations, scaled is a relative change of fields of the vehicle, shifted
        is added to them
    fields : of ``EffectValues``, or of the vehicle (``families.`` stands for all its tyre families,
        ``families.rain.`` for that of one kind of weather)
    bounds : lowest and highest value that a fit may take [unit]
    step : for finite differences [unit]
    source : reference for the equation
    start : value from which a fit starts, and at which the effect's other number is screened [unit]
    """

    name: str
    effect: str
    unit: str
    port: str
    kind: Kind
    fields: tuple[str, ...]
    bounds: tuple[float, float]
    step: float
    source: str
    start: float = 0.0

    @property
    def lower(self) -> float:
        """Return the lower bound [unit]."""
        return self.bounds[0]

    @property
    def upper(self) -> float:
        """Return the upper bound [unit]."""
        return self.bounds[1]

    @property
    def index(self) -> int:
        """Return the position in a parameter vector."""
        return PARAMETER_INDEX[self.name]

    @property
    def of_vehicle(self) -> bool:
        """Return whether a vehicle can carry the number; the road's grade and the errors of instruments it cannot."""
        return self.port not in ("road", "sensor")


def _add_number(
    name: str, effect: str, unit: str, port: str, bounds: tuple[float, float], step: float, source: str,
    start: float = 0.0,
) -> EffectParameter:  # fmt: skip
    """Return a row whose number stands in the equations itself."""
    return EffectParameter(name, effect, unit, port, "added", (name,), bounds, step, source, start)


def _change_field(
    name: str, kind: Kind, fields: tuple[str, ...], bounds: tuple[float, float], step: float
) -> EffectParameter:
    """Return a row that scales or shifts fields of the vehicle, without a unit."""
    return EffectParameter(name, name.replace("_", " "), "1", "parameter", kind, fields, bounds, step, PAPER)


def _add_sensor(name: str, unit: str, bounds: tuple[float, float], step: float) -> EffectParameter:
    """Return a row for an error of an instrument."""
    return _add_number(name, name.replace("_", " "), unit, "sensor", bounds, step, ISO_15037)


EFFECT_TABLE = (
    # numbers of the vehicle that may be off
    _change_field("pressure_gain", "scaled", ("brake_gain",), (-0.95, 8.0), 0.01),
    _change_field("mass", "scaled", ("sprung_mass", "pitch_inertia"), (-0.3, 0.3), 0.01),
    _add_number("pitch_gain", "brake-pitch gain", "1", "parameter", (-0.95, 1.0), 0.01, PAPER),
    _change_field("wheel_radius", "scaled", ("wheel_radius",), (-0.08, 0.08), 0.003),
    _change_field("damping", "scaled", ("suspension_damping_f", "suspension_damping_r"), (-0.6, 1.0), 0.02),
    _change_field("stiffness", "scaled", ("suspension_stiffness_f", "suspension_stiffness_r"), (-0.4, 0.6), 0.01),
    _change_field("friction", "scaled", ("families.efficiency",), (-0.5, 1.5), 0.01),
    _change_field("wet_friction", "scaled", ("families.rain.efficiency",), (-0.6, 0.6), 0.01),
    _change_field("snow_friction", "scaled", ("families.snow.efficiency",), (-0.6, 0.6), 0.01),
    _change_field("slip_stiffness", "scaled", ("families.slip_stiffness",), (-0.6, 1.5), 0.03),
    _change_field("front_bias", "shifted", ("front_brake_share",), (-0.2, 0.2), 0.01),
    EffectParameter(
        "wheel_inertia", "rotating inertia", "kg m2", "wheel", "shifted", ("wheel_inertia_f", "wheel_inertia_r"),
        (0.0, 20.0), 1.0, MITSCHKE,
    ),
    _add_number("slope", "grade", "1", "road", (-0.08, 0.08), 0.001, PAPER),
    # forces along the road
    _add_number("drag_area", "air drag", "m2", "longitudinal_force", (0.0, 10.0), 0.3, GILLESPIE),
    _add_number("wind_speed", "wind", "m s-1", "longitudinal_force", (-15.0, 15.0), 2.0, GILLESPIE),
    _add_number("rolling_coefficient", "rolling resistance", "1", "longitudinal_force", (0.0, 0.08), 0.004, GILLESPIE),
    _add_number("rolling_speed", "rolling resistance by speed", "s m-1", "longitudinal_force", (0.0, 0.003), 0.0002,
                GILLESPIE),
    _add_number("ploughing", "snow ploughing", "N mm-1", "longitudinal_force", (0.0, 100.0), 5.0, SHOOP),
    # torques on the wheels
    _add_number("engine_torque", "engine braking", "N m", "brake_torque", (0.0, 6000.0), 20.0, MITSCHKE),
    _add_number("engine_viscous", "engine braking", "N m s rad-1", "brake_torque", (0.0, 6.0), 0.4, MITSCHKE),
    _add_number("engine_power", "engine braking", "kW", "brake_torque", (0.0, 200.0), 3.0, MITSCHKE),
    _add_number("creep_force", "idle creep", "N", "brake_torque", (0.0, 2500.0), 100.0, MITSCHKE),
    _add_number("creep_speed", "idle creep", "m s-1", "brake_torque", (1.5, 12.0), 0.5, MITSCHKE, 4.0),
    _add_number("pad_drag", "pad drag", "N m", "brake_torque", (0.0, 250.0), 15.0, LIMPERT),
    _add_number("lag", "brake lag", "s", "brake_torque", (0.0, 0.5), 0.03, LIMPERT),
    _add_number("dead_time", "brake dead time", "s", "brake_torque", (0.0, 0.4), 0.02, LIMPERT),
    _add_number("push_out", "push-out pressure", "MPa", "brake_torque", (0.0, 5.0), 0.02, LIMPERT),
    _add_number("pressure_curve", "pressure curve", "MPa-1", "brake_torque", (-0.2, 0.25), 0.01, LIMPERT),
    _add_number("fade", "brake fade", "(100 K)-1", "brake_torque", (-0.1, 0.3), 0.01, LIMPERT),
    _add_number("pad_speed", "pad friction by speed", "s m-1", "brake_torque", (-0.03, 0.03), 0.001, LIMPERT),
    _add_number("pad_speed_reference", "pad friction by speed", "m s-1", "brake_torque", (0.0, 35.0), 2.0, LIMPERT,
                15.0),
    _add_number("bias_pressure", "bias by pressure", "MPa-1", "brake_torque", (-0.12, 0.12), 0.01, LIMPERT),
    _add_number("abs_cutoff", "ABS cut-off", "m s-1", "brake_torque", (0.0, 5.0), 0.2, DECLARED),
    _add_number("slope_moment", "slope moment", "1", "brake_torque", (0.0, 10.0), 0.1, ZEGELAAR),
    _add_number("radius_by_load", "tyre radius by load", "1", "brake_torque", (0.0, 3.0), 0.1, PACEJKA),
    # friction of the tyre
    _add_number("relaxation_length", "relaxation length", "m", "friction", (0.0, 2.0), 0.1, PACEJKA),
    _add_number("load_sensitivity", "load sensitivity", "1", "friction", (-0.2, 0.6), 0.03, PACEJKA),
    _add_number("tyre_heating", "tyre heating", "(100 kJ)-1", "friction", (-0.5, 3.0), 0.1, PACEJKA),
    _add_number("wet_speed", "wet friction by speed", "s m-1", "friction", (0.0, 0.04), 0.002, HORNE),
    _add_number("wet_threshold", "wet friction by speed", "m s-1", "friction", (0.0, 25.0), 2.0, HORNE),
    _add_number("friction_speed", "tyre friction by speed", "s m-1", "friction", (-0.02, 0.03), 0.001, PACEJKA),
    _add_number("tread_stiffness", "tread stiffness", "1", "friction", (0.0, 40.0), 0.5, RILL),
    _add_number("stick_ratio", "sticking tyre", "1", "friction", (0.0, 1.2), 0.05, DECLARED),
    _add_number("stick_loss", "sticking tyre", "1", "friction", (0.0, 0.2), 0.005, DECLARED),
    _add_number("stick_below", "sticking tyre", "m s-1", "friction", (0.0, 5.0), 0.2, DECLARED),
    _add_number("stick_above", "sticking tyre", "m s-1", "friction", (0.0, 10.0), 0.2, DECLARED),
    # forces between body, axles and road
    _add_number("damper_asymmetry", "damper asymmetry", "1", "suspension_force", (-0.8, 0.8), 0.05, DIXON),
    _add_number("coulomb_friction", "suspension friction", "N", "suspension_force", (0.0, 500.0), 20.0, MITSCHKE),
    _add_number("progressive_rate", "progressive spring", "N m-3", "suspension_force", (0.0, 2e7), 2e5, MITSCHKE),
    _add_number("stop_stiffness", "bump stop", "N m-1", "suspension_force", (0.0, 4e5), 1e4, MITSCHKE),
    _add_number("stop_clearance", "bump stop", "m", "suspension_force", (0.005, 0.1), 0.005, MITSCHKE, 0.03),
    _add_number("anti_dive", "anti-dive and anti-lift", "1", "suspension_force", (-0.5, 1.0), 0.05, GILLESPIE),
    _add_number("anti_lift", "anti-dive and anti-lift", "1", "suspension_force", (-0.5, 1.0), 0.05, GILLESPIE),
    _add_number("stick_anti_dive", "sticking tyre", "1", "suspension_force", (-2.0, 2.0), 0.05, DECLARED),
    _add_number("stick_anti_lift", "sticking tyre", "1", "suspension_force", (-2.0, 2.0), 0.05, DECLARED),
    _add_number("scrub_stiffness", "scrub", "1", "suspension_force", (-1.0, 1.0), 0.02, DECLARED),
    _add_number("track_change", "lateral sticking", "1", "suspension_force", (-0.5, 0.5), 0.02, MITSCHKE),
    _add_number("track_change_by_travel", "lateral sticking", "m-1", "suspension_force", (-5.0, 5.0), 0.2, MITSCHKE),
    _add_number("bump_steer", "lateral sticking", "m-1", "suspension_force", (-0.5, 0.5), 0.02, MITSCHKE),
    _add_number("lateral_stiffness", "lateral sticking", "N m-1", "suspension_force", (0.0, 5e5), 1e4, DAHL),
    _add_number("aero_lift", "air's pitch moment and lift", "N s2 m-2", "suspension_force", (-3.0, 3.0), 0.2,
                GILLESPIE),
    _add_number("enveloping_length", "footprint", "m", "tyre_load", (0.0, 0.6), 0.02, ZEGELAAR),
    _add_number("contact_radius", "rolling contact", "m", "tyre_load", (0.0, 0.6), 0.02, ZEGELAAR),
    _add_number("force_tilt", "tyre force along the slope", "1", "tyre_load", (0.0, 2.0), 0.1, ZEGELAAR),
    _add_number("tyre_damping", "tyre damping", "N s m-1", "tyre_load", (0.0, 2000.0), 50.0, PACEJKA),
    _add_number("aero_pitch", "air's pitch moment and lift", "N s2 m-1", "pitch_moment", (-3.0, 3.0), 0.1, GILLESPIE),
    # errors of the instruments
    _add_sensor("wheel_speed_scale", "1", (-0.1, 0.1), 0.003),
    _add_sensor("speed_scale", "1", (-0.1, 0.1), 0.003),
    _add_sensor("acceleration_scale", "1", (-0.2, 0.2), 0.01),
    _add_sensor("pitch_scale", "1", (-0.3, 0.3), 0.01),
    _add_sensor("pitch_rate_scale", "1", (-0.3, 0.3), 0.01),
    _add_sensor("vertical_scale", "1", (-0.3, 0.3), 0.01),
    _add_sensor("gravity_leak", "1", (-1.5, 1.5), 0.1),
    _add_sensor("mount_tilt", "rad", (-0.15, 0.15), 0.01),
    _add_sensor("acceleration_delay", "s", (0.0, 0.3), 0.01),
    _add_sensor("acceleration_lag", "s", (0.0, 0.4), 0.01),
    _add_sensor("pitch_delay", "s", (0.0, 0.3), 0.01),
    _add_sensor("pitch_lag", "s", (0.0, 0.4), 0.01),
    _add_sensor("speed_delay", "s", (0.0, 0.3), 0.01),
    _add_sensor("speed_lag", "s", (0.0, 0.4), 0.01),
    _add_sensor("wheel_speed_delay", "s", (0.0, 0.3), 0.01),
)  # fmt: skip

PARAMETERS = {row.name: row for row in EFFECT_TABLE}
"""Rows by name."""
PARAMETER_INDEX = {row.name: i for i, row in enumerate(EFFECT_TABLE)}
"""Position of each parameter in a vector of all."""
EFFECT_UNITS = {row.name: row.unit for row in EFFECT_TABLE if row.of_vehicle and row.kind == "added"}
"""Unit of each number that a vehicle may hold under ``effects``."""
NUMBERS_OF_EFFECTS = {
    effect: tuple(name for name in EFFECT_UNITS if PARAMETERS[name].effect == effect)
    for effect in dict.fromkeys(PARAMETERS[name].effect for name in EFFECT_UNITS)
}
"""The numbers of each effect that a vehicle may hold, by the name that tables print."""

if TYPE_CHECKING:

    class EffectValues(tuple[float, ...]):
        """Numbers of a vehicle's effects by name, as the kernels take them; all 0 in the paper's model."""

        def __new__(cls, *values: float, **named: float) -> "EffectValues": ...
        def __getattr__(self, name: str) -> float: ...

else:
    EffectValues = namedtuple("EffectValues", EFFECT_UNITS, defaults=(0.0,) * len(EFFECT_UNITS))
    EffectValues.__doc__ = (
        "Numbers of a vehicle's effects by name, as the kernels take them; all 0 in the paper's model."
    )


def pack_effect_values(values: Mapping[str, float]) -> EffectValues:
    """Return the effects of a vehicle in the form that the kernels take; all others are 0.

    Parameters
    ----------
    values : numbers by name [units of `EFFECT_UNITS`]

    Raises
    ------
    InputError
        For names that no vehicle can hold.
    """
    unknown = [name for name in values if name not in EFFECT_UNITS]
    if unknown:
        known = ", ".join(EFFECT_UNITS)
        raise InputError(
            [f"effect {name}: a vehicle has no such number; there are: {known}" for name in unknown]
        )
    return EffectValues(**{name: float(value) for name, value in values.items()})


def build_parameter_vector(values: Mapping[str, float]) -> NDArray[np.float64]:
    """Return the vector of all parameters from named values; all others are 0.

    Parameters
    ----------
    values : numbers by parameter name [units of the table]

    Raises
    ------
    InputError
        For names that do not exist.
    """
    unknown = [name for name in values if name not in PARAMETER_INDEX]
    if unknown:
        known = ", ".join(PARAMETER_INDEX)
        raise InputError([f"effect parameter {name} does not exist; there are: {known}" for name in unknown])
    theta = np.zeros(len(EFFECT_TABLE))
    for name, value in values.items():
        theta[PARAMETER_INDEX[name]] = value
    return theta


def unpack_parameter_vector(theta: NDArray[np.float64]) -> dict[str, float]:
    """Return the parameters of a vector that are not 0, by name.

    Parameters
    ----------
    theta : float64 [len(EFFECT_TABLE)] vector of all parameters [units of the table]
    """
    return {EFFECT_TABLE[i].name: float(theta[i]) for i in np.flatnonzero(theta)}
