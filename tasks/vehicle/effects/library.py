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

    def describe(
        self, values: Mapping[str, float], intervals: Mapping[str, tuple[float, float]] | None = None
    ) -> str:
        """Return the finding in plain words.

        Parameters
        ----------
        values : numbers of the effect by name; one that is not given has its first value [units of the table]
        intervals : of numbers by name, written beside them [units of the table]
        """
        numbers = {p.name: p.start for p in self.parameters} | dict(values)
        return self.says.format_map(
            {name: _Number(value, (intervals or {}).get(name)) for name, value in numbers.items()}
        )


def format_number(number: float) -> str:
    """Return a number as a sentence says it, with two digits or all those before the point: 0.056, 5.6, 56, 559.

    Parameters
    ----------
    number : in any unit
    """
    return f"{number:.2g}" if abs(number) < 99.5 else f"{number:.0f}"


def format_interval(number: float, interval: tuple[float, float] | None) -> str:
    """Return a number with its interval, if there is one: 0.079 [0.077, 0.081].

    Parameters
    ----------
    number : in any unit
    interval : its lower and upper end [the same unit]
    """
    ends = "" if interval is None else f" [{', '.join(format_number(end) for end in interval)}]"
    return f"{format_number(number)}{ends}"


class _Number(float):
    """A number in a sentence: alone, as ``percent``, as a ``share`` above or below another, or as a ``fall``."""

    interval: tuple[float, float] | None

    def __new__(cls, value: float, interval: tuple[float, float] | None = None) -> "_Number":
        text = super().__new__(cls, value)
        text.interval = interval
        return text

    def __format__(self, spec: str) -> str:
        if not spec:
            return format_interval(float(self), self.interval)
        # of what is below another the size is written, and its interval turns round
        scale = -100.0 if spec != "percent" and self < 0.0 else 100.0
        low, high = sorted(scale * end for end in self.interval or (0.0, 0.0))
        text = f"{format_number(scale * float(self))} %"
        if self.interval is not None:
            text += f" [{format_number(low)}, {format_number(high)}]"
        if spec == "share":
            return f"{text} {'above' if scale > 0.0 else 'below'}"
        return f"{'falls' if scale > 0.0 else 'grows'} by {text}" if spec == "fall" else text
