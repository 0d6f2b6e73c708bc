"""Names about which the runs disagree: which are taken back, and which are left to the joint fit."""

from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.effects import load_effects
from tasks.campaign.campaign import SESSION
from tasks.identification.decision.disputes import PORT_OF_NUMBER, moves_body_alone
from tasks.identification.decision.screening import find_disagreeing_runs
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


def test_the_runs_that_disagree_are_told_the_worst_first_and_those_within_noise_not_at_all() -> None:
    def make_run(name: str) -> SimpleNamespace:
        return SimpleNamespace(
            library=np.eye(3), library_q=np.zeros((1, 3)), project_on_nuisances=lambda r: np.zeros(1),
            model=SimpleNamespace(run=SimpleNamespace(name=name)),
        )  # fmt: skip

    effect = SimpleNamespace(parameters=(SimpleNamespace(step=1.0),))
    evidence = SimpleNamespace(
        train=[make_run(name) for name in ("wet", "dry", "snow")], effects=[effect] * 3
    )
    # scores of a run in the library's directions; only its middle one counts
    residuals = [np.array(r) for r in ([0.0, 2.0, 9.0], [9.0, 0.5, 0.0], [3.0, -3.0, 3.0])]
    assert find_disagreeing_runs(evidence, SimpleNamespace(residuals=residuals)) == ["snow", "wet"]
