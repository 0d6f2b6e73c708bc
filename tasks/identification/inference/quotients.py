"""Difference quotients of one run's readings about a linearisation point."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.identification.inference.forward import (
    SENSED,
    STEP,
    EquippedVehicle,
    RunModel,
    compute_grade_force,
    compute_instrument_readings,
    equip_vehicle,
    make_drive,
    moves_alike,
    simulate_run,
)
from tasks.vehicle.effects.ports import AXLE_VARIABLES
from tasks.vehicle.effects.slots import Slot, SlotTables, pack_slots
from tasks.vehicle.model.brake_input import BrakeInput
from tasks.vehicle.model.chassis import Chassis, build_chassis
from tasks.vehicle.model.simulation import Simulation, integrate_motion
from tasks.vehicle.model.states import unpack_state
from tasks.vehicle.road import Climb, RoadFeature, make_climb, make_road_feature
from tasks.vehicle.tyres.contract import Tyre

COARSE = 0.005
"""Longest integration step of a quotient while no anti-lock brake acts: errors by the step are those of both its
simulations, and cancel. When such a brake acts depends on the step, and with it the quotient [s]."""


@dataclass(frozen=True, kw_only=True)
class Point:
    """A run at the point about which it is differentiated.

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] all parameters [units of the table]
    slots : forms
    car : the vehicle with these parameters
    step : longest integration step of every simulation about the point [s]
    simulated : motion of the run, with its states
    readings : float64 [samples, 7] of the instruments
    """

    model: RunModel
    theta: NDArray[np.float64]
    slots: tuple[Slot, ...]
    car: EquippedVehicle
    step: float
    simulated: Simulation
    readings: NDArray[np.float64]


def simulate_point(model: RunModel, theta: NDArray[np.float64], slots: tuple[Slot, ...]) -> Point:
    """Return a run at the point about which it is differentiated.

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] all parameters [units of the table]
    slots : forms
    """
    car = equip_vehicle(model, theta)

    def simulate(step: float) -> Simulation:
        return simulate_run(model, theta, slots=slots, step=step, keep_states=True, equipped=car)

    step, simulated = COARSE, simulate(COARSE)
    if min(simulated.column("abs_scale_f").min(), simulated.column("abs_scale_r").min()) < 1.0:
        step, simulated = STEP, simulate(STEP)
    return Point(
        model=model, theta=theta, slots=slots, car=car, step=step, simulated=simulated,
        readings=compute_instrument_readings(model, theta, simulated.history[:, SENSED]),
    )  # fmt: skip


def compute_quotient(
    point: Point, theta: NDArray[np.float64], step: float, *, initial_speed: float | None = None
) -> NDArray[np.float64]:
    """Return the difference quotient of the readings by a number, float64 [samples, 7].

    Parameters
    ----------
    point : where it is taken
    theta : float64 [len(EFFECT_TABLE)] parameters with that number moved [units of the table]
    step : by which it is moved [its unit]
    initial_speed : replaces the model's, where that is the number [m/s]
    """
    moved = point.simulated
    if initial_speed is not None or not moves_alike(theta, point.theta):
        moved = simulate_run(
            point.model, theta, slots=point.slots, step=point.step, initial_speed=initial_speed
        )
    return (compute_instrument_readings(point.model, theta, moved.history[:, SENSED]) - point.readings) / step


def compute_slot_quotients(point: Point, hats: Sequence[Slot], firsts: Sequence[int]) -> NDArray[np.float64]:
    """Return the difference quotients of the readings by the height of hats, float64 [K, samples, 7].

    Each simulation branches off where its hat is first felt.

    Parameters
    ----------
    point : where they are taken
    hats : one for each quotient, beside the point's forms, as high as the step [unit of the port]
    firsts : sample from which the run may feel each
    """
    model, car = point.model, point.car
    grown = [form.slot for form in car.vehicle.forms]
    forms = [*grown, *compute_grade_force(model.run, car.vehicle), *point.slots]
    # what follows works on one column after the other
    motion = np.moveaxis(np.empty((len(SENSED), len(hats), model.samples)), 0, -1)
    motion[:] = point.simulated.history[:, SENSED]
    _integrate_branches(
        point.simulated.states,
        np.array(firsts, dtype=np.int64),
        model.count_substeps(point.step),
        model.run.interval / model.count_substeps(point.step),
        make_drive(model),
        make_road_feature(car.conditions.hazard),
        make_climb(car.conditions.grade, car.vehicle.gravity, car.conditions.direction),
        pack_slots((*forms, *hats)),
        np.array([any(s.variable in AXLE_VARIABLES for s in (*forms, hat)) for hat in hats]),
        build_chassis(car.vehicle, car.surface, car.conditions),
        car.surface.tyre,
        np.array(SENSED),
        np.empty((model.samples, point.simulated.history.shape[1])),
        motion,
    )
    heights = np.array([hat.values.max() for hat in hats])
    moved = compute_instrument_readings(model, point.theta, motion)
    return (moved - point.readings) / heights[:, np.newaxis, np.newaxis]


@njit(cache=True, nogil=True, error_model="numpy")
def _integrate_branches(
    states: NDArray[np.float64],
    firsts: NDArray[np.int64],
    substeps: int,
    step: float,
    drive: BrakeInput,
    road: RoadFeature,
    climb: Climb,
    slots: SlotTables,
    by_axle: NDArray[np.bool_],
    chassis: Chassis,
    tyre: Tyre,
    columns: NDArray[np.int64],
    history: NDArray[np.float64],
    motion: NDArray[np.float64],
) -> None:
    """Integrate a run once for each of its last slots, from the state at which that one is first felt.

    Parameters
    ----------
    states : float64 [samples, S] of the run without these slots
    firsts : int64 [K] sample from which each is felt
    substeps, step, drive, road, climb, chassis, tyre : as `integrate_motion` takes them
    slots : the run's own, then the K others
    by_axle : bool [K] whether a run with each has variables of an axle's own
    columns : int64 [C] of the history that are kept
    history : float64 [samples, len(COLUMNS)] room for one
    motion : float64 [K, samples, C] in which what follows the branching is replaced
    """
    samples, own = len(states), len(slots.keys) - len(firsts)
    unkept = np.empty((0, states.shape[1]))
    keys, grids, tables = (
        slots.keys[: own + 1].copy(),
        slots.grids[: own + 1].copy(),
        slots.tables[: own + 1].copy(),
    )
    for k in range(len(firsts)):
        first = firsts[k]
        keys[own], grids[own], tables[own] = (
            slots.keys[own + k],
            slots.grids[own + k],
            slots.tables[own + k],
        )
        integrate_motion(
            unpack_state(states[first]),
            samples - first,
            substeps,
            step,
            drive,
            road,
            climb,
            SlotTables(keys, grids, tables, by_axle[k]),
            chassis,
            tyre,
            history,
            unkept,
        )
        for n in range(samples - first):
            for c in range(len(columns)):
                motion[k, first + n, c] = history[n, columns[c]]
