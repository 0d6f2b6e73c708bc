"""The model as one function of a block of numbers, for programs that drive it step by step and are no Python.

`compile_advance` compiles this function for one vehicle. All that a drive needs from one call to the next stands in
the block, so that a copy of the block is a copy of the drive. First come `INPUTS` and `OUTPUTS`, then what the function
alone reads: the state, and the pressures that a dead time still holds back.

An input is what it is said to be at the end of the first internal step, and linear until then, as in a trace.
"""

from collections.abc import Callable, Sequence
from math import ceil
from typing import Any

import numpy as np
from numba import carray, cfunc, njit, types
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import WEATHERS, list_by_code
from tasks.surface.wet_friction import WetGrip, make_wet_grip
from tasks.vehicle.effects.slots import pack_slots
from tasks.vehicle.model.brake_input import NO_COMMAND, BrakeInput
from tasks.vehicle.model.chassis import Chassis, Conditions, build_chassis
from tasks.vehicle.model.embedded_variables import INPUTS, OUTPUTS
from tasks.vehicle.model.simulation import INTERNAL_STEP_S, integrate_motion
from tasks.vehicle.model.states import STATE_WIDTH, make_rolling_state, unpack_state
from tasks.vehicle.parameters import TyreFamily, Vehicle, compute_surface_response, compute_tyre_scale
from tasks.vehicle.road import Climb, RoadFeature, RoadLine
from tasks.vehicle.tyres.contract import Tyre, scale_curve

START = -1
"""Number of steps that puts a drive to its start."""
DONE, NO_TYRE = 1, 2
"""Value that the function returns: it has done its steps, or the vehicle has no tyre family in this weather."""

register_jitable(error_model="numpy")(make_wet_grip)
_SUBSTEPS = np.int64(1)
"""Steps between samples; of this type, Numba takes the loop that it has compiled for every other run."""
_SPEED, _DISC_RISE, _CENTER, _LENGTH, _HEIGHT, _BY_SPEED = range(6)
_PRESSURE, _ENGINE, _HOLD, _WEATHER, _FRICTION, _SNOW, _FILM = range(6, 13)
_FRONT_HEIGHT, _FRONT_SLOPE, _REAR_HEIGHT, _REAR_SLOPE = range(13, 17)
_OUTPUTS, _COLUMNS = len(INPUTS), len(OUTPUTS)
_STATE = _OUTPUTS + _COLUMNS
_PRESSURES = _STATE + STATE_WIDTH


def count_held_samples(vehicle: Vehicle) -> int:
    """Return how many samples of an input the model looks back on and ahead to.

    Parameters
    ----------
    vehicle : the vehicle, whose dead time holds pressures back
    """
    return ceil(vehicle.effects.get("dead_time", 0.0) / INTERNAL_STEP_S) + 3


def measure_block(vehicle: Vehicle) -> int:
    """Return the length of a vehicle's block.

    Parameters
    ----------
    vehicle : the vehicle
    """
    return _PRESSURES + 2 * count_held_samples(vehicle)


