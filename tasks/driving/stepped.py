"""The coupled model driven step by step: the pressure of each step is given when the step begins.

The brake has the pressure a millisecond after it is given, and goes to it in the second half of that. `trace_pressures`
writes this down, and the rollout of that trace is the stepped drive bit for bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.surface.road_profile import FLAT_ROAD, LEVEL_ROAD, RoadGrade, RoadHazard
from tasks.surface.state import SurfaceState
from tasks.vehicle.history import History
from tasks.vehicle.model.brake_input import make_trace_input
from tasks.vehicle.model.chassis import Conditions
from tasks.vehicle.model.simulation import COLUMN, COLUMNS, Recording, simulate
from tasks.vehicle.parameters import Vehicle, compute_surface_response
from tasks.vehicle.rollout import INTERNAL_STEP_S, Rollout, describe_rollout

TICKS_PER_S = 1000
PER_TICK = 2
"""Internal steps of a tick [1]."""
LATE = 2
"""Internal steps after which the brake has the pressure that is given [1]."""
HIGHEST_PRESSURE_MPA = 50.0


def count_ticks(rate_hz: float) -> int:
    """Return the ticks of a step [1].

    Parameters
    ----------
    rate_hz : of the steps [Hz]

    Raises
    ------
    InputError
        If a step would not be whole milliseconds, 1 to 1000 of them.
    """
    ticks = round(TICKS_PER_S / rate_hz) if isfinite(rate_hz) and 1 <= rate_hz <= TICKS_PER_S else 0
    if ticks == 0 or abs(ticks * rate_hz - TICKS_PER_S) > 1e-9:
        raise InputError(
            f"rate_hz must give steps of whole milliseconds, such as 20, 25, 50 or 100; it is {rate_hz:g}"
        )
    return ticks


def trace_pressures(
    pressures: Sequence[float] | NDArray[np.float64], ticks_per_step: int
) -> NDArray[np.float64]:
    """Return the pressure at the internal steps of a drive, float64 [N] [MPa].

    Parameters
    ----------
    pressures : of the steps [MPa]
    ticks_per_step : ticks of a step [1]
    """
    given = np.repeat(np.asarray(pressures, np.float64), PER_TICK * ticks_per_step)
    return np.concatenate([np.zeros(LATE), given])


@dataclass(frozen=True, kw_only=True)
class DriveSettings:
    """What a drive by steps is given beside car and surface.

    Parameters
    ----------
    initial_speed : [m/s]
    duration_s : length of the drive, whole steps [s]
    rate_hz : of the steps [Hz]
    hold_speed : keep the speed until a pressure above 0 is given
    hazard : road feature
    grade : of the road

    Raises
    ------
    InputError
        For a rate, a duration or a speed that is none.
    """

    initial_speed: float
    duration_s: float
    rate_hz: float
    hold_speed: bool = False
    hazard: RoadHazard = FLAT_ROAD
    grade: RoadGrade = LEVEL_ROAD

    def __post_init__(self) -> None:
        step, ticks, problems = self.ticks_per_step, self.ticks, []
        if ticks <= 0 or ticks % step or abs(ticks - self.duration_s * TICKS_PER_S) > 1e-6:
            problems.append(
                f"duration_s must be whole steps of {step / TICKS_PER_S:g} s; it is {self.duration_s:g}"
            )
        if not (isfinite(self.initial_speed) and self.initial_speed > 0):
            problems.append(f"initial_speed must be a positive number of m/s; it is {self.initial_speed}")
        if problems:
            raise InputError(problems)

    @property
    def ticks_per_step(self) -> int:
        """Milliseconds of a step [1]."""
        return count_ticks(self.rate_hz)

    @property
    def ticks(self) -> int:
        """Milliseconds of the drive [1]."""
        return round(self.duration_s * TICKS_PER_S) if isfinite(self.duration_s) else 0

    def set_conditions(self, surface: SurfaceState) -> Conditions:
        """Return the conditions of the drive on a surface."""
        return Conditions(
            hazard=self.hazard, snow_depth_mm=surface.snow_depth_mm, grade=self.grade, grip=surface.grip
        )


class SteppedDrive:
    """A drive of the coupled model whose brake is commanded step by step.

    Parameters
    ----------
    vehicle : the vehicle
    surface : kind of weather, friction and how it depends on speed, snow
    settings : the drive
    """

    def __init__(self, vehicle: Vehicle, surface: SurfaceState, settings: DriveSettings) -> None:
        self.ticks_per_step = settings.ticks_per_step
        self.steps = settings.ticks // self.ticks_per_step
        self._vehicle, self._surface, self._settings = vehicle, surface, settings
        self._response = compute_surface_response(vehicle, surface.kind, surface.friction)
        self._conditions = settings.set_conditions(surface)
        self._trace = np.empty(LATE + PER_TICK * settings.ticks)
        self._history = np.empty((settings.ticks + 1, len(COLUMNS)))
        self.begin()

    def begin(self) -> None:
        """Put the car to the start: its wheels roll and its body is at rest."""
        self.step_count, self._stop, self._held = 0, inf, self._settings.hold_speed
        self._trace[:LATE] = 0.0
        run = simulate(
            self._vehicle, self._response,
            make_trace_input(self._trace[:LATE], INTERNAL_STEP_S)._replace(hold_speed=self._held), self._conditions,
            Recording(samples=1, interval=1 / TICKS_PER_S, substeps=PER_TICK, keep_states=True),
            initial_speed=self._settings.initial_speed,
        )  # fmt: skip
        self._state, self._history[0] = run.states[0], run.history[0]

    def advance(self, pressure_mpa: float, steps: int = 1) -> None:
        """Drive one step, or several at one pressure.

        Parameters
        ----------
        pressure_mpa : that the brake is given when the step begins [MPa]
        steps : how many, at least 1

        Raises
        ------
        InputError
            For a pressure that no brake has, or a drive that has ended.
        """
        if self.step_count + steps > self.steps:
            raise InputError(f"the drive has ended after {self._settings.duration_s:g} s: begin anew")
        if not 0.0 <= pressure_mpa <= HIGHEST_PRESSURE_MPA:  # a NaN too
            raise InputError(
                f"brake pressure must be a number within 0 to {HIGHEST_PRESSURE_MPA:g} MPa; it is {pressure_mpa}"
            )
        self._held = self._held and pressure_mpa == 0.0
        first, ticks = self.step_count * self.ticks_per_step, steps * self.ticks_per_step
        known = LATE + PER_TICK * (first + ticks)
        self._trace[known - PER_TICK * ticks : known] = pressure_mpa
        run = simulate(
            self._vehicle, self._response,
            make_trace_input(self._trace[:known], INTERNAL_STEP_S)._replace(hold_speed=self._held), self._conditions,
            Recording(
                samples=ticks + 1, interval=1 / TICKS_PER_S, substeps=PER_TICK, keep_states=True
            ),
            start=self._state,
        )  # fmt: skip
        self._history[first : first + ticks + 1] = run.history
        self._state, self._stop = run.states[-1], run.stop
        self.step_count += steps

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self.step_count * self.ticks_per_step / TICKS_PER_S

    @property
    def stop_time(self) -> float:
        """When the car came to rest; infinite before [s]."""
        return self._stop

    def read(self, name: str) -> float:
        """Return the present value of one of `COLUMNS` [its unit]."""
        return float(self._history[self.step_count * self.ticks_per_step, COLUMN[name]])

    def read_column(self, name: str) -> NDArray[np.float64]:
        """Return the values of one of `COLUMNS` at all ticks so far [its unit]."""
        return self._history[: self.step_count * self.ticks_per_step + 1, COLUMN[name]]

    def describe(self) -> Rollout:
        """Return the telemetry of a drive that has ended."""
        columns = {name: self._history[:, i].copy() for name, i in COLUMN.items()}
        return _describe_drive(self._vehicle, self._surface, self._settings, columns, self._stop)


def simulate_pressures(
    vehicle: Vehicle,
    surface: SurfaceState,
    settings: DriveSettings,
    pressures: Sequence[float] | NDArray[np.float64],
) -> Rollout:
    """Simulate the drive in which each step has its pressure: that of `SteppedDrive`, in one call.

    Parameters
    ----------
    vehicle, surface, settings : as of `SteppedDrive`
    pressures : of the steps [MPa]
    """
    per_step, braked = settings.ticks_per_step, np.flatnonzero(np.asarray(pressures) > 0)
    # half a step early: time is a whole number of steps, but for rounding
    onset = (PER_TICK * per_step * int(braked[0]) - 0.5) * INTERNAL_STEP_S if braked.size else inf
    drive = make_trace_input(trace_pressures(pressures, per_step), INTERNAL_STEP_S)
    run = simulate(
        vehicle, compute_surface_response(vehicle, surface.kind, surface.friction),
        drive._replace(hold_speed=settings.hold_speed, profile=drive.profile._replace(onset_time=onset)),
        settings.set_conditions(surface),
        Recording(samples=settings.ticks + 1, interval=1 / TICKS_PER_S, substeps=PER_TICK),
        initial_speed=settings.initial_speed,
    )  # fmt: skip
    columns = dict(zip(COLUMNS, run.history.T.copy(), strict=True))
    return _describe_drive(vehicle, surface, settings, columns, run.stop)


def _describe_drive(
    vehicle: Vehicle, surface: SurfaceState, settings: DriveSettings, columns: dict[str, NDArray[np.float64]],
    stop: float,
) -> Rollout:  # fmt: skip
    """Return the telemetry of a drive by pressures; the brake's onset is the last tick before there is any."""
    pressed = np.flatnonzero(columns["brake_pressure_mpa"] > 0)
    first = max(int(pressed[0]) - 1, 0) if pressed.size else 0
    onset = first / TICKS_PER_S if pressed.size else inf
    history = History(
        columns=columns, onset=onset, onset_station=float(columns["station"][first]), stop_time=stop
    )
    return describe_rollout(
        history, vehicle, compute_surface_response(vehicle, surface.kind, surface.friction), surface.friction,
        mode="coupled", duration_s=settings.duration_s, grade=settings.grade,
    )  # fmt: skip
