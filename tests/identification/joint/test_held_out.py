"""Held-out runs decide which explanations of the training runs stay."""

from types import SimpleNamespace

import pytest

from catalogs.decision_rules import load_decision_rules
from tasks.identification.joint import held_out
from tasks.identification.joint.held_out import drop_contradicted_rivals

RULES = load_decision_rules().joint


@pytest.mark.parametrize(("error", "is_kept"), [(0.10, True), (0.13, True), (0.14, False)])
def test_a_rival_that_predicts_held_out_runs_much_worse_is_none(monkeypatch, error: float, is_kept: bool):
    """Drag stood beside late wheel speeds, though it predicted the held-out stop twice as badly."""
    monkeypatch.setattr(held_out, "_held_out_misfit", lambda _, fitted: (fitted, 1.0))
    rival = SimpleNamespace(fitted=error)
    assert RULES.better_prediction_share == 0.75
    assert drop_contradicted_rivals([], 0.10, [rival], RULES) == ((rival,) if is_kept else ())
