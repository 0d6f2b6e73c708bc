"""Paper and coupled mode on the paper's 19 + 12 conditions: ``python -m studies.paper.vehicle_modes``.

Prints the table of docs/explanation/vehicle-modes.md.
"""

from dataclasses import dataclass
from math import isnan

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.scenario import Scenario
from tasks.surface.road_profile import RoadHazard
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Controls, Mode, Rollout, simulate_scenario

DURATION_S = 10.0
AFTER_STOP_S = 1.0
SLIP_SPEED = 0.5
"""Slip is compared above this speed, as in the paper's Appendix A.2 [m/s]."""
HEADER = (
    "condition", "stop paper [m]", "stop coupled [m]", "speed RMSE [m/s]", "pitch RMSE [deg]",
    "peak pitch paper [deg]", "peak pitch coupled [deg]", "slip RMSE", "wheel load RMSE [N]",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ModeDifference:
    """Coupled beside paper mode; NaN where the scenario has no stop.

    Parameters
    ----------
    stop_paper, stop_coupled : stopping distances [m]
    speed_rmse : [m/s]
    pitch_rmse_deg : [deg]
    peak_pitch_paper_deg, peak_pitch_coupled_deg : largest nose-down pitch [deg]
    slip_rmse : mean of the axles [1]
    wheel_load_rmse : of one wheel, mean of the axles [N]
    """

    stop_paper: float
    stop_coupled: float
    speed_rmse: float
    pitch_rmse_deg: float
    peak_pitch_paper_deg: float
    peak_pitch_coupled_deg: float
    slip_rmse: float
    wheel_load_rmse: float


def mode_difference(paper: Rollout, coupled: Rollout) -> ModeDifference:
    """Compare two rollouts of one scenario from the brake onset to a second after the later stop.

    Without a brake the comparison begins with the clip, without a stop it ends with it.

    Parameters
    ----------
    paper, coupled : the same scenario and duration in each mode
    """
    time = paper.columns["t_ns"] * 1e-9
    begin = np.nan_to_num(paper.brake_onset_time, nan=0.0)
    end = max(paper.stop_time, coupled.stop_time) + AFTER_STOP_S
    window = (time >= begin) & ~(time > end)
    moving = window & (np.minimum(paper.columns["speed"], coupled.columns["speed"]) > SLIP_SPEED)

    def rmse(name: str, rows: NDArray[np.bool_]) -> float:
        return float(np.sqrt(np.mean((paper.columns[name] - coupled.columns[name])[rows] ** 2)))

    return ModeDifference(
        stop_paper=paper.stopping_distance,
        stop_coupled=coupled.stopping_distance,
        speed_rmse=rmse("speed", window),
        pitch_rmse_deg=float(np.degrees(rmse("pitch", window))),
        peak_pitch_paper_deg=float(np.degrees(paper.columns["pitch"].max())),
        peak_pitch_coupled_deg=float(np.degrees(coupled.columns["pitch"].max())),
        slip_rmse=(rmse("braking_slip_f", moving) + rmse("braking_slip_r", moving)) / 2,
        wheel_load_rmse=(rmse("axle_load_f", window) + rmse("axle_load_r", window)) / 4,
    )


def compute_differences() -> dict[str, ModeDifference]:
    """The modes' difference on each condition, by its name."""
    vehicle, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
    return {
        condition.name: mode_difference(
            simulate_condition(vehicle, surface, condition.scenario, "paper"),
            simulate_condition(vehicle, surface, condition.scenario, "coupled"),
        )
        for condition in load("list of conditions")
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
