"""Hypotheses: bounded parameters that may be added to the model, and the way in which they enter it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.evidence import SESSION_INDEX
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import EFFECT_TABLE

Build = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], tuple[Slot, ...]]]


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """An effect or form that may be added to the model.

    Parameters
    ----------
    name : name of the effect or form
    effect_class : effect, retune, sensor or form
    port, variable : port where it enters, and variable that it depends on
    names, units : names and units of the K parameters
    lower, upper, step, start : float64 [K] bounds, finite-difference step and first value [unit]
    build : function from parameters to the full vector theta and slots
    """

    name: str
    effect_class: str
    port: str
    variable: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    step: NDArray[np.float64]
    start: NDArray[np.float64]
    build: Build


def moves_speed(effect_class: str, variable: str) -> bool:
    """Return whether a name moves the measured speed: every one does but the error of another instrument.

    Parameters
    ----------
    effect_class, variable : of an effect, a number or a form
    """
    return effect_class != "sensor" or variable == "speed"


def make_library_hypothesis(effect: Effect, start: float | None = None, second: float = np.nan) -> Hypothesis:
    """Return a library effect as a hypothesis.

    Parameters
    ----------
    effect : effect of the library
    start : first value of its first parameter; None for one step [unit of the parameter]
    second : first value of its second parameter; NaN for the table's [unit of the parameter]
    """
    indices = [p.index for p in effect.parameters]

    def build_theta(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
        theta = np.zeros(len(EFFECT_TABLE))
        theta[indices] = values
        return theta, ()

    first = effect.parameters[0]
    begin = np.array([p.start for p in effect.parameters])
    begin[0] = min(max(first.step if start is None else start, first.lower), first.upper)
    if np.isfinite(second):
        begin[1] = second
    return Hypothesis(
        name=effect.name,
        effect_class=effect.effect_class,
        port=effect.port,
        variable=effect.variable,
        names=tuple(p.name for p in effect.parameters),
        units=tuple(p.unit for p in effect.parameters),
        lower=np.array([p.lower for p in effect.parameters]),
        upper=np.array([p.upper for p in effect.parameters]),
        step=np.array([p.step for p in effect.parameters]),
        start=begin,
        build=build_theta,
    )


def compose_parameters(
    parts: tuple[Hypothesis, ...], values: NDArray[np.float64], session: NDArray[np.float64]
) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
    """Return the full vector theta and the slots of all parts, with the session's nuisances added.

    Parameters
    ----------
    parts : hypotheses, in the order of the parameters
    values : float64 [K] their parameters [their units]
    session : float64 [8] session nuisances
    """
    theta = np.zeros(len(EFFECT_TABLE))
    theta[list(SESSION_INDEX)] += session
    slots: tuple[Slot, ...] = ()
    at = 0
    for part in parts:
        added, more = part.build(values[at : at + len(part.names)])
        theta += added
        slots += more
        at += len(part.names)
    return theta, slots
