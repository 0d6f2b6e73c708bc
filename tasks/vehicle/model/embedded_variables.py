"""Inputs and outputs of the model where another program drives it step by step."""

from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Literal

from tasks.conventions import CHANNELS_BY_NAME
from tasks.surface.weather import list_by_code
from tasks.vehicle.model.simulation import COLUMNS


@dataclass(frozen=True)
class EmbeddedVariable:
    """A number that goes in or out.

    Parameters
    ----------
    name : unique
    unit : as `tasks.conventions` writes it
    description : sentence for the reader, with the sign
    start : value where none is given
    minimum, maximum : values that are taken
    role : a parameter is given once, before the start; an input may change from step to step
    kind : a choice is the code of a kind of weather
    """

    name: str
    unit: str
    description: str
    start: float = 0.0
    minimum: float = -inf
    maximum: float = inf
    role: Literal["parameter", "input", "output"] = "output"
    kind: Literal["real", "boolean", "choice"] = "real"


_define_parameter, _define_input = (partial(EmbeddedVariable, role=role) for role in ("parameter", "input"))

INPUTS = (
    _define_parameter("initial_speed", "m s-1", "speed at the start; the wheels roll and the body is at rest", 20.0, 0.1, 100.0),
    _define_parameter("initial_disc_rise", "K", "temperature of the discs above ambient at the start", 0.0, 0.0, 1000.0),
    _define_parameter("road_feature_center", "m", "route position of the middle of a hump or depression"),
    _define_parameter("road_feature_length", "m", "length of the hump or depression", 3.6, 0.1),
    _define_parameter("road_feature_height", "m", "height of the hump; negative is a depression, 0 none", 0.0, -1.0, 1.0),
    _define_parameter("wet_friction_by_speed", "1", "wet friction depends on film and speed; else road_friction holds at every speed", 0.0, 0.0, 1.0, kind="boolean"),
    _define_input("brake_pressure", "MPa", "pressure that the driver gives", 0.0, 0.0, 50.0),
    _define_input("engine_torque", "N m", "torque of the engine at the wheels, driving positive, divided between the axles as the brake torque is"),
    _define_input("hold_speed", "1", "keeps the speed, as a driver does who does not brake yet", 0.0, 0.0, 1.0, kind="boolean"),
    _define_input("weather", "1", "what lies on the road; it chooses the tyre's family", 1.0, 1.0, float(len(list_by_code())), kind="choice"),
    _define_input("road_friction", "1", "reference friction of the surface, the surface_friction of a dataset", 0.8, 0.01, 2.0),
    _define_input("snow_depth", "mm", "depth of the snow, which some vehicles plough", 0.0, 0.0, 1000.0),
    _define_input("film_depth", "mm", "depth of the water from the bottom of the texture, the film_depth_mm of a dataset", 0.0, 0.0, 100.0),
    _define_input("ground_height_f", "m", "road height under the front axle when the step begins, added to the road feature's"),
    _define_input("ground_slope_f", "1", "road slope under the front axle, along which the road goes on within the step"),
    _define_input("ground_height_r", "m", "road height under the rear axle when the step begins, added to the road feature's"),
    _define_input("ground_slope_r", "1", "road slope under the rear axle, along which the road goes on within the step"),
)  # fmt: skip
"""Inputs, in the order of the block."""

_BESIDE_TELEMETRY = {
    row.name: row
    for row in (
        EmbeddedVariable("heave_acceleration", "m s-2", "vertical acceleration of the body, up positive"),
        EmbeddedVariable("disc_rise_f", "K", "temperature of the front discs above ambient"),
        EmbeddedVariable("disc_rise_r", "K", "temperature of the rear discs above ambient"),
        EmbeddedVariable("suspension_travel_f", "m", "travel of the front struts, rebound positive"),
        EmbeddedVariable("suspension_travel_r", "m", "travel of the rear struts, rebound positive"),
        EmbeddedVariable("suspension_rate_f", "m s-1", "rate of the front struts' travel"),
        EmbeddedVariable("suspension_rate_r", "m s-1", "rate of the rear struts' travel"),
        EmbeddedVariable("acting_pressure", "MPa", "pressure at the pads, behind dead time and lag"),
    )
}


def _find_output(name: str) -> EmbeddedVariable:
    if name in _BESIDE_TELEMETRY:
        return _BESIDE_TELEMETRY[name]
    channel = CHANNELS_BY_NAME[name]
    return EmbeddedVariable(name, channel.unit, channel.description)


OUTPUTS = tuple(_find_output(name) for name in COLUMNS)
"""Outputs: the columns of a simulation, those of a dataset's telemetry by their names there."""
PLACE = {row.name: i for i, row in enumerate((*INPUTS, *OUTPUTS))}
"""Place of each variable in the block."""
