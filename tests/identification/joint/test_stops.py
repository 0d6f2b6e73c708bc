"""A run as a joint fit sees it: what moves it, and what its instruments alone show."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import CHANNELS
from tasks.identification.joint.stops import OFFSETS, is_only_read, make_stop, simulate_stop
from tasks.vehicle.effects.table import build_parameter_vector
from tests.identification.synthetic import SURFACE, VEHICLE, measured, plain_run

NUMBERS = [number.name for number in load_joint_numbers()]


@pytest.mark.parametrize("engine", [None, -80.0])
@pytest.mark.parametrize("name", [*NUMBERS, *OFFSETS])
def test_what_only_instruments_show_leaves_the_motion_as_it_is(name: str, engine: float | None):
    """Its derivative takes no simulation of its own, so that to call another number so would lose the number."""
    run = replace(plain_run(25.0, 2.0), weather="rain", precipitation_mm_h=2.0)
    if engine is not None:
        run = replace(run, drive_torque=np.full(len(run.pressure), engine))
    stop = make_stop(
        measured(run, build_parameter_vector({}), 3).run,
        VEHICLE,
        SURFACE,
        CHANNELS,
        load_decision_rules().joint,
    )
    offsets = np.array([0.01 * (name == other) for other in OFFSETS])
    numbers = {name: 0.01} if name in NUMBERS else {}
    still = simulate_stop(stop, {}, np.zeros(3)).history
    moved = simulate_stop(stop, numbers, offsets).history
    assert is_only_read(stop, name) == np.array_equal(still, moved)


@pytest.mark.parametrize(
    ("logged", "guessed"),
    [({}, True), ({"throttle": 0.3}, False), ({"drive_torque": -80.0}, False), ({"pressure": 0.0}, False)],
)
def test_when_the_driver_lifts_is_guessed_where_he_brakes_and_neither_throttle_nor_engine_was_logged(
    logged: dict[str, float], guessed: bool
):
    run = plain_run(25.0, 2.0)
    run = replace(run, **{name: np.full(len(run.pressure), value) for name, value in logged.items()})
    model = measured(run, build_parameter_vector({}), 3)
    assert (
        make_stop(model.run, VEHICLE, SURFACE, CHANNELS, load_decision_rules().joint).guesses_lift is guessed
    )
