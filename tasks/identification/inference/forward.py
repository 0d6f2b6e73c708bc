"""Readings of the instruments as the vehicle model predicts them for one run."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import BRAKING_PRESSURE, CHANNELS, Run, find_motion
from tasks.campaign.gauge import zero_pressure_at_rest
from tasks.identification.inference.recursion import filter_recursively
from tasks.surface.road_profile import FLAT_ROAD, RoadGrade, RoadHazard
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.effects.grown import apply_effects
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX, PARAMETERS, unpack_parameter_vector
from tasks.vehicle.model.brake_input import BrakeInput, make_trace_input
from tasks.vehicle.model.chassis import Conditions
from tasks.vehicle.model.simulation import COLUMN, Recording, Simulation, simulate
from tasks.vehicle.parameters import SurfaceResponse, Vehicle, compute_surface_response

LEAD, LEAST_LEAD, DRIVEN_LEAD = 1.0, 5, 0.3
"""Time before the brake whose line gives the speed at the first sample [s], its fewest samples [1], and the time before
a run that begins where a driver lifted his foot [s]."""
STEP = 0.002
"""Longest integration step [s]; `compute_step_misfit` checks it by halving."""
SENSED = tuple(
    COLUMN[name]
    for name in (
        "speed", "longitudinal_acceleration", "wheel_speed_f", "wheel_speed_r", "pitch", "pitch_rate",
        "heave_acceleration",
    )
)  # fmt: skip
"""Columns of a history that the instruments read, in the order of `CHANNELS`."""

SENSOR_INDEX = {name: row.index for name, row in PARAMETERS.items() if row.port == "sensor"}
"""Position of every error of an instrument in a parameter vector."""

READ_ALONE = [row.index for name, row in PARAMETERS.items() if row.port == "sensor" and name != "speed_scale"]
"""Positions of the errors of instruments that leave the motion as it is; that of the speed changes where it starts."""


@dataclass(frozen=True, kw_only=True)
class RunModel:
    """A run prepared for simulation.

    Parameters
    ----------
    run : the measured run
    vehicle : vehicle with the effects that it has already; fitted effects are added to them
    surface_friction : mu_c [1]
    conditions : road feature, snow, direction and disc temperature of the run
    samples : number of samples that are used, to the end of `find_motion`
    initial_speed : speed at the first sample, from the line through the speed before the brake [m/s]
    """

    run: Run
    vehicle: Vehicle
    surface_friction: float
    conditions: Conditions
    samples: int
    initial_speed: float

    def count_substeps(self, step: float) -> int:
        """Return the number of integration steps between samples.

        Parameters
        ----------
        step : longest integration step [s]
        """
        return max(round(self.run.interval / step), 1)

    @property
    def measured(self) -> NDArray[np.float64]:
        """Return the measured channels that are used, float64 [samples, 7]."""
        return self.run.response[: self.samples]

    @property
    def sampled(self) -> NDArray[np.bool_] | None:
        """Return where the used channels have samples, bool [samples, 7]; None where all have one at every instant."""
        return None if self.run.sampled is None else self.run.sampled[: self.samples]

    @property
    def pressure(self) -> NDArray[np.float64]:
        """Return the brake pressure at the instants that are used, float64 [samples] [MPa]."""
        return self.run.pressure[: self.samples]

    def find_samples(self, channel: int) -> NDArray[np.int64]:
        """Return the used instants at which a channel has a sample, int64 [M].

        Parameters
        ----------
        channel : place in `CHANNELS`
        """
        rows = self.run.find_samples(channel)
        return rows[rows < self.samples]

    def compute_square_error(self, predicted: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean square by which a prediction misses the samples of each channel, float64 [..., 7].

        Parameters
        ----------
        predicted : float64 [..., samples, 7]
        """
        square = (self.measured - predicted) ** 2
        if self.sampled is None:
            return np.asarray(square.mean(axis=-2))
        return np.asarray(
            np.where(self.sampled, square, 0.0).sum(axis=-2) / np.maximum(self.count_samples(), 1)
        )

    def count_samples(self) -> NDArray[np.int64]:
        """Return the number of used samples of each channel, int64 [7]."""
        return np.array([len(self.find_samples(channel)) for channel in range(len(CHANNELS))])


