"""Effects that a fit may name; each holds one or two rows of the table."""

from collections.abc import Mapping
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
    says : the finding in plain words, with its numbers in braces: {lag}, {fade:percent}, {mass:share}
    parameters : one or two rows of the table; all 0 (or the first 0) is the plain model
    """

    name: str
    effect_class: EffectClass
    variable: str
    enters: str
    says: str
    parameters: tuple[EffectParameter, ...]

    @property
    def port(self) -> str:
        """Return the port where the effect enters the equations of motion."""
        return self.parameters[0].port

    @property
    def source(self) -> str:
        """Return the reference for the effect's equation."""
        return self.parameters[0].source

    def say(self, values: Mapping[str, float]) -> str:
        """Return the finding in plain words.

        Parameters
        ----------
        values : numbers of the effect by name; one that is not given has its first value [units of the table]
        """
        numbers = {p.name: p.start for p in self.parameters} | dict(values)
        return self.says.format_map({name: _Said(value) for name, value in numbers.items()})


class _Said(float):
    """A number as a sentence says it: with two digits, as ``percent``, or as a ``share`` above or below another."""

    def __format__(self, spec: str) -> str:
        if spec == "percent":
            return f"{float(100.0 * self):.2g} %"
        if spec == "share":
            return f"{float(abs(100.0 * self)):.2g} % {'above' if self >= 0.0 else 'below'}"
        return f"{float(self):.2g}" if abs(self) < 100.0 else f"{float(self):.0f}"
