"""``musync.Simulator``: one drive, step by step, with what a controller sees at each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from catalogs.entries import load
from catalogs.road_users import EGO
from catalogs.scenario import Scenario, find_scenario_problems
from catalogs.sentences import describe_rules, shorten_value
from catalogs.weather.look import load_weather
from flows.driving.view import StepCamera
from flows.making.driving import find_visual_range, hazard_of, surface_of
from flows.making.grid_inputs import grade_of
from tasks.driving.outcome import TICK_S, Outcome, find_unbraked_impact, judge_approach
from tasks.driving.stepped import DriveSettings, SteppedDrive
from tasks.driving.targets import Target, TargetTrack, follow_track, see_targets
from tasks.errors import InputError
from tasks.surface.road_profile import LEVEL_ROAD
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.vehicle.model.simulation import COLUMNS
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Rollout

UNBRAKED = ("peak_pressure_mpa", "brake_onset_s", "brake_onset_m")
"""Fields of a scenario that a drive by steps has no use for: who steps brakes."""
LEVEL_SCENE = "street"
"""Scene of a scenario that names none; it need not be loaded to know its grade."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What a controller sees when a step begins.

    Parameters
    ----------
    time : since the start [s]
    station : way of the front axle since the start [m]
    speed : [m/s]
    acceleration : [m/s2]
    wheel_speed_f, wheel_speed_r : of the axles [rad/s]
    stands : whether the car has come to rest
    ends : whether the drive is over
    targets : road users ahead that the air does not hide, in the order in which they were given
    truth : every column of the model and the friction that the road has, where the truth is asked for [their units]
    look : draws the picture, where the drive has a camera
    """

    time: float
    station: float
    speed: float
    acceleration: float
    wheel_speed_f: float
    wheel_speed_r: float
    stands: bool
    ends: bool
    targets: tuple[Target, ...] = ()
    truth: Mapping[str, float] | None = None
    look: Callable[[], NDArray[np.uint8]] | None = field(default=None, repr=False, compare=False)

    @cached_property
    def frame(self) -> NDArray[np.uint8] | None:
        """The picture, drawn when it is first read, uint8 [H, W, 3] sRGB; None without a camera."""
        return self.look() if self.look else None


class Simulator:
    """One drive of the coupled model, step by step: the same steps give the same bits, on any machine of one kind.

    Parameters
    ----------
    scenario : a `Scenario`, or its fields by name, without the brake's; ``hold_speed`` lasts until the first pressure
    vehicle, surface : names of the catalogue, or files
    rate_hz : of the steps, whole milliseconds each [Hz]
    duration_s : longest drive, whole steps [s]
    targets : tracks of road users ahead, beside the ``objects`` of the scenario
    truth : whether observations have the truth
    camera : name or file of the camera whose picture observations have, in the scenario's scene; None for no pictures

    Raises
    ------
    InputError
        Listing every argument that breaks a rule.
    """

    def __init__(
        self,
        scenario: Scenario | Mapping[str, Any],
        *,
        vehicle: str | Vehicle = "bmw-320i",
        surface: str | SurfaceParameters = "dense-asphalt",
        rate_hz: float = 20.0,
        duration_s: float = 10.0,
        targets: Sequence[TargetTrack] = (),
        truth: bool = False,
        camera: str | None = None,
    ) -> None:
        self.scenario = asked = _check_scenario(scenario)
        car = vehicle if isinstance(vehicle, Vehicle) else load("vehicle", vehicle)
        pavement: SurfaceParameters = (
            surface
            if isinstance(surface, SurfaceParameters)
            else load("wet friction").apply(load("surface", surface))
        )
        state = surface_of(asked, pavement)
        grade = LEVEL_ROAD if asked.scene in (None, LEVEL_SCENE) else grade_of(str(asked.scene))
        self.rate_hz, self._given, self._truth, self._car = float(rate_hz), targets, truth, car
        self._sizes = load("road user sizes")
        self._overhang, _ = self._sizes[EGO]
        self._settings = DriveSettings(
            initial_speed=asked.initial_speed_km_h / 3.6, duration_s=duration_s, rate_hz=rate_hz,
            hold_speed=asked.hold_speed, hazard=hazard_of(asked), grade=grade,
        )  # fmt: skip
        self.take_road(state)
        self._visual_range_m = find_visual_range(state, load_weather()) if self._targets else inf
        self._camera: StepCamera | None = None
        if camera is not None:
            scene = asked.scene or LEVEL_SCENE
            self._camera = StepCamera(
                asked, state, pavement, car, scene=scene, camera=camera, rate_hz=rate_hz
            )

    def take_road(self, state: SurfaceState) -> None:
        """Begin anew on another road, of which pictures and sight know nothing.

        Parameters
        ----------
        state : of the road, whose friction bounds the road users too
        """
        self.state = state
        objects = [
            follow_track(user.build_track(size := user.choose_size(self._sizes)), size, state.friction)
            for user in self.scenario.objects
        ]
        self._targets = (*objects, *self._given)
        self._drive = SteppedDrive(self._car, state, self._settings)

    def reset(self) -> Observation:
        """Begin anew."""
        self._drive.begin()
        return self._observe()

    def step(self, pressure_mpa: float) -> Observation:
        """Drive one step.

        Parameters
        ----------
        pressure_mpa : of the brake from the beginning of the step on [MPa]

        Raises
        ------
        InputError
            For a pressure that no brake has, or a drive that has ended.
        """
        self._drive.advance(float(pressure_mpa))
        return self._observe()

    def describe(self) -> Rollout:
        """Return the telemetry of the drive, which has ended, at 1 kHz."""
        return self._drive.describe()

    def read_column(self, name: str) -> NDArray[np.float64]:
        """Return a column of the model at every millisecond so far [its unit]."""
        return self._drive.read_column(name)

    def judge(self) -> list[Outcome]:
        """Return what became of the approach to each target so far."""
        station, speed, pressure = (
            self.read_column(name) for name in ("station", "speed", "brake_pressure_mpa")
        )
        overhang, width = load("road user sizes")[EGO]
        time = TICK_S * np.arange(len(station), dtype=np.float64)
        bumper = float(station[0]) + overhang
        return [
            judge_approach(
                station, speed, pressure, track.locate(time), overhang=overhang, width=width,
                unbraked_impact=find_unbraked_impact(float(speed[0]), bumper, track, width),
            )
            for track in self._targets
        ]  # fmt: skip

    def _observe(self) -> Observation:
        drive = self._drive
        read, time = drive.read, drive.time
        return Observation(
            time=time, station=read("station"), speed=read("speed"), acceleration=read("longitudinal_acceleration"),
            wheel_speed_f=read("wheel_speed_f"), wheel_speed_r=read("wheel_speed_r"), stands=drive.stop_time <= time,
            ends=drive.step_count == drive.steps,
            targets=see_targets(
                (track.find(time) for track in self._targets), read("station") + self._overhang, self._visual_range_m
            ),
            truth=self._read_truth() if self._truth else None,
            look=self._aim(self._camera) if self._camera else None,
        )  # fmt: skip

    def _aim(self, camera: StepCamera) -> Callable[[], NDArray[np.uint8]]:
        """Return what draws the picture of this instant, however far the drive goes on."""
        now, per_step = self._drive.step_count, self._drive.ticks_per_step
        ticks = [max(now - 1, 0) * per_step, now * per_step]
        return partial(
            camera.see, now, *(self.read_column(name)[ticks] for name in ("station", "heave", "pitch"))
        )

    def _read_truth(self) -> dict[str, float]:
        values = {name: self._drive.read(name) for name in COLUMNS}
        return values | {"surface_friction": self.state.friction, "film_depth_mm": self.state.film_depth_mm}


def _check_scenario(scenario: Scenario | Mapping[str, Any]) -> Scenario:
    if not isinstance(scenario, Scenario):
        known = [field.name for field in fields(Scenario)]
        if unknown := [name for name in scenario if name not in known]:
            raise InputError(
                f"scenario: there is no field {', '.join(map(shorten_value, unknown))}; there are {', '.join(known)}"
            )
        try:
            scenario = Scenario.of(scenario)
        except ValidationError as error:
            raise InputError(describe_rules(error, "scenario: objects")) from None
    plain = Scenario()
    problems = [
        f"scenario: {name} is the controller's, who brakes step by step; it is {getattr(scenario, name)}: leave it out"
        for name in UNBRAKED
        if getattr(scenario, name) != getattr(plain, name)
    ]
    if problems := problems + [f"scenario: {one}" for one in find_scenario_problems(scenario)]:
        raise InputError(problems)
    return scenario
