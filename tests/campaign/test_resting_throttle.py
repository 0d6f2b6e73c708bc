"""A throttle rests at the value that it reads while the brake is applied, where that value is steady."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.campaign.campaign import Run
from tasks.campaign.resting_pressure import LEAST_THROTTLE, MOST_THROTTLE, find_throttle_rest
from tests.identification.synthetic import plain_run


def drive(rest: float, cruise: float = 0.4, *, idle: float = 0.0, brakes: bool = True) -> Run:
    """A run that cruises for longer than its driver brakes; its brake signal idles, and has the noise of a gauge."""
    run = plain_run(20.0, 2.0)
    run = replace(run, pressure=run.pressure[:180])
    noise = 0.01 * np.abs(np.random.default_rng(0).normal(size=len(run.pressure)))
    pressed = run.pressure if brakes else np.zeros_like(run.pressure)
    throttle = np.where(run.pressure > 0.0, rest, cruise) if brakes else np.full(len(pressed), cruise)
    return replace(run, pressure=pressed + idle + noise, throttle=throttle)


def test_a_throttle_rests_at_what_it_reads_while_the_brake_is_applied_also_where_that_idles():
    for idle in (0.0, 1.5):
        assert find_throttle_rest([drive(0.15, idle=idle)]) == pytest.approx(0.15)
        assert find_throttle_rest([drive(0.0, idle=idle)]) == 0.0


def test_a_run_without_a_brake_or_a_throttle_tells_nothing():
    """The noise of a gauge in a long cruise passed for brakes, and the cruise for the rest of the throttle."""
    cruises = [drive(0.0, 0.2, brakes=False)] * 3
    assert find_throttle_rest(cruises) == 0.0
    assert find_throttle_rest([*cruises, drive(0.15)]) == pytest.approx(0.15)
    assert find_throttle_rest([replace(drive(0.15), throttle=None)]) == 0.0


@pytest.mark.parametrize(
    ("reads", "rests"),
    [(LEAST_THROTTLE, False), (LEAST_THROTTLE + 0.01, True), (MOST_THROTTLE + 0.01, False)],
)
def test_less_is_a_sensors_error_and_more_a_foot_on_both_pedals(reads: float, rests: bool):
    assert bool(find_throttle_rest([drive(reads)])) is rests
