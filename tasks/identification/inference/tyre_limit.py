"""Whether a run comes to the limit of its tyres, without which it says nothing of them."""

import numpy as np

from tasks.campaign.campaign import CHANNELS
from tasks.identification.inference.forward import RunModel, simulate_run
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import compute_surface_response

SMOOTHED = 0.3
"""Time over which a deceleration is averaged before its peak is taken [s]."""


def reaches_limit(model: RunModel, gain: float, rules: DecisionRules) -> bool:
    """Whether the front wheels of the vehicle file come to the limit of their tyres for some time in a run.

    Parameters
    ----------
    model : the run
    gain : of the brakes beside the file's [1]
    rules : that time
    """
    scale = simulate_run(model, build_parameter_vector({"pressure_gain": gain})).column("abs_scale_f")
    return bool(np.sum(scale < 1.0) * model.run.interval > rules.limited_time)


def saturates_tyres(model: RunModel, rules: DecisionRules) -> bool:
    """Whether a run decelerates harder than the tyres of the model allow.

    Parameters
    ----------
    model : the run
    rules : by how much
    """
    tyre = compute_surface_response(model.vehicle, model.run.weather, model.surface_friction).tyre
    return measure_peak_deceleration(model) > rules.saturation_ratio * tyre.peak * model.vehicle.gravity


def measure_peak_deceleration(model: RunModel) -> float:
    """Return the largest measured decrease of speed over a short time [m/s2].

    Parameters
    ----------
    model : the run
    """
    speed = model.measured[:, CHANNELS.index("speed")]
    lag = max(round(SMOOTHED / model.run.interval), 1)
    if len(speed) <= lag:
        return 0.0
    return float(np.max(speed[:-lag] - speed[lag:])) / (lag * model.run.interval)
