"""Known truths that close-loop is tried on: library effects at sizes that matter, and forms outside any library."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from catalogs.effects import load_effects
from tasks.errors import InputError
from tasks.vehicle.effects.ports import PORTS, VARIABLES
from tasks.vehicle.effects.slots import Slot

TRUTHS_FILE = Path(__file__).with_name("truths.yaml")


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What a synthetic car has.

    Parameters
    ----------
    name : of the library effect, or of a form outside it
    values : effect parameters by name, in the units of the library
    slots : forms at ports
    left_out : library effects that the tool may not use on it
    """

    name: str
    values: dict[str, float]
    slots: tuple[Slot, ...]
    left_out: tuple[str, ...]

    @property
    def in_library(self) -> bool:
        """Whether the tool can name it."""
        return not self.slots

    @property
    def form(self) -> tuple[str, str] | None:
        """Port and variable of a form outside the library."""
        return (self.slots[0].port, self.slots[0].variable) if self.slots else None


def load_truths(path: str | Path = TRUTHS_FILE) -> tuple[Truth, ...]:
    """Truths of a file, in its order.

    Parameters
    ----------
    path : YAML with ``library`` (effect to parameters) and ``outside`` (name to port, variable and table)

    Raises
    ------
    InputError
        With every rule the file breaks.
    """
    content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    effects = {effect.name: {p.name for p in effect.parameters} for effect in load_effects()}
    problems = []
    for name, values in content["library"].items():
        if name not in effects:
            problems.append(f"truth {name}: the library has no such effect; there are: {', '.join(effects)}")
        elif not set(values) <= effects[name]:
            problems.append(
                f"truth {name}: parameters must be of {', '.join(sorted(effects[name]))}; it has {', '.join(values)}"
            )
    for name, values in content["sizes"].items():
        if name not in effects or len(values) != 1 or not set(values) <= effects[name]:
            problems.append(
                f"size {name}: needs an effect of the library and one of its parameters; it has {', '.join(values)}"
            )
    for name, form in content["outside"].items():
        if form["port"] not in PORTS or form["variable"] not in VARIABLES:
            problems.append(
                f"truth {name}: port must be of {', '.join(PORTS)} and variable of {', '.join(VARIABLES)}; they are"
                f" {form['port']} and {form['variable']}"
            )
    if problems:
        raise InputError(problems)
    library = [
        Truth(name=name, values={k: float(v) for k, v in values.items()}, slots=(), left_out=())
        for name, values in content["library"].items()
    ]
    outside = [
        Truth(name=name, values={}, slots=(_slot(form),), left_out=tuple(form.get("left_out", ())))
        for name, form in content["outside"].items()
    ]
    return (*library, *outside)


def load_sizes(path: str | Path = TRUTHS_FILE) -> tuple[Truth, ...]:
    """Truths of one effect at several sizes each, for power against size.

    Parameters
    ----------
    path : YAML with ``sizes`` (effect to parameter to its values)
    """
    content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    return tuple(
        Truth(name=name, values={parameter: float(value)}, slots=(), left_out=())
        for name, parameters in content["sizes"].items()
        for parameter, values in parameters.items()
        for value in values
    )


def _slot(form: dict[str, Any]) -> Slot:
    grid = np.array(form["at"], dtype=np.float64)
    return Slot(
        port=form["port"],
        variable=form["variable"],
        origin=float(grid[0]),
        spacing=float(grid[1] - grid[0]),
        values=np.array(form["value"], dtype=np.float64),
    )
