"""One run of the car, integrated by SciPy: free of its anti-lock controller until a wheel slips too far."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from studies.double_track.brakes import BUILD, NO_CAP, OFF, cap_rates, control_wheel
from studies.double_track.motion import (
    DISC,
    LINE,
    PUSH,
    SPEED,
    STATES,
    TURN,
    Inputs,
    find_rates,
    line_pressure,
)

TOLERANCE, LONGEST_STEP = 1e-6, 0.02
"""Relative tolerance [1] and longest step [s] of the integrator; steps longer than a ramp would miss it."""
ABSOLUTE = np.full(STATES, 1e-6)
ABSOLUTE[PUSH : PUSH + 4] = 1e-9
ABSOLUTE[LINE:] = 1e-4, 1e-2, 1e-2, 1.0, 1.0, 1.0, 1.0
"""Absolute tolerances of the states; a micrometre of a bushing is a newton, heat is in kelvin and joule."""
Event = Callable[[float, NDArray[np.float64]], float]


def start_state(record: NDArray[np.void], speed: float, disc_rise: float) -> NDArray[np.float64]:
    """State of the car that rolls freely on a level road.

    Parameters
    ----------
    record : the car
    speed : [m/s]
    disc_rise : temperature of the discs above ambient [K]
    """
    state = np.zeros(STATES)
    state[SPEED] = speed
    state[TURN : TURN + 4] = speed / record[0]["radius"]
    state[DISC : DISC + 2] = disc_rise
    return state


def wheel_slips(state: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Braking slip of the four wheels [1].

    Parameters
    ----------
    state : float64 [39]
    radius : of the wheels [m]
    """
    slips: NDArray[np.float64] = 1.0 - radius * state[TURN : TURN + 4] / max(state[SPEED], 0.1)
    return slips


def drive_run(
    record: NDArray[np.void],
    inputs: Inputs,
    state: NDArray[np.float64],
    controller: Mapping[str, float],
    last_speed: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Drive through the inputs, to their end or to the stop.

    Parameters
    ----------
    record, inputs : the car, and what acts on it
    state : at the start, float64 [39]
    controller : its declared numbers, and the target slip of the surface about which it cycles
    last_speed : at which the run ends [m/s]

    Returns
    -------
    States and their rates at the inputs' samples, float64 [N, 39] each.
    """
    clock = np.arange(len(inputs.pressure)) * inputs.interval
    states, rates = [state], [find_rates(0.0, state, record, inputs, open_caps(controller))]
    time, phases, caps = 0.0, np.full(4, OFF), open_caps(controller)
    radius, end = float(record[0]["radius"]), float(clock[-1])
    speeds = state[TURN : TURN + 4] * radius

    def stops(_: float, y: NDArray[np.float64]) -> float:
        return float(y[SPEED] - last_speed)

    def locks(_: float, y: NDArray[np.float64]) -> float:
        if y[SPEED] < controller["least_speed"]:
            return 1.0
        return controller["slip_high"] * controller["target_slip"] - float(wheel_slips(y, radius).max())

    while time < end - 1e-9:
        quiet = bool((phases == OFF).all())
        period = controller["period"]
        until = end if quiet else min((np.floor(time / period + 1e-6) + 1.0) * period, end)
        wanted = clock[(clock > time + 1e-9) & (clock <= until + 1e-9)]
        if not (quiet and locks(time, state) <= 0.0):
            done = _integrate(
                record, inputs, caps, state, (time, until), [stops, locks] if quiet else [stops]
            )
            time, state = float(done.t[-1]), done.y[:, -1]
            for moment in wanted[wanted <= time + 1e-9]:
                sample = done.sol(moment)
                states.append(sample)
                rates.append(find_rates(moment, sample, record, inputs, caps))
            if len(done.t_events[0]):
                break
        if quiet and time >= end - 1e-9:
            break
        rim = state[TURN : TURN + 4] * radius
        slowing = (speeds - rim) / period if not quiet else np.full(4, np.inf)
        speeds = rim
        phases, caps = _control(phases, caps, state, slowing, time, controller, record, inputs)
    return np.array(states), np.array(rates)


def open_caps(controller: Mapping[str, float]) -> NDArray[np.float64]:
    """Pressure limits of a silent controller, float64 [3, 4].

    Parameters
    ----------
    controller : its declared numbers
    """
    caps = np.zeros((3, 4))
    caps[0], caps[2, 1] = NO_CAP, controller["least_pressure"]
    return caps


def _control(
    phases: NDArray[np.int64],
    caps: NDArray[np.float64],
    state: NDArray[np.float64],
    slowing: NDArray[np.float64],
    time: float,
    controller: Mapping[str, float],
    record: NDArray[np.void],
    inputs: Inputs,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """One cycle of the controller: phases of the wheels' valves, and the pressure limits that follow."""
    line = line_pressure(time, state, record, inputs)
    floor = controller["least_pressure"]
    limits = (caps[0] + floor) * np.exp(caps[1] * (time - caps[2, 0])) - floor
    slips = wheel_slips(state, float(record[0]["radius"]))
    after = np.array(
        [
            control_wheel(int(phase), float(slip), float(slow), controller)
            for phase, slip, slow in zip(phases, slips, slowing, strict=True)
        ]
    )
    done = (after == BUILD) & (limits >= line)
    if state[SPEED] < controller["least_speed"]:
        done[:] = True
    after[done] = OFF
    limits = np.where(after == OFF, NO_CAP, np.minimum(limits, line))
    fresh = open_caps(controller)
    fresh[0], fresh[1], fresh[2, 0] = limits, cap_rates(after, controller), time
    return after, fresh


def _integrate(
    record: NDArray[np.void],
    inputs: Inputs,
    caps: NDArray[np.float64],
    state: NDArray[np.float64],
    span: tuple[float, float],
    events: list[Event],
) -> Any:
    for event in events:
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    return solve_ivp(
        lambda time, y: find_rates(time, y, record, inputs, caps), span, state, method="LSODA", events=events,
        rtol=TOLERANCE, atol=ABSOLUTE, max_step=LONGEST_STEP, dense_output=True,
    )  # fmt: skip
