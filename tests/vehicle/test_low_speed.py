"""The low-speed pitch rule on made-up decelerations."""

import numpy as np
import pytest

from tasks.vehicle.paper.low_speed import BrakedStop, compute_brake_pitch_input

STEP = 0.001
RULE = {"hold_s": 0.2, "release_s": 0.1, "hold_ratio": 0.8}


def stop_with(tail, cruise=5.0, stop=3000, length=4000):
    """Braking at ``cruise`` from 1 s; the given deceleration over the last 0.1 s before the stop at 3 s."""
    deceleration = np.zeros(length)
    deceleration[1000:stop] = cruise
    deceleration[stop - 100 : stop] = tail
    return -deceleration


def test_a_fading_deceleration_is_held_to_the_stop():
    d = compute_brake_pitch_input(stop_with(1.0), STEP, BrakedStop(onset=1.0, sample=3000), **RULE)
    np.testing.assert_array_equal(d[1000:3000], 5.0)


def test_a_lasting_deceleration_is_only_capped():
    d = compute_brake_pitch_input(
        stop_with(np.linspace(4, 9, 100)), STEP, BrakedStop(onset=1.0, sample=3000), **RULE
    )
    assert d[2900] == 4.0
    assert d[2800:3000].max() == d[2999] == pytest.approx(1.05 * 5)
    np.testing.assert_array_equal(d[1000:2900], 5.0)


def test_after_the_stop_the_held_value_fades_linearly():
    d = compute_brake_pitch_input(stop_with(1.0), STEP, BrakedStop(onset=1.0, sample=3000), **RULE)
    np.testing.assert_allclose(d[[3000, 3050, 3100, 3500]], [5.0, 2.5, 0, 0], atol=1e-12)


def test_the_reference_is_the_median_of_positive_values_before_the_hold():
    acceleration = stop_with(1.0)
    acceleration[2200:2550] = 3.0  # speeding up does not count, however long
    acceleration[2600:2650] = -50.0  # a short peak does not move a median
    assert (
        compute_brake_pitch_input(acceleration, STEP, BrakedStop(onset=1.0, sample=3000), **RULE)[2900] == 5.0
    )


def test_the_hold_starts_no_earlier_than_the_brake():
    acceleration = np.zeros(1000)
    acceleration[:400] = -0.004  # coasting
    acceleration[400:500] = -1.0
    d = compute_brake_pitch_input(acceleration, STEP, BrakedStop(onset=0.4, sample=500), **RULE)
    np.testing.assert_array_equal(d[:400], 0.004)


@pytest.mark.parametrize(("onset", "stop"), [(1.0, -1), (np.inf, 3000)])
def test_without_a_braked_stop_the_input_is_the_deceleration(onset, stop):
    acceleration = stop_with(1.0)
    acceleration[500] = 2.0
    d = compute_brake_pitch_input(acceleration, STEP, BrakedStop(onset=onset, sample=stop), **RULE)
    np.testing.assert_array_equal(d, np.maximum(-acceleration, 0))
