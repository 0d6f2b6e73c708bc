"""What an effect is: a name, where it enters, one or two bounded parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.vehicle.effects.ports import INDEX, PARAMETERS

EffectClass = Literal["effect", "retune", "sensor"]
SENSOR_PARAMETERS = (
    "wheel_speed_scale", "speed_scale", "acceleration_scale", "pitch_scale", "pitch_rate_scale", "vertical_scale",
    "gravity_leak", "mount_tilt", "acceleration_delay", "acceleration_lag", "pitch_delay", "pitch_lag",
    "speed_delay", "speed_lag", "wheel_speed_delay",
)  # fmt: skip
"""Parameters of the measuring chain: they follow those of the motion in a full parameter vector."""
ALL_PARAMETERS = (*PARAMETERS, *SENSOR_PARAMETERS)
PARAMETER_INDEX = {name: i for i, name in enumerate(ALL_PARAMETERS)}


@dataclass(frozen=True, kw_only=True)
class EffectParameter:
    """One number of an effect.

    Parameters
    ----------
    name : one of `ALL_PARAMETERS`
    unit : as printed
    lower, upper : bounds that a fit must hold [unit]
    step : finite-difference step [unit]
    start : value while the effect's first parameter is being screened [unit]
    """

    name: str
    unit: str
    lower: float
    upper: float
    step: float
    start: float

    @property
    def index(self) -> int:
        """Place in the full parameter vector."""
        return PARAMETER_INDEX[self.name]

    @property
    def in_motion(self) -> bool:
        """Whether it acts in the equations of motion and not only in the measuring chain."""
        return self.name in INDEX


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A typed effect that can be added to the vehicle model.

    Parameters
    ----------
    name : unique in its library
    effect_class : effect, retune or sensor
    port, variable : where it enters and what it depends on
    enters : the term in words and symbols
    source : reference
    parameters : one or two; all 0 (or the first 0) is the plain model
    """

    name: str
    effect_class: EffectClass
    port: str
    variable: str
    enters: str
    source: str
    parameters: tuple[EffectParameter, ...]


def parameter_vector(values: Mapping[str, float]) -> NDArray[np.float64]:
    """Full vector from named values; all others 0.

    Parameters
    ----------
    values : by parameter name, in the units of the catalogue

    Raises
    ------
    InputError
        For names that do not exist.
    """
    unknown = [name for name in values if name not in PARAMETER_INDEX]
    if unknown:
        known = ", ".join(ALL_PARAMETERS)
        raise InputError([f"effect parameter {name} does not exist; there are: {known}" for name in unknown])
    theta = np.zeros(len(ALL_PARAMETERS))
    for name, value in values.items():
        theta[PARAMETER_INDEX[name]] = value
    return theta
