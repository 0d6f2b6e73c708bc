"""Effects that a fit may name; each holds one or two rows of the table."""

from dataclasses import dataclass
from typing import Literal

from tasks.vehicle.effects.table import EffectParameter

EffectClass = Literal["effect", "retune", "sensor"]


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A typed effect that can be added to the vehicle model.

    Parameters
    ----------
    name : unique in its library
    effect_class : effect, retune or sensor
    variable : variable that it depends on
    enters : its term in words and symbols
    parameters : one or two rows of the table; all 0 (or the first 0) is the plain model
    """

    name: str
    effect_class: EffectClass
    variable: str
    enters: str
    parameters: tuple[EffectParameter, ...]

    @property
    def port(self) -> str:
        """Return the port where the effect enters the equations of motion."""
        return self.parameters[0].port

    @property
    def source(self) -> str:
        """Return the reference for the effect's equation."""
        return self.parameters[0].source