def prepare_run(run: Run, vehicle: Vehicle, surface: SurfaceParameters) -> RunModel:
    """Return a run with its vehicle, surface friction, road feature and disc temperature, ready for simulation.

    Parameters
    ----------
    run : measured run
    vehicle : judged vehicle
    surface : pavement, from which the weather mapping computes friction
    """
    weather = Weather(
        kind=run.weather,
        precipitation_mm_h=run.precipitation_mm_h,
        snow_accumulation_h=run.snow_accumulation_h,
    )
    state = surface_state(weather, surface)
    hazard = FLAT_ROAD
    if run.hazard_length > 0:
        hazard = RoadHazard(
            center_m=run.hazard_center, length_m=run.hazard_length, height_m=run.hazard_height
        )
    speed = run.speed
    samples = find_motion(speed)[1]
    pressed = np.flatnonzero(run.pressure > BRAKING_PRESSURE)
    lead = min(round(LEAD / run.interval), int(pressed[0]) if pressed.size else samples)
    before = run.speed_before if run.speed_before is not None else np.empty(0)
    before = before[-max(round(DRIVEN_LEAD / run.interval), LEAST_LEAD) :]
    lead = min(max(lead, LEAST_LEAD - len(before)), samples)
    return RunModel(
        run=replace(run, pressure=zero_pressure_at_rest(run.pressure)),
        vehicle=vehicle,
        surface_friction=state.friction,
        conditions=Conditions(
            hazard=hazard,
            snow_depth_mm=state.snow_depth_mm,
            direction=run.direction,
            disc_rise=run.disc_rise,
            grip=state.grip,
        ),
        samples=samples,
        initial_speed=float(
            np.polyfit(np.arange(-len(before), lead), np.concatenate((before, speed[:lead])), 1)[1]
        ),
    )


def make_drive(model: RunModel) -> BrakeInput:
    """Return what the driver of a run gives, as it was measured."""
    return make_trace_input(model.run.pressure, model.run.interval, model.run.drive_torque)


def compute_grade_force(run: Run, vehicle: Vehicle) -> tuple[Slot, ...]:
    """Return the force of the road's slope over time, rearward positive [N]; none without a slope."""
    if run.slope is None:
        return ()
    force = vehicle.mass * vehicle.gravity * np.sin(run.slope)
    return (Slot(port="longitudinal_force", variable="time", origin=0.0, spacing=run.interval, values=force),)


def compute_starting_speed(model: RunModel, theta: NDArray[np.float64]) -> float:
    """Return the speed at the first sample: the reading without its scale error [m/s].

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] effects and sensor errors [units of the table]
    """
    return model.initial_speed / (1.0 + float(theta[PARAMETER_INDEX["speed_scale"]]))


