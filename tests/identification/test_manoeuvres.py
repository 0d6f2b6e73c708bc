"""Stopping distance and peak pitch against constant decelerations worked by hand."""

import numpy as np
import pytest

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.held_out import measure_manoeuvre_errors

T = np.arange(500) * 0.01


def make_braked(deceleration: float, dip: float) -> np.ndarray:
    y = np.zeros((500, 7))
    y[:, CHANNELS.index("speed")] = 20.0 - deceleration * np.maximum(T - 1.0, 0.0)
    y[:, CHANNELS.index("pitch")] = np.where(T > 1.0, dip, 0.0)
    return y


PRESSURE = np.where(T >= 1.0, 2.0, 0.0)


def test_the_distance_is_that_to_the_lowest_speed_that_all_reach() -> None:
    measured, harder, softer = make_braked(4.0, 1.0), make_braked(4.4, 1.2), make_braked(3.6, 0.9)
    errors = measure_manoeuvre_errors(measured, np.array([harder, softer]), PRESSURE, 0.01)
    assert errors is not None
    reached = 20.0 - 3.6 * 3.99

    def distance(deceleration: float) -> float:
        return (20.0**2 - reached**2) / (2.0 * deceleration)

    assert errors[:, 0] == pytest.approx([distance(a) - distance(4.0) for a in (4.4, 3.6)], abs=1e-3)
    assert errors[:, 1] == pytest.approx([0.2, -0.1])


def test_a_run_that_coasts_has_no_stopping_distance() -> None:
    coasting = make_braked(0.2, 0.0)
    assert measure_manoeuvre_errors(coasting, coasting[None], np.zeros(500), 0.01) is None
    assert measure_manoeuvre_errors(coasting, coasting[None], PRESSURE, 0.01) is None


def test_the_distance_of_a_car_that_rolls_on_after_its_brake_ends_with_the_brake() -> None:
    measured, softer = make_braked(5.0, 1.0), make_braked(4.9, 1.0)
    released = T > 3.0
    for y in (measured, softer):
        speed = y[:, CHANNELS.index("speed")]
        speed[released] = speed[~released][-1] - 0.05 * (T[released] - 3.0)
    errors = measure_manoeuvre_errors(measured, softer[None], np.where(released, 0.0, PRESSURE), 0.01)
    assert errors is not None
    reached = 20.0 - 4.9 * 2.0
    assert errors[0, 0] == pytest.approx((20.0**2 - reached**2) / 2.0 * (1 / 4.9 - 1 / 5.0), abs=1e-3)


def test_a_model_that_is_the_measurement_is_not_wrong() -> None:
    measured = make_braked(5.0, 1.0)
    errors = measure_manoeuvre_errors(measured, measured[None], PRESSURE, 0.01)
    assert errors is not None and np.array_equal(errors, np.zeros((1, 2)))
