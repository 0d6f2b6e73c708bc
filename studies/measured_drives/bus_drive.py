"""Synthetic drives as a production car's bus would log them, driven by the coupled rollout."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.measured_drives.brake_dive import DiveModel, with_model
from tasks.campaign.channels import CHANNELS_BY_NAME, unit_factor
from tasks.campaign.signals import Signal
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.surface.weather import DRY
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.half_car import build_half_car, integrate_half_car
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Controls, simulate_scenario

STEP = 0.001
LEAD_S = 3.0
"""Rolling at the start speed before each event."""
SETTLING_S = 2.5
"""After each event, so that the body has come to rest when the next stretch is joined on."""
PULL_AWAY = 1.5
"""Largest acceleration between events [m/s^2]."""

Columns = dict[str, NDArray[np.float64]]
Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class BusSignal:
    """One signal of the bus.

    Parameters
    ----------
    name : on the bus
    channel : what it carries
    unit : on the bus
    rate_hz : [Hz]
    resolution : smallest step [unit]
    noise : standard deviation before rounding [unit]
    """

    name: str
    channel: str
    unit: str
    rate_hz: float
    resolution: float
    noise: float


@dataclass(frozen=True, kw_only=True)
class DriveStyle:
    """How the car is driven; ranges are smallest and largest.

    Parameters
    ----------
    start_speed : [m/s]
    peak_pressure : [MPa]
    ramp, hold, release : of the brake pressure [s]
    curve_share : of the events that are in a turn [1]
    rough_share : on rough road [1]
    dragging_share : with the brake lightly on before [1]
    lift_share : with the foot coming off the throttle just before the brake [1]
    slope : amplitude of the road's slow slope [deg]
    """

    start_speed: Range
    peak_pressure: Range
    ramp: Range
    hold: Range
    release: Range
    curve_share: float
    rough_share: float
    dragging_share: float
    lift_share: float
    slope: float


@dataclass(frozen=True, kw_only=True)
class Bus:
    """A car and the signals that its bus sends.

    Parameters
    ----------
    truth : effective parameters of the car; its pitch gain is made by the rollout's physics
    style : how it is driven
    signals : of the bus
    """

    truth: DiveModel
    style: DriveStyle
    signals: tuple[BusSignal, ...]


def bus_drive(
    vehicle: Vehicle, friction: float, bus: Bus, *, events: int, seed: int, drive: int
) -> dict[str, Signal]:
    """One drive's signals, each on its own clock in its own unit.

    Parameters
    ----------
    vehicle : to start from; the bus's truth is laid over it
    friction : mu_c of the dry road [1]
    bus : car, style and signals
    events : brake applications
    seed, drive : key of the drive's randomness
    """
    motion = drive_motion(vehicle, friction, bus, events=events, seed=seed, drive=drive)
    time = np.arange(len(motion["speed"])) * STEP
    signals = {}
    for i, signal in enumerate(bus.signals):
        rng = np.random.Generator(
            np.random.Philox(key=np.array([seed, (drive << 16) + 100 + i], dtype=np.uint64))
        )
        # the bus's own phase: no two signals are sampled at one instant
        clock = np.arange(i * STEP, time[-1], 1.0 / signal.rate_hz)
        factor = unit_factor(CHANNELS_BY_NAME[signal.channel].unit, signal.unit)
        values = np.interp(clock, time, motion[signal.channel]) * factor
        noisy = values + signal.noise * rng.standard_normal(len(clock))
        if signal.channel in ("brake_pressure", "speed"):
            noisy = np.maximum(noisy, 0.0)
        rounded = np.round(noisy / signal.resolution) * signal.resolution
        signals[signal.name] = Signal(time=clock, values=rounded, unit=signal.unit)
    return signals


def drive_motion(
    vehicle: Vehicle, friction: float, bus: Bus, *, events: int, seed: int, drive: int
) -> Columns:
    """True motion of a drive at 1 kHz: rolling, braking, settling and pulling away, over and over.

    Parameters are those of `bus_drive`; columns are in campaign units.
    """
    rng = np.random.Generator(np.random.Philox(key=np.array([seed, drive << 16], dtype=np.uint64)))
    style, car = bus.style, replace(with_model(vehicle, bus.truth), brake_gain=bus.truth.brake_gain)
    pieces: list[Columns] = []
    speed = 0.0
    for _ in range(events):
        start = float(rng.uniform(*style.start_speed))
        pieces.append(_pull_away(car, speed, start))
        piece = _braking(car, friction, start, style, rng)
        pieces.append(piece)
        speed = float(piece["speed"][-1])
    motion = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    return _on_road(motion, style, rng)


def _braking(
    car: Vehicle, friction: float, start: float, style: DriveStyle, rng: np.random.Generator
) -> Columns:
    spans = (style.peak_pressure, style.ramp, style.hold, style.release)
    peak, ramp, hold, release = (float(rng.uniform(*span)) for span in spans)
    shares = (style.curve_share, style.rough_share, style.dragging_share, style.lift_share)
    curved, rough, dragging, lifted = rng.random(4) < shares
    command = BrakeCommand(
        peak_pressure_mpa=peak,
        ramp_s=ramp,
        onset_s=LEAD_S,
        onset_station_m=None,
        hold_s=hold,
        release_s=release,
    )
    controls = Controls(initial_speed=start, brake=command, hold_speed_until_brake=True)
    duration = round(LEAD_S + ramp + hold + release + SETTLING_S, 3)
    dry = SurfaceState(kind=DRY, friction=friction)
    ride = simulate_scenario(car, dry, controls, FLAT_ROAD, mode="coupled", duration_s=duration).columns
    count = len(ride["speed"]) - 1
    turning = _bump(count) if curved else np.zeros(count)
    side = float(rng.choice((-1.0, 1.0)))
    lift = _answer(car, _lift_off(count, float(rng.uniform(0.3, 1.2))) if lifted else np.zeros(count))
    motion = {
        "brake_pressure": ride["brake_pressure_mpa"][:count] + (0.1 if dragging else 0.0),
        "speed": ride["speed"][:count],
        "longitudinal_acceleration": ride["longitudinal_acceleration"][:count],
        "pitch": np.degrees(ride["pitch"][:count]),
        "pitch_rate": np.degrees(ride["pitch_rate"][:count]),
        "vertical_acceleration": np.gradient(ride["heave_rate"][:count], STEP)
        + _rumble(count, 1.0 if rough else 0.15, rng),
        "roll_rate": side * 3.0 * np.gradient(turning, STEP) + _rumble(count, 0.6 if rough else 0.15, rng),
        "yaw_rate": side * 8.0 * turning,
        "steering_angle": side * 40.0 * turning,
    }
    # the body answers linearly, so the lift's answer adds to the brake's
    return motion | {name: np.maximum(motion[name] + x, 0.0) if name == "speed" else motion[name] + x
                     for name, x in lift.items()}  # fmt: skip


def _lift_off(count: int, size: float) -> NDArray[np.float64]:
    """A pulse of deceleration that ends with the brake's onset [m/s^2]."""
    width, onset = round(0.6 / STEP), round(LEAD_S / STEP)
    pulse = np.zeros(count)
    pulse[onset - width : onset] = -size * _bump(width)
    return pulse


