"""Names about which the runs disagree: which are taken back, and which are left to the joint fit."""

import pytest

from catalogs.effects import load_effects
from tasks.campaign.campaign import SESSION
from tasks.identification.decision.disputes import PORT_OF_NUMBER, moves_body_alone
from tasks.identification.inference.hypothesis import make_library_hypothesis

LIBRARY = {e.name: e for e in load_effects()}


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("anti_dive", True), ("aerodynamic_pitch", True), ("sensor_pitch_lag", True), ("retuned_pitch_gain", True),
        ("retuned_suspension_damping", True), ("sensor_speed_lag", False), ("brake_lag", False),
        ("retuned_mass", False), ("sensor_gravity_leak", False), ("load_sensitivity", False),
    ],
)  # fmt: skip
def test_what_only_heave_and_pitch_show_is_told_from_the_motion_along_the_road(name: str, body: bool) -> None:
    assert moves_body_alone(make_library_hypothesis(LIBRARY[name])) is body


def test_the_numbers_with_a_port_are_of_the_session() -> None:
    assert PORT_OF_NUMBER.keys() <= set(SESSION)
