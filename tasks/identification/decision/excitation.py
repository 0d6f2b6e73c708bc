"""Range of each form variable that the runs of a campaign reach."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.forward import RunModel, simulate_run
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.model.simulation import Simulation


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
    values = [read_variable(model, simulate_run(model, theta, slots=slots), variable) for model in models]
    return float(min(v.min() for v in values)), float(max(v.max() for v in values))


def read_variable(model: RunModel, simulated: Simulation, variable: str) -> NDArray[np.float64]:
    """Return the values of a variable in one run, of both axles if it is an axle's own, float64 [N] or [2, N].

    Parameters
    ----------
    model : the run
    simulated : its simulation
    variable : one of `VARIABLES` [its unit]
    """
    column = simulated.column
    if variable == "time":
        return np.arange(model.samples, dtype=np.float64) * model.run.interval
    if variable == "speed":
        return column("speed")
    if variable == "deceleration":
        return -column("longitudinal_acceleration")
    if variable == "pressure":
        return column("acting_pressure")
    if variable == "pressure_rate":
        pressure = column("acting_pressure")
        return np.diff(pressure, append=pressure[-1]) / model.run.interval
    if variable == "load_ratio":
        rest_f, rest_r = model.vehicle.static_axle_loads
        return np.stack((column("tyre_load_f") / rest_f, column("tyre_load_r") / rest_r))
    name = {"disc_temperature": "disc_rise", "suspension_speed": "suspension_rate"}.get(variable, variable)
    return np.stack([column(f"{name}_{axle}") for axle in "fr"])