def moves_alike(theta: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether a run moves alike under two vectors of parameters, which only its instruments tell apart.

    Parameters
    ----------
    theta, other : float64 [len(EFFECT_TABLE)] [units of the table]
    """
    return not np.any(np.delete(theta != other, READ_ALONE))


@dataclass(frozen=True, kw_only=True)
class EquippedVehicle:
    """A vehicle with effects, its tyres on the surface of a run, and the run's conditions.

    Parameters
    ----------
    vehicle, surface, conditions : as `simulate` takes them
    """

    vehicle: Vehicle
    surface: SurfaceResponse
    conditions: Conditions


def equip_vehicle(model: RunModel, theta: NDArray[np.float64]) -> EquippedVehicle:
    """Return a run's vehicle with effects, ready to simulate.

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] effects, added to the vehicle's own [units of the table]
    """
    values = unpack_parameter_vector(theta)
    car = apply_effects(model.vehicle, {n: v for n, v in values.items() if PARAMETERS[n].of_vehicle})
    return EquippedVehicle(
        vehicle=car,
        surface=compute_surface_response(car, model.run.weather, model.surface_friction),
        conditions=replace(model.conditions, grade=RoadGrade(rise=(values.get("slope", 0.0),))),
    )


def simulate_run(
    model: RunModel,
    theta: NDArray[np.float64],
    *,
    slots: tuple[Slot, ...] = (),
    initial_speed: float | None = None,
    step: float = STEP,
    refinement: int = 1,
    keep_states: bool = False,
    equipped: EquippedVehicle | None = None,
) -> Simulation:
    """Simulate a run under its measured pressure.

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] effects, added to the vehicle's own [units of the table]
    slots : forms, added to the vehicle's own
    initial_speed : replaces the model's initial speed [m/s]
    step : longest integration step [s]
    refinement : factor on the number of integration steps between samples [1]
    keep_states : keep the states, from which other simulations can start
    equipped : `equip_vehicle` of the same run and vector, where it is at hand
    """
    car = equip_vehicle(model, theta) if equipped is None else equipped
    return simulate(
        car.vehicle,
        car.surface,
        make_drive(model),
        car.conditions,
        Recording(
            samples=model.samples,
            interval=model.run.interval,
            substeps=refinement * model.count_substeps(step),
            keep_states=keep_states,
        ),
        initial_speed=compute_starting_speed(model, theta) if initial_speed is None else initial_speed,
        slots=(*compute_grade_force(model.run, car.vehicle), *slots),
    )


def compute_instrument_readings(
    model: RunModel, theta: NDArray[np.float64], motion: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the channels as the instruments give them: with gravity along a grade, and with sensor effects.

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] effects and sensor errors [units of the table]
    motion : float64 [..., samples, 7] `SENSED` columns of one or more simulations of the run

    Returns
    -------
    float64 [..., samples, 7] in the order and units of `CHANNELS`
    """
    g = model.vehicle.gravity
    e = {name: float(theta[i]) for name, i in SENSOR_INDEX.items()}
    speed, acceleration, wheel_f, wheel_r, pitch, pitch_rate, up = (
        motion[..., column] for column in range(len(SENSED))
    )
    felt = acceleration + g * theta[PARAMETER_INDEX["slope"]] * model.run.direction
    if model.run.slope is not None:
        felt = felt + g * np.sin(model.run.slope[: model.samples])
    tilt = e["mount_tilt"]
    if model.run.speed_of_wheels:
        radius = model.vehicle.wheel_radius * (1.0 + theta[PARAMETER_INDEX["wheel_radius"]])
        speed = 0.5 * radius * (wheel_f + wheel_r)
    y = np.empty_like(motion)
    y[..., 0] = speed * (1.0 + e["speed_scale"])
    leak = e["gravity_leak"] * g * np.sin(pitch)
    y[..., 1] = (felt - leak + tilt * (g + up)) * (1.0 + e["acceleration_scale"])
    y[..., 2] = wheel_f * (1.0 + e["wheel_speed_scale"])
    y[..., 3] = wheel_r * (1.0 + e["wheel_speed_scale"])
    y[..., 4] = np.degrees(pitch) * (1.0 + e["pitch_scale"])
    y[..., 5] = np.degrees(pitch_rate) * (1.0 + e["pitch_rate_scale"])
    y[..., 6] = (up - tilt * felt) * (1.0 + e["vertical_scale"])
    dt = model.run.interval
    for columns, chain in (
        (slice(0, 1), "speed"),
        (slice(1, 2), "acceleration"),
        (slice(2, 4), "wheel_speed"),
        (slice(4, 6), "pitch"),
    ):
        delay, lag = e[f"{chain}_delay"], e.get(f"{chain}_lag", 0.0)
        if delay:
            late = np.arange(model.samples) - delay / dt
            for one in y.reshape(-1, *y.shape[-2:]):
                for j in range(columns.start, columns.stop):
                    one[:, j] = np.interp(late, np.arange(model.samples), one[:, j])
        if lag > 0.0:
            keep = np.exp(-dt / lag)
            driven = (1.0 - keep) * y[..., columns]
            driven[..., 0, :] += keep * y[..., 0, columns]
            y[..., columns] = np.moveaxis(filter_recursively(np.moveaxis(driven, -2, 0), keep), 0, -2)
    return y


def predict_channels(
    model: RunModel, theta: NDArray[np.float64], *, slots: tuple[Slot, ...] = (), refinement: int = 1
) -> NDArray[np.float64]:
    """Return the predicted channels of a run, float64 [samples, 7]; arguments as in `simulate_run`."""
    simulated = simulate_run(model, theta, slots=slots, refinement=refinement)
    return compute_instrument_readings(model, theta, simulated.history[:, SENSED])
