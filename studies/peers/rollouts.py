"""One braking run in the model beside SciPy's solvers, in one run: ``python -m studies.peers.rollouts``.

Coupled mode, dry and flat, 60 km/h, braked from the first second on, until shortly before the stop. The solvers get
the same equations and the same times of the log; each is asked for the loosest tolerance by which its error is no
larger than the model's. The truth is SciPy's Radau at a tolerance of 1e-11, in pieces between the corners of the brake
command.
"""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from catalogs.entries import load
from studies.peers import reference
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.model.chassis import Chassis, Conditions, build_chassis
from tasks.vehicle.model.ports import compute_ports
from tasks.vehicle.model.states import AxleMemory, Instant, Memory, Motion
from tasks.vehicle.model.step import compute_body_rates, compute_motion_rates
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.road import RoadFeature, make_road_feature
from tasks.vehicle.rollout import Controls, simulate_scenario
from tasks.vehicle.tyres.contract import Tyre

Array = NDArray[np.float64]
FAMILY, FRICTION, SPEED, PEAK_MPA = "dry", 0.82, 60 / 3.6, 2.3
CORNERS = (0.0, 1.0, 1.5, 3.0)
"""Begin, brake onset, end of the ramp, and end [s]."""
TICKS = np.arange(3001) * 1e-3
COMPARED = ("speed", "station", "wheel_speed_f", "wheel_speed_r", "heave", "pitch")
"""The first states, in the order of the equations; the error is that of the station."""
TOLERANCES = tuple(10.0 ** (-power / 4) for power in range(12, 41))
"""Relative ones that are tried, a quarter of a decade apart [1]."""
METHODS = ("RK45", "LSODA", "Radau")


@njit(cache=True, error_model="numpy")
def compute_rates(time: float, y: Array, chassis: Chassis, tyre: Tyre, road: RoadFeature) -> Array:
    """Return the rates of speed, station, wheel speeds and half-car state, by the model's own functions.

    Parameters
    ----------
    time : [s]
    y : state
    chassis, tyre, road : the vehicle on its surface
    """
    pressure = 2.3 * min(max(time - 1.0, 0.0) / 0.5, 1.0)
    still = AxleMemory(0.0, 0.0, 0.0)
    motion = Motion(y[1], y[0], y[2], y[3])
    x = (y[4], y[5], y[6], y[7], y[8], y[9], y[10], y[11])
    instant = Instant(time, pressure, 0.0, 0.0, False, False, 0.0, 0.0)
    ports = compute_ports(motion, Memory(still, still), x, instant, 1.0, 1.0, 1.0, None, chassis, tyre, road)
    rates = compute_motion_rates(motion, ports, False, chassis)
    body = compute_body_rates(x, ports, chassis)
    return np.array(
        [rates.speed, rates.station, rates.omega_f, rates.omega_r,
         body[0], body[1], body[2], body[3], body[4], body[5], body[6], body[7]]
    )  # fmt: skip


def measure_rows() -> list[dict[str, Any]]:
    """Measure the run in the model and in SciPy.

    Returns
    -------
    Rows of name, value, unit, peer (the model) and ratio (value over the model's value).
    """
    vehicle = load("vehicle", "paper-reference")
    response = compute_surface_response(vehicle, FAMILY, FRICTION)
    on_road = (build_chassis(vehicle, response, Conditions()), response.tyre, make_road_feature(FLAT_ROAD))
    omega = SPEED / vehicle.wheel_radius
    start = np.array([SPEED, 0.0, omega, omega, *np.zeros(8)])

    def compiled(time: float, y: Array) -> Array:
        return compute_rates(time, y, *on_road)

    def in_numpy(time: float, y: Array) -> Array:
        pressure = PEAK_MPA * min(max(time - 1.0, 0.0) / 0.5, 1.0)
        return reference.compute_coupled_rates(y, pressure, vehicle, FAMILY, response, FLAT_ROAD)

    truth = solve_pieces(compiled, start, "Radau", 1e-11)

    def simulate() -> Array:
        columns = simulate_scenario(
            vehicle, SurfaceState(kind=FAMILY, friction=FRICTION),
            Controls(initial_speed=SPEED, brake=BrakeCommand(
                peak_pressure_mpa=PEAK_MPA, ramp_s=0.5, onset_s=1.0, onset_station_m=None, hold_s=None, release_s=0.5,
            ), hold_speed_until_brake=False),
            FLAT_ROAD, mode="coupled", duration_s=TICKS[-1],
        ).columns  # fmt: skip
        return np.array([columns[name][: len(TICKS)] for name in COMPARED])

    own_error, own_s = measure_error(simulate(), truth), least_cpu_s(simulate)
    name = "muSync, 0.5 ms, 34 columns logged"
    rows = [
        make_row(f"{name}: 3 s run", 1000 * own_s, "CPU-ms"),
        make_row(f"{name}: error of station", 1e6 * own_error, "um"),
    ]
    for method in METHODS:
        tolerance, error = find_tolerance(compiled, start, method, truth, own_error)
        for kind, rates in (("compiled", compiled), ("NumPy", in_numpy)):
            cpu_s = least_cpu_s(partial(solve_pieces, rates, start, method, tolerance), 3)
            name = f"SciPy {method}, {kind}, rtol {tolerance:.1e}"
            rows.append(make_row(f"{name}: 3 s run", 1000 * cpu_s, "CPU-ms", "muSync", 1000 * own_s))
        rows.append(
            make_row(f"SciPy {method}: error of station", 1e6 * error, "um", "muSync", 1e6 * own_error)
        )
    return rows


def solve_pieces(
    rates: Callable[[float, Array], Array], start: Array, method: str, tolerance: float
) -> Array:
    """Return the states at every tick, float64 [12, N]; a solver starts anew at each corner of the brake command.

    Parameters
    ----------
    rates : of time [s] and state
    start : state at 0 s
    method : SciPy's name of it
    tolerance : relative; the absolute one is a thousandth of it
    """
    pieces, state = [], start
    for first, last in pairwise(CORNERS):
        times = TICKS[(first - 1e-9 <= TICKS) & (last + 1e-9 >= TICKS)].clip(first, last)
        solution = solve_ivp(
            rates, (first, last), state, method=method, rtol=tolerance, atol=tolerance * 1e-3, t_eval=times
        )
        state = solution.y[:, -1]
        pieces.append(solution.y[:, : None if last == CORNERS[-1] else -1])
    return np.concatenate(pieces, axis=1)


def find_tolerance(
    rates: Callable[[float, Array], Array], start: Array, method: str, truth: Array, wanted: float
) -> tuple[float, float]:
    """Return the loosest tolerance by which the error is at most that which is wanted, and its error [m].

    Parameters
    ----------
    rates, start, method : as for `solve_pieces`
    truth : states at every tick
    wanted : error [m]
    """
    for tolerance in TOLERANCES:
        error = measure_error(solve_pieces(rates, start, method, tolerance), truth)
        if error <= wanted:
            break
    return tolerance, error


def measure_error(states: Array, truth: Array) -> float:
    """Return the largest error of the station [m]."""
    station = COMPARED.index("station")
    return float(np.abs(states[station] - truth[station]).max())


if __name__ == "__main__":
    print_rows(measure_rows())
