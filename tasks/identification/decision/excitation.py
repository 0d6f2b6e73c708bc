"""Range of each form variable that the runs of a campaign reach."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.forward import RunModel, simulate_run
from tasks.vehicle.effects.slots import Slot


def find_reached_range(
    models: Iterable[RunModel], theta: NDArray[np.float64], slots: tuple[Slot, ...], variable: str
) -> tuple[float, float]:
    """Return the lowest and highest value of a variable over runs in the grown model [unit of the variable].

    Parameters
    ----------
    models : the runs
    theta : float64 [len(EFFECT_TABLE)] effects that were found
    slots : forms that were found
    variable : one of `VARIABLES`
    """
    values = [_simulate_variable(model, theta, slots, variable) for model in models]
    return float(min(v.min() for v in values)), float(max(v.max() for v in values))


def _simulate_variable(
    model: RunModel, theta: NDArray[np.float64], slots: tuple[Slot, ...], variable: str
) -> NDArray[np.float64]:
    """Return the simulated values of a variable in one run, float64 [N] [unit of the variable]."""
    if variable == "time":
        return np.arange(model.samples, dtype=np.float64) * model.run.interval
    column = simulate_run(model, theta, slots=slots).column
    if variable == "speed":
        return column("speed")
    if variable == "deceleration":
        return -column("longitudinal_acceleration")
    if variable == "pressure":
        return column("acting_pressure")
    if variable == "pressure_rate":
        return np.asarray(np.gradient(column("acting_pressure"), model.run.interval), dtype=np.float64)
    if variable == "load_ratio":
        rest_f, rest_r = model.vehicle.static_axle_loads
        return np.concatenate((column("tyre_load_f") / rest_f, column("tyre_load_r") / rest_r))
    name = {"disc_temperature": "disc_rise", "suspension_speed": "suspension_rate"}.get(variable, variable)
    return np.concatenate([column(f"{name}_{axle}") for axle in "fr"])
