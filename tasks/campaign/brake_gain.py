"""Validation of the brake pressure's unit: the deceleration that it gives, pooled over all runs of a campaign.

One run alone does not tell it: in a gentle stop an engine, or a motor that blends its braking with the brake's, gives
most of the deceleration, and at the limit of friction the pressure gives no more.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING, WITHOUT_BRAKE
from tasks.campaign.channel_validation import smooth_channel
from tasks.campaign.run_names import list_names

DECELERATION_PER_PRESSURE = (0.3, 8.0)
"""Deceleration that a road car's brake may give per pressure; the paper's vehicle has 2.4 [m/s^2 per MPa]."""
LEAST_DECELERATION = 1.0
"""Deceleration above which a sample counts as braking [m/s^2]."""
LEAST_SHARE = 0.1
"""Share of a run's largest pressure above which a sample counts as braking [1]."""
FEWEST_SAMPLES = 20
"""Samples of braking that a run needs to tell the gain [1]."""
LEAST_VARIATION = 0.15
"""Standard deviation of the pressure over its mean from which a slope is told from an intercept [1]."""


@dataclass(frozen=True, kw_only=True)
class Braking:
    """Samples of one run in which the car brakes.

    Parameters
    ----------
    run : name
    pressure : float64 [N] [MPa]
    deceleration : float64 [N] [m/s^2]
    torque : of the motor at the wheels, driving positive; 0 where it was not measured, float64 [N] [N m]
    """

    run: str
    pressure: NDArray[np.float64]
    deceleration: NDArray[np.float64]
    torque: NDArray[np.float64]


def find_gain_problems(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float, *, slippery: Collection[str] = ()
) -> list[str]:
    """Return the problem of a pressure whose unit or scale is wrong; none where the runs do not tell it.

    On a dry road no pressure that a gauge shows is too high for what the tyres give. On a slippery one it is: a driver
    who stands on the pedal puts 15 MPa into the master cylinder and slows by 2 m/s^2 on snow. Such runs do not tell
    that the pressure is too large.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units; a pressure must be one, and not another
        signal in its place
    interval : of their clock [s]
    slippery : names of the runs on a road that is not dry
    """
    braking = [
        _collect_braking(run, columns, interval)
        for run, columns in runs.items()
        if {"brake_pressure", "speed"} <= columns.keys()
    ]
    braking = [part for part in braking if len(part.pressure) >= FEWEST_SAMPLES]
    if not braking:
        return []
    low, high = DECELERATION_PER_PRESSURE
    gripping = [part for part in braking if part.run not in slippery]
    if gripping and _bound_gain(gripping)[1] < low:
        return [_describe_gain(gripping)]
    if _bound_gain(braking)[0] > high:
        return [_describe_gain(braking)]
    # one recording of its own scale; its slope says less than that of all runs
    alone = [(part, _compute_gain(part, 0.0), _compute_gain(part, WITHOUT_BRAKE)) for part in braking]
    wrong = [
        [part for part, most, _ in alone if most < low and part in gripping],
        [part for part, _, least in alone if least > high],
    ]
    return [_describe_gain(parts) for parts in wrong if parts]


def _describe_gain(braking: Sequence[Braking]) -> str:
    low, high = DECELERATION_PER_PRESSURE
    gain = _compute_gain(_join_braking(braking), 0.0)
    names = [part.run for part in braking]
    motor = "; if a motor brakes along with it, map the motor's torque as engine_torque" if gain > low else ""
    return (
        f"channel brake_pressure gives {gain:.3g} m/s^2 per MPa over the braking of {list_names(names)},"
        f" which must lie in {low:g} to {high:g}: correct its unit or scale{motor}"
    )


def _collect_braking(run: str, columns: Mapping[str, NDArray[np.float64]], interval: float) -> Braking:
    smooth = {
        name: smooth_channel(columns[name], interval)
        for name in ("brake_pressure", "speed", "engine_torque")
        if name in columns
    }
    pressure, deceleration = smooth["brake_pressure"], -np.gradient(smooth["speed"], interval)
    chosen = (smooth["speed"] > MOVING) & (deceleration > LEAST_DECELERATION)
    chosen &= pressure > LEAST_SHARE * float(np.max(pressure, initial=0.0))
    torque = smooth.get("engine_torque", np.zeros(len(pressure)))
    return Braking(
        run=run, pressure=pressure[chosen], deceleration=deceleration[chosen], torque=torque[chosen]
    )


def _bound_gain(braking: Sequence[Braking]) -> tuple[float, float]:
    """Return the least and the largest gain of the brake that the samples allow [m/s^2 per MPa].

    The largest takes the brake for all of the deceleration. The least leaves the rest to engine and motor: the
    intercept of deceleration on pressure, and a share of the motor's torque where it was measured. A slope alone would
    call a car at its limit of friction wrong, where more pressure gives no more deceleration; so the intercept is at
    most what a car loses without its brake.
    """
    joined = _join_braking(braking)
    most = _compute_gain(joined, 0.0)
    if float(np.std(joined.pressure)) < LEAST_VARIATION * float(np.mean(joined.pressure)):
        return (0.0 if np.any(joined.torque < 0.0) else most), most
    terms = np.column_stack((np.ones(len(joined.pressure)), joined.pressure, joined.torque))
    intercept, _, per_torque = np.linalg.lstsq(terms, joined.deceleration, rcond=None)[0]
    of_motor = float(np.mean(joined.torque)) * min(float(per_torque), 0.0)
    of_engine = float(np.clip(intercept, 0.0, WITHOUT_BRAKE))
    return min(_compute_gain(joined, of_motor + of_engine), most), most


def _compute_gain(braking: Braking, without_brake: float) -> float:
    """Return the deceleration per pressure, less what the car loses without its brake [m/s^2 per MPa]."""
    return (float(np.mean(braking.deceleration)) - without_brake) / float(np.mean(braking.pressure))


def _join_braking(braking: Sequence[Braking]) -> Braking:
    return Braking(
        run="",
        pressure=np.concatenate([part.pressure for part in braking]),
        deceleration=np.concatenate([part.deceleration for part in braking]),
        torque=np.concatenate([part.torque for part in braking]),
    )
