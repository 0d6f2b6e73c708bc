"""What checks measure of a run on its clock: channels beside a road car's, and beside channels that they must follow.

What the conditions of each function mean stands in ``catalogs/campaign_checks.yaml``.
"""

from collections.abc import Iterator
from math import log

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import LEAST_SAMPLES, MASKED_SPEED, find_motion
from tasks.campaign.channels import (
    BRAKE_SIGNALS,
    CHANNELS_BY_NAME,
    SPEED_UNITS,
    UNITS,
    WHEELS,
    guess_unit,
)
from tasks.campaign.checks import Figure, Measure
from tasks.campaign.clocks import measure_fall
from tasks.campaign.measured import BRAKES, STAND_IN, MeasuredRun
from tasks.conventions import GRAVITY

TURN_OVER = "turn its sign over"


def _measure_uneven_step(run: MeasuredRun) -> Iterator[Figure]:
    """Return by how much a step of the time is off the declared one at most, as a share of it [1]."""
    time = run.columns["time"]
    off = np.abs(np.diff(time) - run.interval) / run.interval
    at = int(np.argmax(off))
    words = {"interval": run.interval, "start": time[at], "end": time[at + 1]}
    yield Figure(value=float(off[at]), channel="time", words=words)


def _measure_drift(run: MeasuredRun) -> Iterator[Figure]:
    """Return by how much a run is longer or shorter than declared, as a share of it, if by more than a step [1]."""
    time = run.columns["time"]
    declared, taken = (len(time) - 1) * run.interval, float(time[-1] - time[0])
    if abs(taken - declared) > run.interval:
        words = {"interval": run.interval, "count": len(time), "declared": declared, "taken": taken}
        yield Figure(value=abs(taken - declared) / declared, channel="time", words=words)


def _count_spare_motion(run: MeasuredRun) -> Iterator[Figure]:
    """Return the samples in motion beyond those that a run needs [1]."""
    first, end = find_motion(run.columns["speed"])
    words = {"count": end - first, "needed": LEAST_SAMPLES, "seconds": LEAST_SAMPLES * run.interval}
    words |= {"slowest": MASKED_SPEED, "rate": 1.0 / run.interval}
    yield Figure(value=end - first - LEAST_SAMPLES, channel="speed", words=words)


def _measure_slow_start(run: MeasuredRun) -> Iterator[Figure]:
    """Return the time before a run over a road feature moves [s]."""
    if run.over_feature:
        first, _ = find_motion(run.columns["speed"])
        yield Figure(value=first * run.interval, channel="speed", words={"slowest": MASKED_SPEED})


def _measure_jump(run: MeasuredRun, *, acceleration: float, usual_steps: float) -> Iterator[Figure]:
    """Return the largest step of the speed beyond acceleration and resolution of the sensor [m/s]."""
    steps = np.abs(np.diff(run.columns["speed"]))
    usual = float(np.median(steps[steps > 0])) if steps.any() else 0.0
    at = int(np.argmax(steps))
    beyond = float(steps[at]) - acceleration * run.interval - usual_steps * usual
    words = {"step": steps[at], "sample": at + 1, "at": (at + 1) * run.interval}
    yield Figure(value=beyond, channel="speed", words=words)


def _measure_peaks(run: MeasuredRun) -> Iterator[Figure]:
    """Return the largest magnitude of each channel over that of a road car [1]."""
    for name, values in run.columns.items():
        if name in run.spans:
            peak, highest = float(np.max(np.abs(values))), run.spans[name][1]
            yield Figure(value=peak / highest, channel=name, words=_write_reach(name, peak, highest))


def _measure_undershoots(run: MeasuredRun) -> Iterator[Figure]:
    """Return by how much each channel falls below what noise and offset of its sensor explain [its unit]."""
    for name, values in run.columns.items():
        if name in run.spans:
            lowest, span = float(np.min(values)), run.spans[name][0]
            yield Figure(value=span - lowest, channel=name, words=_write_reach(name, lowest, span))