def compile_advance(vehicle: Vehicle, surface: SurfaceParameters) -> Any:
    """Compile the model of a vehicle, as a C function of a block and a number of steps.

    Parameters
    ----------
    vehicle : the vehicle; its numbers are constants of the compiled function
    surface : pavement that grips by speed where the block asks for it; its numbers are constants too

    Returns
    -------
    Numba's C callback ``int64 advance(double *block, double *states, double *rows, int64 steps)``; ``states`` and
    ``rows`` are room for two states and two rows of outputs. `START` steps put the block to the start of a drive by its
    parameters; then the function takes steps of `INTERNAL_STEP_S`, fills the outputs and returns `DONE`.
    """
    known, names = vehicle.find_weathers(), list_by_code()
    fixed = build_chassis(vehicle, compute_surface_response(vehicle, known[0], 0.5), Conditions())
    wet = np.array([name in WEATHERS and float(WEATHERS[name].wet) for name in names], dtype=np.float64)
    tables = [form.slot for form in vehicle.forms]
    slots = pack_slots(tables) if tables else None
    make_tyre = _compile_tyre(vehicle)
    film_law = _compile_wet_grip(surface)
    has_tyre = np.array([name in known for name in names])
    held, width = count_held_samples(vehicle), measure_block(vehicle)

    def advance(numbers: Any, two_states: Any, two_rows: Any, steps: int) -> int:
        block = carray(numbers, (width,))
        states, history = carray(two_states, (2, STATE_WIDTH)), carray(two_rows, (2, _COLUMNS))
        pressures, engines = block[_PRESSURES : _PRESSURES + held], block[_PRESSURES + held :]
        weather = int(block[_WEATHER]) - 1
        if not has_tyre[weather]:
            return NO_TYRE
        tyre = make_tyre(weather, block[_FRICTION])
        by_speed = wet[weather] != 0.0 and block[_BY_SPEED] != 0.0
        chassis = Chassis(
            fixed.body, fixed.wheels, fixed.lever, fixed.lock_speed, fixed.transfer, fixed.effects, wet[weather],
            block[_SNOW], fixed.direction, film_law(block[_FILM]) if by_speed else fixed.grip,
        )  # fmt: skip
        if steps < 0:
            state = make_rolling_state(block[_SPEED], fixed.wheels.radius, block[_DISC_RISE], np.inf)
            pressures[:], engines[:] = block[_PRESSURE], block[_ENGINE]
        else:
            state = unpack_state(block[_STATE:_PRESSURES])
        road = RoadFeature(
            block[_CENTER], block[_LENGTH], block[_HEIGHT], True,
            RoadLine(state.motion.station, block[_FRONT_HEIGHT], block[_FRONT_SLOPE]),
            RoadLine(state.motion.station - fixed.wheels.wheelbase, block[_REAR_HEIGHT], block[_REAR_SLOPE]),
        )  # fmt: skip
        level = Climb(1.0, block[:0])  # a hill comes by the slopes
        for _ in range(max(steps, 1)):
            samples = 1 if steps < 0 else 2
            if samples == 2:
                push_sample(pressures, block[_PRESSURE])
                push_sample(engines, block[_ENGINE])
            begin = (round(state.time / INTERNAL_STEP_S) + 2 - held) * INTERNAL_STEP_S
            drive = BrakeInput(NO_COMMAND, pressures, INTERNAL_STEP_S, block[_HOLD] != 0.0, engines, begin)
            integrate_motion(
                state, samples, _SUBSTEPS, INTERNAL_STEP_S, drive, road, level, slots, chassis, tyre, history,
                states,
            )  # fmt: skip
            state = unpack_state(states[samples - 1])
        last = 0 if steps < 0 else 1
        for i in range(STATE_WIDTH):
            block[_STATE + i] = states[last, i]
        for i in range(_COLUMNS):
            block[_OUTPUTS + i] = history[last, i]
        return DONE

    pointer = types.CPointer(types.float64)
    signature = types.int64(pointer, pointer, pointer, types.int64)
    return cfunc(signature, error_model="numpy")(advance)


@njit(error_model="numpy")
def push_sample(samples: NDArray[np.float64], value: float) -> None:
    """Move samples towards the past by one, and put a value behind the last.

    Parameters
    ----------
    samples : float64 [N] [unit of the input]
    value : the newest sample [unit of the input]
    """
    for i in range(len(samples) - 1):
        samples[i] = samples[i + 1]
    samples[len(samples) - 1] = value


def _compile_wet_grip(surface: SurfaceParameters) -> Callable[[float], WetGrip]:
    """Return a kernel that gives the grip of a film [mm], as `tasks.surface.weather.find_wet_grip` does."""
    numbers = (
        surface.wet_friction, surface.wet_decay_speed, surface.wet_planing_film_mm,
        surface.wet_planing_exponent, surface.wet_tyre_pressure_kpa, surface.wet_planing_friction,
        surface.wet_reference_speed,
    )  # fmt: skip
    texture = surface.texture_depth_mm

    @njit(error_model="numpy")
    def find_grip(film_mm: float) -> WetGrip:
        grip: WetGrip = make_wet_grip(film_mm - texture, *numbers)
        return grip

    return find_grip


def _compile_tyre(vehicle: Vehicle) -> Callable[[int, float], Tyre]:
    """Return a kernel that gives the tyre in a weather at a friction, as `compute_surface_response` does."""
    known = vehicle.find_weathers()
    names = [name if name in known else known[0] for name in list_by_code()]
    families = [vehicle.find_tyre_family(name) for name in names]
    knots, efficiency, stiffness = (
        _stack_tables(families, field) for field in ("surface_friction", "efficiency", "slip_stiffness")
    )
    curves = tuple(vehicle.find_curve(name) for name in names)

    @njit(error_model="numpy")
    def make_tyre(weather: int, friction: float) -> Tyre:
        peak, slip_stiffness = compute_tyre_scale(
            friction, knots[weather], efficiency[weather], stiffness[weather]
        )
        tyre: Tyre = scale_curve(curves[weather], peak, slip_stiffness)
        return tyre

    return make_tyre


def _stack_tables(families: Sequence[TyreFamily], field: str) -> NDArray[np.float64]:
    """Return one table of every family, float64 [families, K]; short ones go on with their last value."""
    rows = [getattr(family, field) for family in families]
    width = max(map(len, rows))
    return np.array([[*row, *(row[-1:] * (width - len(row)))] for row in rows])
