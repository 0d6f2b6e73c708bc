"""Paper and coupled mode beside each other on the paper's 19 + 12 conditions: ``python -m benchmarks.vehicle_modes``.

Prints the table of docs/explanation/vehicle-modes.md.
"""

from math import isnan

from catalogs.entries import load
from catalogs.scenario import Scenario
from catalogs.studies import load_conditions
from tasks.studies.mode_comparison import ModeDifference, mode_difference
from tasks.surface.road_profile import RoadHazard
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Controls, Mode, Rollout, simulate_scenario

DURATION_S = 10.0
HEADER = (
    "condition", "stop paper [m]", "stop coupled [m]", "speed RMSE [m/s]", "pitch RMSE [deg]",
    "peak pitch paper [deg]", "peak pitch coupled [deg]", "slip RMSE", "wheel load RMSE [N]",
)  # fmt: skip


def compute_differences() -> dict[str, ModeDifference]:
    """The modes' difference on each condition, by its name."""
    vehicle, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
    return {
        condition.name: mode_difference(
            simulate_condition(vehicle, surface, condition.scenario, "paper"),
            simulate_condition(vehicle, surface, condition.scenario, "coupled"),
        )
        for condition in load_conditions()
    }


def simulate_condition(
    vehicle: Vehicle, surface: SurfaceParameters, scenario: Scenario, mode: Mode
) -> Rollout:
    """One condition in one mode; where it brakes, the speed is held until then."""
    weather = Weather(
        kind=scenario.weather,
        precipitation_mm_h=scenario.precipitation_mm_h,
        snow_accumulation_h=scenario.snow_accumulation_h,
    )
    brake = BrakeCommand(
        peak_pressure_mpa=scenario.peak_pressure_mpa,
        ramp_s=scenario.ramp_s,
        onset_s=scenario.brake_onset_s,
        onset_station_m=scenario.brake_onset_m,
        hold_s=scenario.hold_s,
        release_s=scenario.release_s,
    )
    return simulate_scenario(
        vehicle,
        surface_state(weather, surface),
        Controls(
            initial_speed=scenario.initial_speed_km_h / 3.6,
            brake=brake,
            hold_speed_until_brake=scenario.peak_pressure_mpa > 0,
        ),
        RoadHazard(
            center_m=scenario.hazard_center_m,
            length_m=scenario.hazard_length_m,
            height_m=scenario.hazard_height_m,
        ),
        mode=mode,
        duration_s=DURATION_S,
    )


def format_table(rows: dict[str, ModeDifference]) -> list[str]:
    """The differences as lines of a Markdown table."""
    digits = (2, 2, 3, 3, 2, 2, 4, 1)
    lines = ["| " + " | ".join(HEADER) + " |", "| --- |" + " ---: |" * len(digits)]
    for name, row in rows.items():
        values = (
            "-" if isnan(value) else f"{value:.{places}f}"
            for value, places in zip(vars(row).values(), digits, strict=True)
        )
        lines.append(f"| {name} | " + " | ".join(values) + " |")
    return lines


if __name__ == "__main__":
    print("\n".join(format_table(compute_differences())))
