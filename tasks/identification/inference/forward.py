"""What the model says the instruments of one run should read."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tasks.campaign.campaign import CHANNELS, Run
from tasks.campaign.gauge import zero_pressure_at_rest
from tasks.errors import InputError
from tasks.identification.inference.rollout import CONSTANTS, N_STATES, OUTPUTS, drive
from tasks.surface.friction import surface_friction
from tasks.surface.state import SurfaceParameters, Weather, surface_state
from tasks.vehicle.effects.brake_line import DISC_CAPACITY_F, DISC_CAPACITY_R, DISC_COOLING
from tasks.vehicle.effects.library import ALL_PARAMETERS, PARAMETER_INDEX, parameter_vector
from tasks.vehicle.effects.ports import PARAMETERS
from tasks.vehicle.effects.slots import Slot, slot_tables
from tasks.vehicle.parameters import Vehicle, surface_response

MASKED_SPEED = 2.0
"""Below it the pitch rule and the slip denominator are not force-consistent: runs end there [m/s]."""
SUBSTEPS = 10
"""Integration steps between samples at 100 Hz; halving the step is a check of its own."""
COARSE_SUBSTEPS = 5
"""The same for the derivatives of runs that the longer step hardly changes."""


@dataclass(frozen=True, kw_only=True)
class RunModel:
    """A run made ready for simulation.

    Parameters
    ----------
    run : the measured run
    constants : float64 [len(CONSTANTS)]
    own : float64 [len(ALL_PARAMETERS)] effects that the vehicle has already: what is fitted comes on top
    forms : forms that it has already
    samples : how many samples are used (to the masked speed)
    initial_speed : speed at the first sample, from the line through the speed before the brake [m/s]
    """

    run: Run
    constants: NDArray[np.float64]
    own: NDArray[np.float64]
    forms: tuple[Slot, ...]
    samples: int
    initial_speed: float

    @property
    def measured(self) -> NDArray[np.float64]:
        """float64 [samples, 7] measured channels that are used."""
        return self.run.response[: self.samples]


def run_model(run: Run, vehicle: Vehicle, surface: SurfaceParameters) -> RunModel:
    """Constants of a run: the vehicle, the surface by the weather mapping, the road and the discs.

    Parameters
    ----------
    run : measured run
    vehicle : the model's vehicle
    surface : pavement of the surface mapping

    Raises
    ------
    InputError
        If the vehicle has effects that coupled mode alone knows.
    """
    foreign = [
        name for name, value in vehicle.effects.items() if value != 0.0 and name not in PARAMETER_INDEX
    ]
    if foreign:
        raise InputError(
            f"vehicle {vehicle.name} has effects that only coupled mode knows ({', '.join(foreign)}): no campaign can"
            " be held against it; use the vehicle that it was grown from"
        )
    weather = Weather(
        kind=run.weather,  # type: ignore[arg-type]
        precipitation_mm_h=run.precipitation_mm_h,
        snow_accumulation_h=run.snow_accumulation_h,
    )
    state = surface_state(weather, surface)
    mu_c = surface_friction(weather, state, surface)
    response = surface_response(vehicle, run.weather, mu_c)
    c1, c2, c3 = vehicle.families[run.weather].burckhardt
    values = {
        "sprung_mass": vehicle.sprung_mass,
        "unsprung_mass_f": vehicle.unsprung_mass_f,
        "unsprung_mass_r": vehicle.unsprung_mass_r,
        "l_f": vehicle.cg_to_front_axle,
        "l_r": vehicle.cg_to_rear_axle,
        "cg_height": vehicle.cg_height,
        "pitch_inertia": vehicle.pitch_inertia,
        "spring_f": vehicle.suspension_stiffness_f,
        "spring_r": vehicle.suspension_stiffness_r,
        "damper_f": vehicle.suspension_damping_f,
        "damper_r": vehicle.suspension_damping_r,
        "tyre_stiffness_f": vehicle.tyre_stiffness_f,
        "tyre_stiffness_r": vehicle.tyre_stiffness_r,
        "radius": vehicle.wheel_radius,
        "wheel_inertia_f": vehicle.wheel_inertia_f,
        "wheel_inertia_r": vehicle.wheel_inertia_r,
        "torque_gain": vehicle.brake_gain,
        "front_share": vehicle.front_brake_share,
        "gravity": vehicle.gravity,
        "coast": vehicle.coast_deceleration,
        "release_width": vehicle.abs_release_width,
        "slip_floor": vehicle.slip_speed_floor,
        "friction": response.tyre.peak,
        "slip_scale": response.tyre.decay / c2,
        "pitch_scale": response.pitch_scale,
        "c1": c1,
        "c2": c2,
        "c3": c3,
        "disc_rise": run.disc_rise,
        "disc_capacity_f": DISC_CAPACITY_F,
        "disc_capacity_r": DISC_CAPACITY_R,
        "disc_cooling": DISC_COOLING,
        "hazard_center": run.hazard_center,
        "hazard_length": run.hazard_length,
        "hazard_height": run.hazard_height if run.hazard_length > 0 else 0.0,
        "direction": float(run.direction),
        "snow_depth_mm": state.snow_depth_mm,
        "wet": float(run.weather == "rain"),
    }
    speed = run.response[:, CHANNELS.index("speed")]
    slow = np.flatnonzero(speed < MASKED_SPEED)
    pressed = np.flatnonzero(run.pressure > 0.1)
    lead = min(100, int(pressed[0])) if pressed.size else 100
    return RunModel(
        run=replace(run, pressure=zero_pressure_at_rest(run.pressure)),
        constants=np.array([values[name] for name in CONSTANTS]),
        own=parameter_vector({name: v for name, v in vehicle.effects.items() if name in PARAMETER_INDEX}),
        forms=tuple(form.slot for form in vehicle.forms),
        samples=int(slow[0]) if slow.size else len(speed),
        initial_speed=float(np.polyfit(np.arange(max(lead, 5)), speed[: max(lead, 5)], 1)[1]),
    )


def starting_speed(model: RunModel, theta: NDArray[np.float64]) -> float:
    """Speed at the first sample [m/s]: what the sensor read, less its scale error.

    Parameters
    ----------
    model : the run
    theta : float64 [len(ALL_PARAMETERS)]
    """
    return model.initial_speed / (1.0 + float(theta[PARAMETER_INDEX["speed_scale"]]))


def roll(
    model: RunModel,
    theta: NDArray[np.float64],
    *,
    slots: tuple[Slot, ...] = (),
    initial_speed: float | None = None,
    start: tuple[int, NDArray[np.float64], NDArray[np.float64]] | None = None,
    substeps: int = SUBSTEPS,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Simulate a run.

    Parameters
    ----------
    model : the run
    theta : float64 [len(ALL_PARAMETERS)] effects on top of the vehicle's own
    slots : forms on top of the vehicle's own
    initial_speed : replaces the model's [m/s]
    start : sample, states and outputs of an earlier rollout to branch off from
    substeps : integration steps between samples

    Returns
    -------
    outputs float64 [samples, len(OUTPUTS)] and states float64 [samples, N_STATES]
    """
    motion = np.ascontiguousarray((model.own + theta)[: len(PARAMETERS)])
    keys, grids, tables = slot_tables((*model.forms, *slots))
    if start is None:
        first, out, states = 0, np.zeros((model.samples, len(OUTPUTS))), np.zeros((model.samples, N_STATES))
        v0 = starting_speed(model, theta) if initial_speed is None else initial_speed
        omega = v0 / (
            model.constants[CONSTANTS.index("radius")] * (1.0 + motion[PARAMETER_INDEX["wheel_radius"]])
        )
        states[0, :4] = v0, 0.0, omega, omega
        states[0, 12] = model.run.pressure[0]
        states[0, 13:15] = model.run.disc_rise
    else:
        first, out, states = start[0], start[2].copy(), start[1].copy()
    drive(
        model.constants, motion, model.run.pressure, model.run.interval, substeps, first, model.samples - first,
        states, keys, grids, tables, out,
    )  # fmt: skip
    return out, states