def _pull_away(car: Vehicle, start: float, end: float) -> Columns:
    """From one speed to another by a smooth pulse of acceleration, with the body's answer to it."""
    count = max(round(2.0 * abs(end - start) / PULL_AWAY / STEP), 1000)
    pulse = _bump(count)
    acceleration = (end - start) * pulse / (pulse.sum() * STEP)
    still = np.zeros(count)
    return {
        "brake_pressure": still,
        "roll_rate": still,
        "yaw_rate": still,
        "steering_angle": still,
    } | _answer(car, acceleration, start)


def _answer(car: Vehicle, acceleration: NDArray[np.float64], start: float = 0.0) -> Columns:
    """Speed and body motion of a car that accelerates by its engine [m/s^2] from a speed [m/s]."""
    moment = -car.sprung_mass * car.cg_height * acceleration
    flat = np.zeros(len(acceleration))
    states = integrate_half_car(flat, flat, moment, STEP, build_half_car(car))
    return {
        "speed": start + np.cumsum(acceleration) * STEP,
        "longitudinal_acceleration": acceleration,
        "pitch": np.degrees(states[:, 1]),
        "pitch_rate": np.degrees(states[:, 5]),
        "vertical_acceleration": np.gradient(states[:, 4], STEP),
    }


def _on_road(motion: Columns, style: DriveStyle, rng: np.random.Generator) -> Columns:
    """The same motion on a road whose slope drifts: pitch shows it and the accelerometer feels it."""
    station = np.cumsum(motion["speed"]) * STEP
    slope = np.zeros(len(station))
    for _ in range(4):
        length, phase = float(rng.uniform(60.0, 400.0)), float(rng.uniform(0.0, 2.0 * np.pi))
        slope += 0.5 * style.slope * np.sin(2.0 * np.pi * station / length + phase)
    return motion | {
        "pitch": motion["pitch"] + slope,
        "pitch_rate": motion["pitch_rate"] + np.gradient(slope, STEP),
        "longitudinal_acceleration": motion["longitudinal_acceleration"] - 9.81 * np.sin(np.radians(slope)),
    }


def _bump(count: int) -> NDArray[np.float64]:
    return 0.5 * (1.0 - np.cos(2.0 * np.pi * np.arange(count) / count))


def _rumble(count: int, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Noise of the road below some 10 Hz with the given standard deviation, at rest at both ends."""
    width = 50
    smooth = np.convolve(
        rng.standard_normal(count + width - 1), np.ones(width) / np.sqrt(width), mode="valid"
    )
    return size * smooth * np.minimum(1.0, 10.0 * _bump(count))