def _write_reach(channel: str, reaches: float, span: float) -> dict[str, object]:
    unit = CHANNELS_BY_NAME[channel].unit
    return {"reaches": reaches, "unit": "" if unit == "1" else f" {unit}", "span": span}


def measure_radii(
    run: MeasuredRun, *, fewest_samples: float, least_turning: float, free_deceleration: float
) -> dict[str, tuple[float, bool]]:
    """Return the rolling radius of each axle by its channel [m], and whether it rolled without slip that counts.

    Parameters
    ----------
    run : with a speed
    fewest_samples, least_turning, free_deceleration : conditions of the check ``rolling_radius``
    """
    radii = {}
    for name in (one for one in WHEELS if one in run.smooth):
        rolling = run.moving & (np.abs(run.smooth[name]) > least_turning)
        free = rolling & (run.rate > -free_deceleration)
        is_free = bool(np.count_nonzero(free) >= fewest_samples)
        chosen = free if is_free else rolling
        if np.count_nonzero(chosen) >= fewest_samples:
            radii[name] = float(np.median(run.smooth["speed"][chosen] / run.smooth[name][chosen])), is_free
    return radii


def _measure_radius(run: MeasuredRun, **conditions: float) -> Iterator[Figure]:
    """Return the rolling radius of each axle [m], negative where the wheels turn against the speed."""
    for name, (radius, _) in measure_radii(run, **conditions).items():
        todo = "turn the sign of the wheel over" if radius < 0.0 else "correct the unit of one of them"
        yield Figure(value=radius, channel=name, words={"todo": todo})


def _compare_radii(run: MeasuredRun, **conditions: float) -> Iterator[Figure]:
    """Return by how much the rolling radii of two axles differ, as the logarithm of their ratio [1]."""
    radii = [
        radius for radius, is_free in measure_radii(run, **conditions).values() if is_free and radius > 0.0
    ]
    if len(radii) == 2:
        like = min(abs(3.6 * radius - 1.0) for radius in radii) < 0.01
        words = {"front": radii[0], "rear": radii[1], "hint": " (one looks like km/h)" if like else ""}
        yield Figure(value=abs(log(radii[0] / radii[1])), words=words)


def _measure_fastest_change(
    run: MeasuredRun, *, least_fall: float, least_pressure: float
) -> Iterator[Figure]:
    """Return how fast the speed changes at most in a run that brakes [m/s^2]: a time in ms makes a stop take hours."""
    change = float(np.ptp(run.smooth["speed"]))
    if run.smooth["brake_pressure"].max() >= least_pressure and change >= least_fall:
        yield Figure(value=float(np.max(np.abs(run.rate))), channel="speed", words={"change": change})


def _measure_constant_pressure(run: MeasuredRun) -> Iterator[Figure]:
    """Return the level of a pressure that never changes [MPa]."""
    if np.ptp(run.columns["brake_pressure"]) == 0.0:
        yield Figure(value=abs(float(run.columns["brake_pressure"][0])), channel="brake_pressure")


def _measure_fall_without_pressure(run: MeasuredRun) -> Iterator[Figure]:
    """Return how fast the speed falls while the pressure is 0 throughout, and no motor brakes [m/s^2]."""
    motor = run.columns.get("engine_torque", np.zeros(1))
    if not run.columns["brake_pressure"].any() and not np.any(motor < 0.0):
        width = len(run.columns["speed"]) - len(run.rate) + 1
        yield Figure(value=-float(np.mean(np.sort(run.rate)[:width])), channel="brake_pressure")


