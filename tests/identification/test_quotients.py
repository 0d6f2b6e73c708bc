"""Difference quotients: one call for many hats, and the step at which they are taken."""

import numpy as np
import pytest

from tasks.identification.inference.forward import (
    SENSED,
    STEP,
    compute_instrument_readings,
    prepare_run,
    simulate_run,
)
from tasks.identification.inference.quotients import COARSE, compute_slot_quotients, simulate_point
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import SURFACE, VEHICLE, plain_run

AS_IT_STANDS = np.zeros(len(EFFECT_TABLE))


def make_hat(port: str, variable: str, origin: float, spacing: float, height: float) -> Slot:
    return Slot(
        port=port, variable=variable, origin=origin, spacing=spacing, values=np.array([0.0, height, 0.0])
    )


def test_quotients_of_one_call_are_those_of_whole_simulations_one_by_one():
    """Hats of the vehicle's and of an axle's variables, beside a form of the point, and a sensor with a lag."""
    model = prepare_run(plain_run(20.0, 1.0), VEHICLE, SURFACE)
    theta = build_parameter_vector({"mass": 0.02, "pitch_lag": 0.02, "speed_delay": 0.004})
    own = (make_hat("longitudinal_force", "speed", 0.0, 15.0, 40.0),)
    point = simulate_point(model, theta, own)
    hats = [
        make_hat("longitudinal_force", "time", 0.5, 0.15, 30.0),
        make_hat("friction", "load_ratio", 0.4, 0.6, 0.02),
        make_hat("pitch_moment", "time", 1.0, 0.1, 60.0),
    ]
    found = compute_slot_quotients(point, hats, [50, 0, 100])
    for quotient, hat in zip(found, hats, strict=True):
        moved = simulate_run(model, theta, slots=(*own, hat), step=point.step)
        readings = compute_instrument_readings(model, theta, moved.history[:, SENSED])
        expected = (readings - point.readings) / hat.values.max()
        assert np.abs(expected).max() > 0.0
        np.testing.assert_allclose(quotient, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("pressure", "step"), [(1.0, COARSE), (8.0, STEP)])
def test_a_run_in_which_the_anti_lock_brake_acts_keeps_the_step_of_the_model(pressure: float, step: float):
    point = simulate_point(prepare_run(plain_run(20.0, pressure), VEHICLE, SURFACE), AS_IT_STANDS, ())
    acts = point.simulated.column("abs_scale_f").min() < 1.0
    assert (point.step, acts) == (step, step == STEP)
