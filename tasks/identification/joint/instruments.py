"""Instruments that read one motion, compared with each other: what they say of themselves without any car's model.

A joint fit may put on an instrument what the car lacks: a late speed and an accelerometer that reads too much make good
a motor whose drag fades. Speed is the integral of acceleration, whatever drives the car.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.inference.driver import SPEED
from tasks.identification.inference.forward import RunModel
from tasks.identification.joint.elimination import Substitute, eliminate_uncertain_numbers, refit_numbers
from tasks.identification.joint.fit import JointFit
from tasks.identification.joint.stops import Stop, predict_stop
from tasks.identification.rules import JointRules

ACCELERATION = CHANNELS.index("longitudinal_acceleration")
TOLD_BY_BOTH = {"acceleration_scale": 0, "speed_delay": 1}
"""Numbers of instruments that speed and accelerometer tell without a car, by place in `compare_speed_with_acceleration`."""
FEWEST_SAMPLES = 5
"""Samples of the speed that a run needs beside its own two numbers [1]."""


def compare_speed_with_acceleration(
    models: Sequence[RunModel], readings: Sequence[NDArray[np.float64]]
) -> NDArray[np.float64] | None:
    """Return how much the accelerometer reads over the rate of speed [1], and how late the speed is [s], float64 [2].

    The speed is the integral of what the accelerometer reads over its scale, a moment later, with a start and a bias of
    each run's own. Gravity along a dive that follows the deceleration counts as scale. None where too little moves.

    Parameters
    ----------
    models : runs in which both were measured
    readings : of the two, measured or predicted, float64 [N, 7] each
    """
    rows, speeds = [], []
    for model, y in zip(models, readings, strict=True):
        known = model.find_samples(ACCELERATION)
        at = model.find_samples(SPEED)
        at = at[(at >= known[0]) & (at <= known[-1])] if len(known) > 1 else at[:0]
        if len(at) < FEWEST_SAMPLES:
            continue
        time = np.arange(model.samples) * model.run.interval
        felt = np.interp(time, time[known], y[known, ACCELERATION])
        gained = np.concatenate(([0.0], np.cumsum(0.5 * (felt[1:] + felt[:-1]) * model.run.interval)))
        own, _ = np.linalg.qr(np.column_stack((np.ones(len(at)), time[at])))
        both = np.column_stack((gained[at], felt[at], y[at, SPEED]))
        both -= own @ (own.T @ both)
        rows.append(both[:, :2])
        speeds.append(both[:, 2])
    if not rows:
        return None
    (share, late), _, rank, _ = np.linalg.lstsq(np.vstack(rows), np.concatenate(speeds), rcond=None)
    return np.array([1.0 / share, -late / share]) if rank == 2 and share > 0.0 else None


def make_instrument_check(stops: Sequence[Stop]) -> Callable[[JointFit, str], bool]:
    """Return whether the instruments themselves contradict what a fit says of one: they agree better without it.

    Parameters
    ----------
    stops : the runs of the fits
    """
    models = [stop.model for stop in stops]
    seen = all({SPEED, ACCELERATION} <= set(stop.channels.tolist()) for stop in stops)
    measured = compare_speed_with_acceleration(models, [m.measured for m in models]) if seen else None

    def predict(fitted: JointFit, numbers: Mapping[str, float]) -> NDArray[np.float64] | None:
        readings = [predict_stop(stop, numbers, own) for stop, own in zip(stops, fitted.offsets, strict=True)]
        return compare_speed_with_acceleration(models, readings)

    def contradicts(fitted: JointFit, name: str) -> bool:
        if measured is None or name not in TOLD_BY_BOTH:
            return False
        place = TOLD_BY_BOTH[name]
        told, plain = predict(fitted, fitted.by_name), predict(fitted, fitted.by_name | {name: 0.0})
        if told is None or plain is None:
            return False
        return bool(abs(told[place] - measured[place]) > abs(plain[place] - measured[place]))

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
        f"the fit suggests that {number.say(fitted.by_name[number.name])}, but speed and accelerometer agree better"
        " with each other without that: not named"
        for number in wrong
    ]
    left = refit_numbers(stops, fitted, tuple(n for n in fitted.numbers if n not in wrong))
    return drop_contradicted_instruments(
        stops, eliminate_uncertain_numbers(stops, left, rules), rules, reasons
    )


def drop_contradicted_readings(stops: Sequence[Stop], rivals: Sequence[Substitute]) -> list[Substitute]:
    """Return the rivals without errors of instruments that the instruments themselves contradict.

    Parameters
    ----------
    stops : training runs
    rivals : what explains them nearly as well as a named number
    """
    contradicts = make_instrument_check(stops)
    return [rival for rival in rivals if not contradicts(rival.fitted, rival.name)]
