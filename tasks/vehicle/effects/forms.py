"""Forms outside the library of effects: a simple shape of one variable at one port."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.vehicle.effects.ports import PORTS, VARIABLE_UNITS, VARIABLES, format_unit
from tasks.vehicle.effects.slots import Slot

TABLE = 65
"""Points of a form's piecewise-linear table."""

Shape = Callable[[NDArray[np.float64]], NDArray[np.float64]]
SHAPES: dict[str, Shape] = {
    "a": lambda u: np.ones_like(u)[:, None],
    "a x": lambda u: u[:, None],
    "a x|x|": lambda u: (u * np.abs(u))[:, None],
    "a x^3": lambda u: (u**3)[:, None],
    "a tanh(4x)": lambda u: np.tanh(4.0 * u)[:, None],
    "a exp(-4|x|)": lambda u: np.exp(-4.0 * np.abs(u))[:, None],
    "a max(x - 1/3, 0)": lambda u: np.maximum(u - 1.0 / 3.0, 0.0)[:, None],
    "a max(x - 2/3, 0)": lambda u: np.maximum(u - 2.0 / 3.0, 0.0)[:, None],
    "a exp(-(4x - 1)^2)": lambda u: np.exp(-np.square(4.0 * u - 1.0))[:, None],
    "a exp(-(4x - 2)^2)": lambda u: np.exp(-np.square(4.0 * u - 2.0))[:, None],
    "a exp(-(4x - 3)^2)": lambda u: np.exp(-np.square(4.0 * u - 3.0))[:, None],
    "a + b x": lambda u: np.column_stack((np.ones_like(u), u)),
}
"""The grammar, in x = variable / scale; linear in its one or two coefficients."""


@dataclass(frozen=True, kw_only=True)
class Form:
    """A shape of one variable at one port, held constant beyond the range in which it was seen.

    Parameters
    ----------
    port, variable : one of `PORTS` and `VARIABLES`
    shape : one of `SHAPES`
    coefficients : a, or a and b [unit of the port]
    scale : magnitude of the variable at which x is 1 [unit of the variable]
    low, high : range of the variable in which the form was seen [unit of the variable]
    """

    port: str
    variable: str
    shape: str
    coefficients: tuple[float, ...]
    scale: float
    low: float
    high: float

    @property
    def name(self) -> str:
        """Return the form's name: its port, its shape and the definition of x."""
        return name_form(self.port, self.variable, self.shape, self.scale)

    @property
    def slot(self) -> Slot:
        """Return the form as a piecewise-linear table."""
        grid = np.linspace(self.low, self.high, TABLE)
        return Slot(
            port=self.port,
            variable=self.variable,
            origin=self.low,
            spacing=float(grid[1] - grid[0]),
            values=SHAPES[self.shape](grid / self.scale) @ np.array(self.coefficients),
        )


def count_coefficients(shape: str) -> int:
    """Return the number of coefficients of a shape.

    Parameters
    ----------
    shape : one of `SHAPES`
    """
    return SHAPES[shape](np.zeros(1)).shape[1]


def name_form(port: str, variable: str, shape: str, scale: float) -> str:
    """Return the name of a form: its port, its shape and the definition of x.

    Parameters
    ----------
    port, variable : one of `PORTS` and `VARIABLES`
    shape : one of `SHAPES`
    scale : magnitude of the variable at which x is 1 [unit of the variable]
    """
    return f"{port} ~ {shape}, x = {variable}/{scale:g} {format_unit(VARIABLE_UNITS[variable])}"


def read_form_name(name: str) -> tuple[str, str, str, float]:
    """Return port, variable, shape and scale of a form from the name that `name_form` gave it.

    Parameters
    ----------
    name : of the form

    Raises
    ------
    InputError
        If no form of the grammar has that name.
    """
    found = re.fullmatch(
        r"(?P<port>\w+) ~ (?P<shape>.+), x = (?P<variable>\w+)/(?P<scale>[\d.e+-]+) (?P<unit>.+)", name
    )
    if found and found["port"] in PORTS and found["shape"] in SHAPES and found["variable"] in VARIABLES:
        port, shape, variable, scale = found["port"], found["shape"], found["variable"], float(found["scale"])
        if name_form(port, variable, shape, scale) == name:
            return port, variable, shape, scale
    raise InputError(f"form {name}: no port, variable and shape of the grammar have that name")
