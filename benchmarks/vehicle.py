"""The vehicle model on one thread: rollouts per CPU-second, beside the NumPy twin and what was asked for.

``python -m benchmarks.vehicle``
"""

from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from catalogs.entries import load
from catalogs.studies import Condition
from studies.paper.stop_curves import sensitivity_study
from studies.paper.vehicle_modes import simulate_condition
from studies.peers import reference
from tasks.campaign.campaign import CHANNELS, Run
from tasks.identification.inference.forward import prepare_run, simulate_run
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.paper.wheels import build_wheels, simulate_stop
from tasks.vehicle.parameters import Vehicle, compute_surface_response
from tasks.vehicle.rollout import INTERNAL_STEP_S

STOPS_PER_CPU_S = 3000.0
COUPLED_LIMIT_MS = 6.0
INFERENCE_LIMIT_MS = 1.2
STUDY_LIMIT_S = 3.0
FLAT_SURFACES = (
    ("dry", 0.82), ("rain", 0.595585), ("rain", 0.43415), ("rain", 0.369279), ("rain", 0.347126),
    ("snow", 0.51), ("snow", 0.42), ("snow", 0.24),
)  # fmt: skip
"""Tyre families and friction of the paper's flat development conditions."""
LONGEST_STOP = ("snow", 0.24)
SPEED = 60 / 3.6
INFERENCE_PRESSURE_MPA = 0.8
LONGEST = 100_000
TWIN_STEPS = 200


def measure_rows() -> list[dict[str, Any]]:
    """Measure stops, logged rollouts and the sensitivity study.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    vehicle, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
    result = _stop_rows(vehicle)
    conditions = {condition.name: condition for condition in load("list of conditions")}
    for name in ("flat-dry", "hump-dry"):
        result += _rollout_rows(conditions[name])
    result.append(_inference_row(vehicle, surface))
    protocol, _ = load("sensitivity study")
    study_s = least_cpu_s(lambda: sensitivity_study(vehicle, surface, protocol), repeats=3)
    limit = f"limit {STUDY_LIMIT_S:g} CPU-s"
    result.append(make_row("sensitivity study, 4,434 stops", study_s, "CPU-s", limit, STUDY_LIMIT_S))
    return result


def _stop_rows(vehicle: Vehicle) -> list[dict[str, Any]]:
    """Stops from 60 km/h in paper mode, nothing logged: the nine flat development conditions, and one a surface."""
    brake = BrakeCommand(
        peak_pressure_mpa=2.3, ramp_s=0.5, onset_s=0.0, onset_station_m=None, hold_s=None, release_s=0.0
    ).profile
    wheels = build_wheels(vehicle)
    tyres = {surface: compute_surface_response(vehicle, *surface).tyre for surface in FLAT_SURFACES}

    def stop_s(*surfaces: tuple[str, float]) -> float:
        def work() -> None:
            for _ in range(20):
                for surface in surfaces:
                    simulate_stop(SPEED, INTERNAL_STEP_S, LONGEST, brake, wheels, tyres[surface])

        return least_cpu_s(work) / 20 / len(surfaces)

    asked = f"asked {STOPS_PER_CPU_S:g}"
    mean = 1 / stop_s(*FLAT_SURFACES, LONGEST_STOP)  # snow 2 and snow 3 are the same surface
    result = [make_row("stops, paper mode, nine surfaces", mean, "1/CPU-s", asked, STOPS_PER_CPU_S)]
    for surface in (FLAT_SURFACES[0], ("rain", 0.347126), LONGEST_STOP):
        rate = 1 / stop_s(surface)
        result.append(
            make_row("stops, paper mode, {} {:g}".format(*surface), rate, "1/CPU-s", asked, STOPS_PER_CPU_S)
        )
    seconds = simulate_stop(SPEED, INTERNAL_STEP_S, LONGEST, brake, wheels, tyres[LONGEST_STOP])[1]
    twin_s = _twin_step_s(vehicle) * ceil(seconds / INTERNAL_STEP_S)
    name = "stops, paper mode, {} {:g}".format(*LONGEST_STOP)
    return [*result, make_row(name, rate, "1/CPU-s", "NumPy twin", 1 / twin_s)]


def _twin_step_s(vehicle: Vehicle) -> float:
    """CPU time of one step of the NumPy twin [CPU-s]."""
    still = replace(vehicle, coast_deceleration=0.0)
    response = compute_surface_response(still, *LONGEST_STOP)
    loads = np.array(still.static_axle_loads)

    def run() -> None:
        reference.simulate_paper_drive(
            still, LONGEST_STOP[0], response,
            reference.ReferenceDrive(
                initial_speed=SPEED, pressure=lambda t: 2.3 * min(t / 0.5, 1.0), loads=lambda n, a: loads,
                hazard=FLAT_ROAD,
            ),
            steps=TWIN_STEPS, step=INTERNAL_STEP_S,
        )  # fmt: skip

    return least_cpu_s(run, repeats=3) / TWIN_STEPS


def _rollout_rows(condition: Condition) -> list[dict[str, Any]]:
    """Logged 10 s rollouts of one condition in both modes."""
    vehicle, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
    paper_ms, coupled_ms = (
        1000 * least_cpu_s(lambda mode=mode: simulate_condition(vehicle, surface, condition.scenario, mode))
        for mode in ("paper", "coupled")
    )
    limit = f"limit {COUPLED_LIMIT_MS:g} CPU-ms"
    return [
        make_row(f"10 s rollout, coupled, {condition.name}", coupled_ms, "CPU-ms", limit, COUPLED_LIMIT_MS),
        make_row(f"10 s rollout, paper, {condition.name}", paper_ms, "CPU-ms", "coupled", coupled_ms),
    ]


def _inference_row(vehicle: Vehicle, surface: SurfaceParameters) -> dict[str, Any]:
    """One run as a fit simulates it: braked from 60 km/h by a pressure trace of 6 s, sampled each 10 ms."""
    time = np.arange(601) * 0.01
    response = np.zeros((len(time), len(CHANNELS)))
    response[:, CHANNELS.index("speed")] = SPEED
    run = Run(
        name="run", held_out=False, weather="dry", precipitation_mm_h=0.0, snow_accumulation_h=0.0, direction=1,
        disc_rise=20.0, hazard_center=0.0, hazard_length=0.0, hazard_height=0.0, interval=0.01,
        pressure=np.clip((time - 1.0) / 0.3, 0.0, 1.0) * INFERENCE_PRESSURE_MPA, response=response,
    )  # fmt: skip
    model, theta = prepare_run(run, vehicle, surface), build_parameter_vector({})

    def work() -> None:
        for _ in range(20):
            simulate_run(model, theta)

    limit = f"limit {INFERENCE_LIMIT_MS:g} CPU-ms"
    return make_row(
        "6 s run for inference", 1000 * least_cpu_s(work) / 20, "CPU-ms", limit, INFERENCE_LIMIT_MS
    )


if __name__ == "__main__":
    print_rows(measure_rows())
