"""Of all that the runs can show, what earns its place stays: better fits count, and what went too early comes back."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.identification.joint import selection
from tasks.identification.joint.selection import PROMISED, add_certain_numbers
from tests.identification.joint.known_car import fit_of, slow_brakes

RULES = load_decision_rules().joint
NUMBERS = {number.name: number for number in load_joint_numbers()}
LAG = NUMBERS["lag"]


@pytest.mark.parametrize(
    ("promised", "sure", "at", "kept", "added"),
    [
        (1.1, 1.01, 0.06, True, True), (0.9, 1.01, 0.06, True, False), (1.1, 0.99, 0.06, True, False),
        (1.1, 1.01, 0.3, True, False), (1.1, 1.01, 0.06, False, False),
    ],
)  # fmt: skip
def test_a_number_that_is_certain_beside_what_is_left_comes_back(
    monkeypatch, promised: float, sure: float, at: float, kept: bool, added: bool
):
    """Of four stops of a race car elimination took the brake's curve away, and of four others it kept it."""
    fade = NUMBERS["fade"]
    left = replace(fit_of([np.zeros(10)] * 4), cost=100.0)
    needed = PROMISED * student.ppf(1.0 - RULES.false_name_chance, 3) ** 2

    def refit(_stops, fit, numbers, _start=None):
        return replace(fit, numbers=numbers, values=np.array([0.1, at])[: len(numbers)], cost=50.0)

    monkeypatch.setattr(selection, "refit_numbers", refit)
    monkeypatch.setattr(
        selection, "foresee_falls", lambda _s, _f, others: np.full(len(others), promised * needed)
    )
    monkeypatch.setattr(
        selection, "measure_certainty", lambda fit, _r: np.array([99.0, sure])[: len(fit.numbers)]
    )
    monkeypatch.setattr(selection, "eliminate_uncertain_numbers", lambda _s, fit, _r: fit if kept else left)
    found = add_certain_numbers((), left, [LAG, fade, NUMBERS["pressure_gain"]], RULES)
    assert ("fade" in found.by_name) is added and (found is left) is not added


@pytest.mark.parametrize("falls", [1.0, -1.0])
def test_a_fit_is_given_up_for_a_better_one_alone(monkeypatch, falls: float):
    """Runs whose own numbers started anew ended in a worse minimum, in which a dead band was no longer certain."""
    here = slow_brakes()
    moved = replace(here.fitted, cost=here.fitted.cost - falls, values=0.5 * here.fitted.values)
    monkeypatch.setattr(selection, "fit_jointly", lambda *_, **__: [moved])
    best, agreeing = selection._settle(here.train, here.fitted, [{}], RULES)
    assert best is (moved if falls > 0.0 else here.fitted)
    assert agreeing == (int(falls > 0.0), 1)
