"""A run as a joint fit sees it: its model, its own offsets, and what drove the car before the brake."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, Run
from tasks.identification.inference.driver import LIFT, find_brake_onset
from tasks.identification.inference.forward import (
    READ_ALONE,
    RunModel,
    compute_instrument_readings,
    compute_starting_speed,
    prepare_run,
    simulate_run,
)
from tasks.identification.rules import JointRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.grown import FAMILY, find_family_tables
from tasks.vehicle.effects.table import PARAMETER_INDEX, PARAMETERS, build_parameter_vector
from tasks.vehicle.model.simulation import Simulation
from tasks.vehicle.parameters import Vehicle

FITTED = ("speed", "longitudinal_acceleration", "wheel_speed_front", "wheel_speed_rear")
"""Channels that a joint fit compares: those of the motion along the road."""
OFFSETS = ("initial_speed", "drive", "acceleration_bias")
"""A run's own numbers: speed at its start [m/s], drive force over mass before the brake and bias [m/s2]."""
OFFSET_SIGMA = np.array([0.3, 2.0, 0.3])
"""Their priors."""
OFFSET_LIMIT = np.array([3.0, 8.0, 3.0])
STARTED = [row for row in PARAMETERS.values() if row.start != 0.0]
"""Thresholds and references, each of which acts with the number of its effect."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """A run made ready for a joint fit.

    Parameters
    ----------
    model : the run with what was measured of engine and road
    drive : float64 [N] share of the drive force that acts before the brake; zero where the engine was measured
    onset : first sample at which the driver brakes; the number of samples where he does not
    channels : int64 [C] places of the measured channels of `FITTED`
    """

    model: RunModel
    drive: NDArray[np.float64]
    onset: int
    channels: NDArray[np.int64]

    @property
    def measured(self) -> NDArray[np.float64]:
        """float64 [N, C] measured channels that are compared."""
        return self.model.measured[:, self.channels]

    @property
    def guesses_lift(self) -> bool:
        """Whether no channel says when the driver lifts, and he brakes."""
        return self.model.run.throttle is None and bool(self.drive.any())

    @property
    def grid(self) -> NDArray[np.bool_]:
        """bool [N, C] instants at which each of them has a sample."""
        sampled, shape = self.model.sampled, (self.model.samples, len(self.channels))
        return np.ones(shape, dtype=bool) if sampled is None else sampled[:, self.channels]


def make_stop(
    run: Run, vehicle: Vehicle, surface: SurfaceParameters, channels: tuple[str, ...], rules: JointRules
) -> Stop:
    """Return a run ready for a joint fit.

    Parameters
    ----------
    run : measured
    vehicle, surface : the model as it stands
    channels : that were measured
    rules : of the joint fit
    """
    model = prepare_run(run, vehicle, surface)
    onset = find_brake_onset(model, rules.brake_onset_share)
    seen = [
        name
        for name in FITTED
        if name in channels and not (name == FITTED[3] and _is_copy(model, FITTED[2], FITTED[3]))
    ]
    return Stop(
        model=model,
        drive=_compute_drive_share(model, onset),
        onset=onset,
        channels=np.array([CHANNELS.index(name) for name in seen]),
    )


def _is_copy(model: RunModel, one: str, other: str) -> bool:
    """Whether one signal stands for both axles: it counts once."""
    a, b = (model.measured[:, CHANNELS.index(name)] for name in (one, other))
    return bool(np.array_equal(a, b))


def _compute_drive_share(model: RunModel, onset: int) -> NDArray[np.float64]:
    """Return how much of the drive force before the brake acts: by the throttle, else until the brake is pressed."""
    run, count = model.run, model.samples
    if run.drive_torque is not None:
        return np.zeros(count)
    if run.throttle is not None:
        return np.clip(run.throttle[:count], 0.0, 1.0)
    if onset == count:
        return np.zeros(count)  # without a brake it coasts: that is what such a run is for
    late = (np.arange(count) - onset) * run.interval
    return np.clip(0.5 - late / LIFT, 0.0, 1.0)


def simulate_stop(stop: Stop, numbers: Mapping[str, float], offsets: NDArray[np.float64]) -> Simulation:
    """Return the motion of a run.

    Parameters
    ----------
    stop : the run
    numbers : of the table of effects, on top of the vehicle
    offsets : float64 [3] in the order of `OFFSETS`
    """
    model = stop.model
    theta = build_parameter_vector(complete_numbers(numbers))
    if stop.drive.any():
        torque = offsets[1] * model.vehicle.mass * model.vehicle.wheel_radius * stop.drive
        model = replace(model, run=replace(model.run, drive_torque=torque))
    speed = compute_starting_speed(model, theta) + float(offsets[0])
    return simulate_run(model, theta, initial_speed=speed)


def predict_stop(
    stop: Stop, numbers: Mapping[str, float], offsets: NDArray[np.float64], motion: Simulation | None = None
) -> NDArray[np.float64]:
    """Return the readings of a run, float64 [N, 7] in the order of `CHANNELS`.

    Parameters
    ----------
    stop, numbers, offsets : as `simulate_stop` takes them
    motion : of the run with these numbers, where it is known
    """
    theta = build_parameter_vector(complete_numbers(numbers))
    moved = simulate_stop(stop, numbers, offsets) if motion is None else motion
    y = compute_instrument_readings(stop.model, theta, moved)
    y[:, CHANNELS.index("longitudinal_acceleration")] += offsets[2]
    return y


def is_only_read(stop: Stop, name: str) -> bool:
    """Whether one of `OFFSETS` or of the numbers leaves the motion of a run as it is, and moves its readings at most.

    Parameters
    ----------
    stop : the run
    name : of the offset or number
    """
    if name == "drive":
        return not stop.drive.any()
    if name in PARAMETERS and all(_is_of_other_weather(field, stop) for field in PARAMETERS[name].fields):
        return True
    return name == "acceleration_bias" or PARAMETER_INDEX.get(name) in READ_ALONE


def _is_of_other_weather(field: str, stop: Stop) -> bool:
    """Whether a field is of tyre families in whose weather a run was not driven."""
    return field.startswith(FAMILY) and not find_family_tables(field, (stop.model.run.weather,))[0]


def complete_numbers(numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the numbers with the thresholds that act with them, each at its start value.

    Parameters
    ----------
    numbers : of the table of effects
    """
    moved = {PARAMETERS[name].effect for name, value in numbers.items() if value != 0.0}
    return {row.name: row.start for row in STARTED if row.effect in moved} | dict(numbers)
