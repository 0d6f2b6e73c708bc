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
    says : the finding in plain words, with its numbers in braces: {lag}, {anti_dive:percent}, {mass:share}, {fade:fall}
    parameters : one or two rows of the table; all 0 (or the first 0) is the plain model
    matters : smallest size of its first number that matters to an engineer [unit of the table]
    """

    name: str
    effect_class: EffectClass
    variable: str
    enters: str
    says: str
    parameters: tuple[EffectParameter, ...]
    matters: float

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


def say_number(number: float) -> str:
    """Return a number as a sentence says it, with two digits or all those before the point: 0.056, 5.6, 56, 559.

    Parameters
    ----------
    number : in any unit
    """
    return f"{number:.2g}" if abs(number) < 99.5 else f"{number:.0f}"


class _Said(float):
    """A number in a sentence: alone, as ``percent``, as a ``share`` above or below another, or as a ``fall``."""

    def __format__(self, spec: str) -> str:
        percent = 100.0 * float(self)
        if spec == "percent":
            return f"{say_number(percent)} %"
        if spec == "share":
            return f"{say_number(abs(percent))} % {'above' if percent >= 0.0 else 'below'}"
        if spec == "fall":
            return f"{'falls' if percent >= 0.0 else 'grows'} by {say_number(abs(percent))} %"
        return say_number(float(self))
