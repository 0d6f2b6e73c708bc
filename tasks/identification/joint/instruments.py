"""Instruments that read one motion, compared with each other: what they say of themselves without any car's model.

A joint fit may put on an instrument what the car lacks: a late speed and an accelerometer that reads too much make good
a motor whose drag fades. Speed is the integral of acceleration, whatever drives the car.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.campaign.speed_by_acceleration import (
    SpeedByAcceleration,
    pair_samples,
    relate_speed_to_acceleration,
)
from tasks.identification.inference.driver import SPEED
from tasks.identification.inference.forward import RunModel
from tasks.identification.joint.elimination import eliminate_without
from tasks.identification.joint.fit import JointFit
from tasks.identification.joint.stops import Stop, predict_stop
from tasks.identification.joint.substitutes import Substitute
from tasks.identification.rules import JointRules

ACCELERATION = CHANNELS.index("longitudinal_acceleration")
LARGEST_SHARE_LEFT = 0.5
"""Share of the disagreement of measured and predicted relation that an instrument's error may leave [1]."""


def relate_instruments(
    models: Sequence[RunModel], readings: Sequence[NDArray[np.float64]]
) -> SpeedByAcceleration | None:
    """Return scale and delay of speed and accelerometer; None where too little moves, or one was not measured.

    Parameters
    ----------
    models : the runs
    readings : of the two, measured or predicted, float64 [N, 7] each
    """
    runs = []
    for model, y in zip(models, readings, strict=True):
        known, at = model.find_samples(ACCELERATION), model.find_samples(SPEED)
        if len(known) > 1:
            felt = np.interp(np.arange(len(y)), known, y[known, ACCELERATION])
            at = at[(at >= known[0]) & (at <= known[-1])]
            runs.append(pair_samples(y[:, SPEED], felt, model.run.interval, at))
    return relate_speed_to_acceleration(runs)


def make_instrument_check(stops: Sequence[Stop]) -> Callable[[JointFit, str], bool]:
    """Return the question whether speed and accelerometer contradict a number of a fit.

    They do where more than `LARGEST_SHARE_LEFT` of what they disagree by stays with it, or comes from beyond.

    Parameters
    ----------
    stops : the runs of the fits
    """
    models = [stop.model for stop in stops]
    measured = relate_instruments(models, [model.measured for model in models])

    def predict(fitted: JointFit, numbers: Mapping[str, float]) -> SpeedByAcceleration | None:
        readings = [predict_stop(stop, numbers, own) for stop, own in zip(stops, fitted.offsets, strict=True)]
        return relate_instruments(models, readings)

    def contradicts(fitted: JointFit, name: str) -> bool:
        if measured is None or name not in ("acceleration_scale", "speed_delay"):
            return False
        told, plain = predict(fitted, fitted.by_name), predict(fitted, fitted.by_name | {name: 0.0})
        if told is None or plain is None:
            return False
        if name == "speed_delay":
            return abs(told.delay - measured.delay) > LARGEST_SHARE_LEFT * abs(plain.delay - measured.delay)
        return abs(told.scale - measured.scale) > LARGEST_SHARE_LEFT * abs(plain.scale - measured.scale)

    return contradicts


def drop_contradicted_instruments(
    stops: Sequence[Stop], fitted: JointFit, rules: JointRules, reasons: list[str]
) -> JointFit:
    """Return the fit without errors of instruments that the instruments themselves contradict, and say so.

    Parameters
    ----------
    stops : training runs
    fitted : after elimination
    rules : of the joint fit
    reasons : is added to
    """
    contradicts = make_instrument_check(stops)
    wrong = [n for n in fitted.removable_numbers if contradicts(fitted, n.name)]
    if not wrong:
        return fitted
    reasons += [
        f"the fit suggests that {number.say(fitted.by_name[number.name])}, but that makes good less than half of"
        " what speed and accelerometer disagree by: not named"
        for number in wrong
    ]
    left = eliminate_without(stops, fitted, wrong, rules)
    return drop_contradicted_instruments(stops, left, rules, reasons)


def drop_contradicted_readings(stops: Sequence[Stop], rivals: Sequence[Substitute]) -> list[Substitute]:
    """Return the rivals without errors of instruments that the instruments themselves contradict.

    Parameters
    ----------
    stops : training runs
    rivals : what explains them nearly as well as a named number
    """
    contradicts = make_instrument_check(stops)
    return [rival for rival in rivals if not contradicts(rival.fitted, rival.name)]