def _compare_braking(
    run: MeasuredRun, *, applied: float, released: float, fewest_samples: float
) -> Iterator[Figure]:
    """Return by how much more the car slows on the wrong side of each signal of the brake [m/s^2].

    It must slow while the signal is large, and not while it is small, or negative.
    """
    for name in (one for one in BRAKES if one in run.smooth):
        brake = run.smooth[name]
        size = np.abs(brake)
        on, off = run.moving & (size > applied * size.max()), run.moving & (size < released * size.max())
        if min(np.count_nonzero(on), np.count_nonzero(off)) < fewest_samples:
            continue
        braked, free = -float(np.mean(run.rate[on])), -float(np.mean(run.rate[off]))
        words: dict[str, object] = {"braked": braked, "free": free, "said": "negative while the car brakes"}
        words["todo"], more = TURN_OVER, braked - free
        if float(np.mean(brake[on])) >= 0.0:
            words["said"], more = "no brake", free - braked
            words["todo"] = "correct its source, which may be swapped with another channel's"
        yield Figure(value=more, channel="brake_pressure" if name == STAND_IN else name, words=words)


def _correlate_torque(
    run: MeasuredRun, *, released: float, around: float, shortest: float, least_change: float, lightest: float,
    heaviest: float,
) -> Iterator[Figure]:  # fmt: skip
    """Return the correlation of a torque with the rate of speed, without the slope's share, off the brake [1]."""
    brake = next(name for name in BRAKE_SIGNALS if name in run.smooth)
    pressed = BRAKE_SIGNALS[brake] * run.smooth[brake] > released
    width = 2 * round(around / run.interval) + 1
    near = np.convolve(np.pad(pressed, width // 2), np.ones(width), mode="valid") > 0.5
    chosen = ~near & run.moving
    if np.count_nonzero(chosen) * run.interval < shortest:
        return
    slope = np.radians(run.smooth.get("road_slope", np.zeros(len(chosen))))
    driven = (run.rate + GRAVITY * np.sin(slope))[chosen]
    torque = run.smooth["engine_torque"][chosen]
    if float(np.std(driven)) < least_change or float(np.std(torque)) == 0.0:
        return
    if lightest < float(np.std(torque) / np.std(driven)) < heaviest:
        yield Figure(value=float(np.corrcoef(torque, driven)[0, 1]), channel="engine_torque")


def _measure_fall(run: MeasuredRun, **conditions: float) -> Iterator[Figure]:
    """Return how fast the speed falls in its far falls [m/s^2]."""
    speed = run.columns["speed"]
    fall = measure_fall(run.interval * np.arange(len(speed), dtype=np.float64), speed, **conditions)
    if fall is not None:
        taken = run.unit_of("speed")
        likely = [other for other in SPEED_UNITS if UNITS[other][1] < UNITS[taken][1]]
        hint = f"; taken as {taken}, it looks like {likely[0]}" if likely else ""
        yield Figure(value=fall, channel="speed", words={"hint": hint})


def _regress(values: NDArray[np.float64], other: NDArray[np.float64]) -> tuple[float, float]:
    """Return the correlation of two channels, and the slope of the first over the second; 0 where one is constant."""
    x, y = other - other.mean(), values - values.mean()
    spread = float(np.sqrt((x @ x) * (y @ y)))
    return (float(x @ y) / spread, float(x @ y) / float(x @ x)) if spread > 0.0 else (0.0, 0.0)


def _compare_speed_units(
    run: MeasuredRun, *, correlation: float, changing: float, same: float
) -> Iterator[Figure]:
    """Return how much nearer acceleration and rate of speed are with the speed in another unit than in its own [1]."""
    felt = run.smooth["longitudinal_acceleration"]
    found, ratio = _regress(felt, run.rate)
    if found < correlation or float(np.std(felt)) <= changing:
        return
    taken = run.unit_of("speed")
    apart = {unit: abs(log(ratio * UNITS[taken][1] / UNITS[unit][1])) for unit in SPEED_UNITS}
    near = min(apart, key=apart.__getitem__)
    if apart[near] < log(same):
        nearer = apart[taken] / max(apart[near], 1e-9)
        words = {"ratio": ratio, "taken": taken, "near": near}
        yield Figure(value=nearer, channel="longitudinal_acceleration", words=words)


def _compare_sizes(
    run: MeasuredRun, channel: str, other: NDArray[np.float64], correlation: float
) -> Iterator[Figure]:
    """Return the ratio of a channel to what it must equal, where both are correlated [1]."""
    found, ratio = _regress(run.smooth[channel], other)
    if abs(found) >= correlation:
        taken = run.unit_of(channel)
        guess = guess_unit(taken, ratio) if ratio > 0.0 else None
        hint = f"; taken as {taken}, it looks like {guess}" if guess else ""
        todo = TURN_OVER if ratio < 0.0 else f"the unit or scale of one of them is wrong{hint}"
        yield Figure(value=ratio, channel=channel, words={"todo": todo})


def _compare_acceleration(run: MeasuredRun, *, correlation: float) -> Iterator[Figure]:
    """Return the acceleration over the rate of speed [1]."""
    yield from _compare_sizes(run, "longitudinal_acceleration", run.rate, correlation)


def _compare_pitch_rate(run: MeasuredRun, *, correlation: float) -> Iterator[Figure]:
    """Return the pitch rate over the slope of the pitch [1]."""
    slope = np.gradient(run.smooth["pitch"], run.interval)
    yield from _compare_sizes(run, "pitch_rate", slope, correlation)


def _measure_axis(run: MeasuredRun) -> Iterator[Figure]:
    """Return by how much the acceleration is off the rate of speed on average [m/s^2]: an axis down holds gravity."""
    apart = float(np.mean(run.smooth["longitudinal_acceleration"] - run.rate))
    yield Figure(value=abs(apart), channel="longitudinal_acceleration", words={"apart": apart})


def _measure_dive(
    run: MeasuredRun,
    *,
    correlation: float,
    span: float,
    deceleration: float,
    pressed: float,
    fewest_samples: float,
) -> Iterator[Figure]:
    """Return the pitch that the body gives per deceleration [deg per m/s^2], where both are correlated.

    Changes over a short span are the body's response to the brake, without the slow slope of the road.
    """
    braking = run.moving & (run.rate < -deceleration)
    for brake in (run.smooth[name] for name in ("brake_pressure", STAND_IN) if name in run.smooth):
        braking &= brake > pressed * float(np.max(brake))
    if np.count_nonzero(braking) < fewest_samples:
        return
    lag = max(round(span / run.interval), 1)
    pitch = run.smooth["pitch"]
    found, slope = _regress(pitch[lag:] - pitch[:-lag], run.rate[:-lag] - run.rate[lag:])
    if abs(found) >= correlation:
        todo = "correct the unit or scale of it and of pitch_rate (of a pitch in rad it is 57 times less)"
        yield Figure(value=slope, channel="pitch", words={"todo": TURN_OVER if slope < 0.0 else todo})


def _measure_gravity(run: MeasuredRun) -> Iterator[Figure]:
    """Return the mean of the vertical acceleration, which excludes gravity [m/s^2]."""
    mean = float(np.mean(run.smooth["vertical_acceleration"]))
    yield Figure(value=abs(mean), channel="vertical_acceleration", words={"mean": mean, "offset": -mean})


MEASURES: dict[str, Measure] = {
    "clock_step": _measure_uneven_step,
    "clock_drift": _measure_drift,
    "motion": _count_spare_motion,
    "slow_start": _measure_slow_start,
    "speed_jump": _measure_jump,
    "magnitude": _measure_peaks,
    "undershoot": _measure_undershoots,
    "rolling_radius": _measure_radius,
    "axles": _compare_radii,
    "slow_stop": _measure_fastest_change,
    "constant_pressure": _measure_constant_pressure,
    "missing_pressure": _measure_fall_without_pressure,
    "brake_effect": _compare_braking,
    "torque_sign": _correlate_torque,
    "fall": _measure_fall,
    "speed_unit": _compare_speed_units,
    "acceleration_size": _compare_acceleration,
    "axis": _measure_axis,
    "dive": _measure_dive,
    "pitch_rate_size": _compare_pitch_rate,
    "gravity": _measure_gravity,
}
"""Functions by the name of their check."""
