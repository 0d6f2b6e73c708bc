"""A number that a joint fit may move, and which of them a campaign can show."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.identification.inference.forward import RunModel

SATURATING = 0.95
"""Share of the tyres' peak friction from which a stop says something about friction."""
LEAST_PRESSURE = 1.0
"""Brake pressure that a campaign is taken to reach at least [MPa]."""
SMOOTHED = 0.3
"""Time over which a deceleration is averaged before its peak is taken [s]."""


@dataclass(frozen=True, kw_only=True)
class JointNumber:
    """A number of the table of effects with the prior of a car that is hardly known.

    Parameters
    ----------
    name : of the table of effects
    sigma : of the prior about the vehicle file's value [unit of the table]
    lower, upper : where the fit must stay [unit of the table]
    group : numbers of one group stand in for each other on few runs
    removable : must earn its place
    needs : channels of which one must be measured
    says : the finding in plain words, with {value} in it
    of_pressure : sigma is a share of the largest brake pressure of the training runs
    """

    name: str
    sigma: float
    lower: float
    upper: float
    group: str
    removable: bool
    needs: tuple[str, ...]
    says: str
    of_pressure: bool = False


def choose_numbers(
    numbers: Sequence[JointNumber], campaign: Campaign, models: Sequence[RunModel]
) -> tuple[JointNumber, ...]:
    """Return the numbers that the channels and manoeuvres of a campaign can show.

    Parameters
    ----------
    numbers : of the catalogue
    campaign : measured runs
    models : of its training runs
    """
    chosen = []
    for number in numbers:
        if not any(need in campaign.channels for need in number.needs):
            continue
        if number.name == "engine_torque" and any(run.drive_torque is not None for run in campaign.runs):
            continue  # an input, and no unknown
        if number.name == "friction" and not any(saturates(model) for model in models):
            continue
        if number.of_pressure:
            largest = max(float(model.run.pressure.max()) for model in models)
            number = replace(number, sigma=number.sigma * max(largest, LEAST_PRESSURE), of_pressure=False)
        chosen.append(number)
    return tuple(chosen)


def saturates(model: RunModel) -> bool:
    """Whether a run decelerates as hard as the tyres of the model nearly allow.

    Parameters
    ----------
    model : the run
    """
    return peak_deceleration(model) > SATURATING * model.surface_friction * model.vehicle.gravity


def peak_deceleration(model: RunModel) -> float:
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
