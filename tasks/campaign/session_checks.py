"""What checks measure of all runs together, and of recordings before runs are looked for.

What the conditions of each function mean stands in ``catalogs/campaign_checks.yaml``.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.campaign.channels import guess_unit
from tasks.campaign.checks import Figure, Measure
from tasks.campaign.clocks import measure_fall
from tasks.campaign.measured import BRAKES, Clock, MeasuredRun, Recordings, Session, smooth_channel
from tasks.campaign.resting_pressure import find_brake_rest, measure_resting_levels
from tasks.campaign.run_checks import measure_radii
from tasks.campaign.segments import find_brake_rule
from tasks.campaign.signals import average_sources
from tasks.campaign.slow_channels import take_input_updates
from tasks.campaign.speed_by_acceleration import estimate_slopes, measure_apart
from tasks.conventions import GRAVITY


def _count_restarts(clock: Clock, *, step_back: float) -> Iterator[Figure]:
    """Return how often a clock begins again [1], so that its times stand for several stretches."""
    known = np.flatnonzero(np.isfinite(clock.time))
    back = np.flatnonzero(np.diff(clock.time[known]) < -step_back)
    if back.size:
        rows = [str(row + clock.first) for row in known[back + 1]]
        more = f" and {len(rows) - 5} more" if len(rows) > 5 else ""
        words = {
            "rows": f"{clock.kind}{'s' if len(rows) > 1 else ''} {', '.join(rows[:5])}{more}{clock.where}",
            "start": clock.time[known[back[0]]],
            "end": clock.time[known[back[0] + 1]],
            "which": f"{'each such' if len(rows) > 1 else 'that'} {clock.kind}",
        }
        yield Figure(value=back.size, words=words)


def _measure_sampling_step(recordings: Recordings, **conditions: float) -> Iterator[Figure]:
    """Return the shortest usual step of the signals of a recording [s]."""
    for step, _, words in _measure_clocks(recordings, **conditions):
        yield Figure(value=step, words=words)


def _measure_clock_fall(recordings: Recordings, **conditions: float) -> Iterator[Figure]:
    """Return how fast the speed falls in the far falls of a recording [m/s^2]."""
    for _, fall, words in _measure_clocks(recordings, **conditions):
        if fall is not None:
            yield Figure(value=fall, words=words)


def _measure_clocks(
    recordings: Recordings, *, usual_fall: float, like: float, **conditions: float
) -> Iterator[tuple[float, float | None, dict[str, object]]]:
    """Return the step of each recording [s], the fall of its speed [m/s^2], and words that name a likely unit."""
    rule = next((rule for rule in recordings.rules if rule.channel == "speed"), None)
    for signals in recordings.signals:
        steps = [
            float(np.median(np.diff(signal.time))) for signal in signals.values() if len(signal.time) > 1
        ]
        step = min((step for step in steps if step > 0.0), default=0.0)
        if not step:
            continue
        words: dict[str, object] = {"taken": recordings.clock_unit, "falls": "", "hint": ""}
        words["step"] = f"{step:.3g} s" if step >= 0.1 else f"{1e3 * step:.3g} ms"
        speed = None if rule is None else average_sources(signals, rule)
        fall = None if speed is None else measure_fall(speed.time, speed.values, **conditions)
        if fall is not None:
            near = guess_unit(recordings.clock_unit, usual_fall / fall, within=like)
            words["falls"] = f" and the speed falls by {fall:.2g} m/s^2"
            words["hint"] = f", it looks like {near}" if near else ""
        yield step, fall, words


def _measure_input_updates(recordings: Recordings) -> Iterator[Figure]:
    """Return the rate of the updates of each input that a table holds between them [Hz]."""
    for rule in recordings.rules:
        for signal in (signals[name] for signals in recordings.signals for name in rule.sources):
            updates = signal if rule.channel in CHANNELS else take_input_updates(signal)
            if updates is not signal:
                yield Figure(value=1.0 / float(np.median(np.diff(updates.time))), channel=rule.channel)


def _count_brake_values(recordings: Recordings) -> Iterator[Figure]:
    """Return the number of values that the best brake signal has [1]: a switch is off or on."""
    if brake := find_brake_rule(recordings.rules):
        logged = [signals[name].values for signals in recordings.signals for name in brake.sources]
        values = np.unique(np.concatenate(logged))
        values = values[np.isfinite(values)]
        if len(values) > 1:
            words = {"off": values[0], "on": values[1]}
            yield Figure(value=len(values), channel=brake.channel, words=words)


@dataclass(frozen=True, kw_only=True)
class Braking:
    """Samples in which the car brakes.

    Parameters
    ----------
    runs : names of their runs
    pressure : float64 [N] [MPa]
    deceleration : float64 [N] [m/s^2]
    torque : of the motor at the wheels, driving positive; 0 where it was not measured, float64 [N] [N m]
    """

    runs: tuple[str, ...]
    pressure: NDArray[np.float64]
    deceleration: NDArray[np.float64]
    torque: NDArray[np.float64]

    def gain(self, without_brake: float = 0.0) -> float:
        """Return the deceleration per pressure, less what the car loses without its brake [m/s^2 per MPa]."""
        return (float(np.mean(self.deceleration)) - without_brake) / float(np.mean(self.pressure))

    def make_figure(self, value: float) -> Figure:
        """Return a bound of the gain as the figure of a check."""
        return Figure(value=value, channel="brake_pressure", places=self.runs, words={"gain": self.gain()})


def _collect_braking(
    session: Session, gripping: bool, /, *, deceleration: float, pressed: float, fewest_samples: float
) -> list[Braking]:
    """Return the samples of each run in which the car brakes, of runs that have enough, all or on grip alone."""
    found = []
    for run in (run for run in session.runs if not (gripping and run.slippery)):
        pressure = run.smooth["brake_pressure"]
        chosen = run.moving & (run.rate < -deceleration) & (pressure > pressed * float(np.max(pressure)))
        torque = run.smooth.get("engine_torque", np.zeros(len(pressure)))
        if np.count_nonzero(chosen) >= fewest_samples:
            part = pressure[chosen], -run.rate[chosen], torque[chosen]
            found.append(Braking(runs=(run.name,), pressure=part[0], deceleration=part[1], torque=part[2]))
    return found


def _measure_largest_gain(session: Session, **conditions: float) -> Iterator[Figure]:
    """Return the largest gain of the brake of each run that is not slippery, which does all [m/s^2 per MPa].

    A driver who stands on the pedal on snow puts 15 MPa into the master cylinder and slows by 2 m/s^2: slippery runs do
    not tell that the pressure is too large.
    """
    yield from (part.make_figure(part.gain()) for part in _collect_braking(session, True, **conditions))


def _measure_least_gain(session: Session, *, without_brake: float, **conditions: float) -> Iterator[Figure]:
    """Return the least gain of the brake of each run, which leaves all it may to engine and drag [m/s^2 per MPa]."""
    yield from (
        part.make_figure(part.gain(without_brake)) for part in _collect_braking(session, False, **conditions)
    )


def _measure_common_gain(
    session: Session, *, without_brake: float, least_variation: float, **conditions: float
) -> Iterator[Figure]:
    """Return the least gain of the brake over all runs [m/s^2 per MPa].

    It leaves to engine and motor the intercept of deceleration on pressure, and a share of the motor's torque where it
    was measured. A slope alone would call a car at its limit of friction wrong, where more pressure gives no more
    deceleration; so the intercept is at most what a car loses without its brake.
    """
    if not (parts := _collect_braking(session, False, **conditions)):
        return
    together = Braking(
        runs=tuple(name for part in parts for name in part.runs),
        pressure=np.concatenate([part.pressure for part in parts]),
        deceleration=np.concatenate([part.deceleration for part in parts]),
        torque=np.concatenate([part.torque for part in parts]),
    )
    pressure, torque, least = together.pressure, together.torque, together.gain()
    if float(np.std(pressure)) < least_variation * float(np.mean(pressure)):
        least = 0.0 if np.any(torque < 0.0) else least
    else:
        terms = np.column_stack((np.ones(len(pressure)), pressure, torque))
        intercept, _, per_torque = np.linalg.lstsq(terms, together.deceleration, rcond=None)[0]
        of_motor = float(np.mean(torque)) * min(float(per_torque), 0.0)
        least = min(together.gain(of_motor + float(np.clip(intercept, 0.0, without_brake))), least)
    yield together.make_figure(least)


def _measure_km_h(session: Session, **conditions: float) -> Iterator[Figure]:
    """Return by how much the rolling radius of a wheel in rad/s is off 1/3.6 m, which a small tyre has too [1]."""
    radii: dict[str, list[float]] = {}
    for run in session.runs:
        for name, (radius, _) in measure_radii(run, **conditions).items():
            if run.unit_of(name) == "rad/s":
                radii.setdefault(name, []).append(radius)
    for name, found in radii.items():
        radius = float(np.median(found))
        yield Figure(value=abs(3.6 * radius - 1.0), channel=name, words={"radius": radius})


def _measure_levels(session: Session) -> dict[str, float]:
    return measure_resting_levels({run.name: run.columns for run in session.runs}, session.runs[0].interval)


def _measure_common_rest(session: Session) -> Iterator[Figure]:
    """Return the pressure at which a gauge rests in all runs alike while nobody brakes [MPa]."""
    levels = _measure_levels(session)
    rest = find_brake_rest(levels)
    yield Figure(value=rest, channel="brake_pressure", words={"count": len(levels), "offset": -rest})


def _measure_highest_rest(session: Session) -> Iterator[Figure]:
    """Return the highest pressure at which a gauge rests in some run while nobody brakes [MPa]."""
    if levels := _measure_levels(session):
        low, high = min(levels, key=lambda run: levels[run]), max(levels, key=lambda run: levels[run])
        words = {"level": levels[low], "low": low, "high": high}
        yield Figure(value=levels[high], channel="brake_pressure", words=words)


def _measure_turns(
    session: Session, *, released: float, deceleration: float, turning: float
) -> Iterator[Figure]:
    """Return the time that each car brakes while it turns [s]: its tyres then carry it sideways too."""
    for run in session.runs:
        brake = run.smooth[next(name for name in BRAKES if name in run.smooth)]
        sideways = np.abs(_smooth_sideways(run))
        braking = run.moving & (brake > released * float(np.max(brake))) & (run.rate < -deceleration)
        inside = np.flatnonzero(braking & (sideways > turning))
        if inside.size:
            start = (inside[0] + 0.5 * (len(run.columns["speed"]) - len(brake))) * run.interval
            most = np.max(sideways[inside])
            place = f"{run.name} (up to {most:.3g} m/s^2 to the side, from {start:.2f} s into the run)"
            yield Figure(value=len(inside) * run.interval, places=(place,))


def _smooth_sideways(run: MeasuredRun) -> NDArray[np.float64]:
    """Return the acceleration to the side, measured, else of speed and yaw rate, float64 [M] [m/s^2]."""
    if "lateral_acceleration" in run.smooth:
        return run.smooth["lateral_acceleration"]
    return smooth_channel(run.columns["speed"] * np.radians(run.columns["yaw_rate"]), run.interval)


def _measure_slopes(session: Session, **conditions: float) -> Iterator[Figure]:
    """Return how much runs scatter by what the accelerometer reads beyond the rate of speed [m/s^2]."""
    if not estimate_slopes(session.runs, **conditions):
        return
    apart = {run: zero for run, (zero, _) in measure_apart(session.runs, conditions["shortest"]).items()}
    low, high = min(apart, key=lambda run: apart[run]), max(apart, key=lambda run: apart[run])
    words = {"low": low, "high": high, "least": apart[low], "most": apart[high]}
    words |= {"down": 100.0 * apart[low] / GRAVITY, "up": 100.0 * apart[high] / GRAVITY}
    yield Figure(value=float(np.std(list(apart.values()))), channel="longitudinal_acceleration", words=words)


MEASURES: dict[str, Measure] = {
    "restart": _count_restarts,
    "sampling_step": _measure_sampling_step,
    "clock_fall": _measure_clock_fall,
    "held_input": _measure_input_updates,
    "brake_switch": _count_brake_values,
    "weak_brake": _measure_largest_gain,
    "strong_brake": _measure_common_gain,
    "strong_brake_of_run": _measure_least_gain,
    "wheel_in_km_h": _measure_km_h,
    "common_rest": _measure_common_rest,
    "highest_rest": _measure_highest_rest,
    "turn": _measure_turns,
    "felt_slope": _measure_slopes,
}
"""Functions by the name of their check."""
