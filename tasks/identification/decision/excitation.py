"""What the runs of a campaign reach: the range of each variable that a form can depend on."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.forward import RunModel, roll
from tasks.identification.inference.rollout import CONSTANTS
from tasks.surface.road_profile import RoadHazard, road_elevation
from tasks.vehicle.effects.slots import Slot


def reached(
    models: Iterable[RunModel], theta: NDArray[np.float64], slots: tuple[Slot, ...], variable: str
) -> tuple[float, float]:
    """Lowest and highest value of a variable over runs, by the model with what was found [unit of the variable].

    Parameters
    ----------
    models : the runs
    theta : float64 [len(ALL_PARAMETERS)] effects found
    slots : forms found
    variable : one of `VARIABLES`
    """
    values = [_history(model, theta, slots, variable) for model in models]
    return float(min(v.min() for v in values)), float(max(v.max() for v in values))


def _history(
    model: RunModel, theta: NDArray[np.float64], slots: tuple[Slot, ...], variable: str
) -> NDArray[np.float64]:
    c = dict(zip(CONSTANTS, model.constants, strict=True))
    x = roll(model, theta, slots=slots)[1]
    speed, station, pressure, deceleration = x[:, 0], x[:, 1], x[:, 12], -x[:, 19]
    if variable == "time":
        return np.arange(model.samples, dtype=np.float64) * model.run.interval
    if variable in ("speed", "pressure", "deceleration"):
        return {"speed": speed, "pressure": pressure, "deceleration": deceleration}[variable]
    if variable == "pressure_rate":
        return np.asarray(np.gradient(pressure, model.run.interval), dtype=np.float64)
    if variable == "disc_temperature":
        return x[:, 13:15].ravel()
    if variable == "load_ratio":
        weight, base = c["sprung_mass"] * c["gravity"], c["l_f"] + c["l_r"]
        rest_f = weight * c["l_r"] / base + c["unsprung_mass_f"] * c["gravity"]
        rest_r = weight * c["l_f"] / base + c["unsprung_mass_r"] * c["gravity"]
        hazard = RoadHazard(
            center_m=c["hazard_center"], length_m=c["hazard_length"], height_m=c["hazard_height"]
        )
        road_f, road_r = road_elevation(station, hazard), road_elevation(station - base, hazard)
        front = 1.0 + c["tyre_stiffness_f"] * (road_f - x[:, 6]) / rest_f
        rear = 1.0 + c["tyre_stiffness_r"] * (road_r - x[:, 7]) / rest_r
        return np.maximum(np.concatenate((front, rear)), 0.0)
    # travel follows from heights, its speed from their rates, which lie four columns on
    z, pitch, wheel_f, wheel_r = x[:, 4:8].T if variable == "suspension_travel" else x[:, 8:12].T
    return np.concatenate((z - wheel_f - c["l_f"] * pitch, z - wheel_r + c["l_r"] * pitch))
