"""Wheel speeds in km/h, which give a radius that a small tyre has too."""

import numpy as np
import pytest

from tasks.campaign.wheel_validation import describe_km_h

INTERVAL = 0.01
SPEED = np.linspace(30.0, 10.0, 600)


@pytest.mark.parametrize(
    ("radius", "unit", "told"),
    [
        (1 / 3.6, "rad/s", True),
        (1.02 / 3.6, "rad/s", True),  # a worn tyre
        (1.05 / 3.6, "rad/s", False),
        (0.31, "rad/s", False),
        (1 / 3.6, "rpm", False),  # a small tyre, by a logger that counts turns
        (1 / 3.6, "km/h", False),  # converted by a gain
    ],
)
def test_a_wheel_speed_in_km_h_that_is_taken_for_rad_s_is_told(radius: float, unit: str, told: bool) -> None:
    runs = {f"run-{k}": {"speed": SPEED, "wheel_speed_front": SPEED / radius} for k in range(2)}
    problems = describe_km_h(runs, INTERVAL, {"speed": "km/h", "wheel_speed_front": unit})
    assert len(problems) == told
    assert all("wheel_speed_front looks like km/h" in problem for problem in problems)
    assert all("1/(3.6 x rolling radius in m)" in problem for problem in problems)