def instruments(model: RunModel, theta: NDArray[np.float64], out: NDArray[np.float64]) -> NDArray[np.float64]:
    """Channels as the instruments give them: gravity along a grade is felt, sensor effects applied.

    Parameters
    ----------
    model : the run
    theta : float64 [len(ALL_PARAMETERS)]
    out : float64 [samples, len(OUTPUTS)] of `roll`

    Returns
    -------
    float64 [samples, 7] in the order and units of `CHANNELS`
    """
    g = float(model.constants[CONSTANTS.index("gravity")])
    e = dict(zip(ALL_PARAMETERS[len(PARAMETERS) :], theta[len(PARAMETERS) :], strict=True))
    felt = out[:, 1] + g * theta[PARAMETER_INDEX["slope"]] * model.run.direction
    up = out[:, 6]
    tilt = e["mount_tilt"]
    ax = (felt - e["gravity_leak"] * g * np.sin(out[:, 4]) + tilt * (g + up)) * (
        1.0 + e["acceleration_scale"]
    )
    y = np.column_stack(
        (
            out[:, 0] * (1.0 + e["speed_scale"]),
            ax,
            out[:, 2] * (1.0 + e["wheel_speed_scale"]),
            out[:, 3] * (1.0 + e["wheel_speed_scale"]),
            np.degrees(out[:, 4]) * (1.0 + e["pitch_scale"]),
            np.degrees(out[:, 5]) * (1.0 + e["pitch_rate_scale"]),
            (up - tilt * felt) * (1.0 + e["vertical_scale"]),
        )
    )
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
            for j in range(columns.start, columns.stop):
                y[:, j] = np.interp(late, np.arange(model.samples), y[:, j])
        if lag > 0.0:
            keep = np.exp(-dt / lag)
            y[:, columns] = lfilter(
                [1.0 - keep], [1.0, -keep], y[:, columns], axis=0, zi=keep * y[:1, columns]
            )[0]
    return y


def predict(
    model: RunModel, theta: NDArray[np.float64], *, slots: tuple[Slot, ...] = (), substeps: int = SUBSTEPS
) -> NDArray[np.float64]:
    """Predicted channels of a run, float64 [samples, 7]; arguments as in `roll`."""
    return instruments(model, theta, roll(model, theta, slots=slots, substeps=substeps)[0])
