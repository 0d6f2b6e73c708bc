"""The reference vehicle, and scenarios in few words."""

from collections.abc import Callable

import pytest

from catalogs.entries import load
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Controls, Rollout, simulate_scenario

HUMP = RoadHazard(center_m=20.0, length_m=3.7, height_m=0.075)
Drive = Callable[..., Rollout]


@pytest.fixture(scope="session")
def vehicle() -> Vehicle:
    return load("vehicle", "paper-reference")


def command(peak: float = 2.3, *, onset: float | None = 1.0, **changes: float | None) -> BrakeCommand:
    values = {"ramp_s": 0.5, "onset_station_m": None, "hold_s": None, "release_s": 0.5} | changes
    return BrakeCommand(peak_pressure_mpa=peak, onset_s=onset, **values)


@pytest.fixture(scope="session")
def drive(vehicle: Vehicle) -> Drive:
    """Brake from 60 km/h on a dry flat road in paper mode, unless told otherwise."""

    def run(
        family: str = "dry",
        friction: float = 0.82,
        *,
        speed_km_h: float = 60.0,
        brake: BrakeCommand | None = None,
        hazard: RoadHazard = FLAT_ROAD,
        mode: str = "paper",
        duration: float = 10.0,
        hold: bool = False,
        car: Vehicle | None = None,
        step: float = 0.0005,
        steady: SteadyStop | None = None,
    ) -> Rollout:
        controls = Controls(
            initial_speed=speed_km_h / 3.6, brake=brake or command(), hold_speed_until_brake=hold
        )
        return simulate_scenario(
            car or vehicle,
            SurfaceState(kind=family, friction=friction),
            controls,
            hazard,
            mode=mode,
            duration_s=duration,
            step_s=step,
            steady=steady,
        )

    return run
