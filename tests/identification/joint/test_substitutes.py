"""What explains nearly as much as a named number is its rival, and derivatives foresee what to try."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.joint_numbers import load_joint_numbers
from tasks.identification.joint import substitutes
from tasks.identification.joint.elimination import refit_numbers
from tasks.identification.joint.substitutes import FORESEEN_SHARE, find_substitutes, foresee_falls
from tests.identification.joint.known_car import fit_of, slow_brakes

NUMBERS = {number.name: number for number in load_joint_numbers()}


def foresee_much(_stops, _fitted, others):
    """Foresee that every number makes good all that is missing."""
    return np.full(len(others), 1e6)


def test_whatever_explains_nearly_as_much_is_a_rival_of_whichever_kind(monkeypatch):
    """An engine's drag passed for a curve of the brake: a rival was looked for among other curves alone."""
    named = replace(fit_of([np.zeros(100)]), numbers=(NUMBERS["pressure_curve"],), cost=10.0)
    cost = {"": 110.0, "engine_torque": 24.0, "push_out": 26.0}

    def look_up_cost(_stops, fitted, numbers, _start=None):
        left = {number.name for number in numbers}
        return replace(fitted, numbers=numbers, cost=min(cost.get(name, 110.0) for name in left or {""}))

    monkeypatch.setattr(substitutes, "refit_numbers", look_up_cost)
    monkeypatch.setattr(substitutes, "foresee_falls", foresee_much)
    found = find_substitutes([], named, named.numbers, list(NUMBERS.values()), 0.85)
    assert [(one.of, one.name) for one in found] == [("pressure_curve", "engine_torque")]


@pytest.mark.parametrize(("share", "rivals"), [(1.01, ["engine_torque"]), (0.99, [])])
def test_a_rival_is_fitted_where_its_derivatives_let_it_matter(monkeypatch, share: float, rivals: list[str]):
    named = replace(fit_of([np.zeros(100)]), numbers=(NUMBERS["pressure_curve"],), cost=10.0)

    def look_up_cost(_stops, fitted, numbers, _start=None):
        left = {number.name for number in numbers}
        return replace(fitted, numbers=numbers, cost=11.0 if "engine_torque" in left else 110.0)

    def foresee_little(_stops, _fitted, others):
        return np.full(len(others), share * FORESEEN_SHARE * 0.85 * (110.0 - 10.0))

    monkeypatch.setattr(substitutes, "refit_numbers", look_up_cost)
    monkeypatch.setattr(substitutes, "foresee_falls", foresee_little)
    assert [
        one.name for one in find_substitutes([], named, named.numbers, list(NUMBERS.values()), 0.85)
    ] == rivals


def test_a_gain_that_the_file_claims_to_know_may_stand_for_a_resistance(monkeypatch):
    named = replace(fit_of([np.zeros(100)]), numbers=(NUMBERS["pressure_gain"],), cost=10.0)
    cost = {"rolling_coefficient": 24.0, "drag_area": 26.0}

    def look_up_cost(_stops, fitted, numbers, _start=None):
        return replace(
            fitted, numbers=numbers, cost=min((cost.get(n.name, 110.0) for n in numbers), default=110.0)
        )

    monkeypatch.setattr(substitutes, "refit_numbers", look_up_cost)
    monkeypatch.setattr(substitutes, "foresee_falls", foresee_much)
    assert find_substitutes([], named, [], list(NUMBERS.values()), 0.85) == []
    (found,) = find_substitutes([], named, named.numbers, list(NUMBERS.values()), 0.85)
    assert (found.of, found.name) == ("pressure_gain", "rolling_coefficient")


def test_a_fit_foresees_which_number_makes_good_what_another_did():
    found = slow_brakes()
    without = refit_numbers(
        found.train, found.fitted, tuple(n for n in found.fitted.numbers if n.name != "lag")
    )
    late = [n for n in load_joint_numbers() if n.name in ("lag", "dead_time", "acceleration_scale")]
    foreseen = dict(zip((n.name for n in late), foresee_falls(found.train, without, late), strict=True))
    reached = {
        n.name: without.cost - refit_numbers(found.train, without, (*without.numbers, n)).cost for n in late
    }
    least = FORESEEN_SHARE * reached["lag"]
    assert min(foreseen["lag"], foreseen["dead_time"]) > 2.0 * least
    assert foreseen["acceleration_scale"] < least and reached["acceleration_scale"] < 0.1 * reached["lag"]


def test_a_foreseen_move_ends_at_the_bounds_of_a_number(monkeypatch):
    """A brake's curve beyond its bound foresaw no fall at all, though the way to the bound makes good most of it."""
    curve = next(n for n in load_joint_numbers() if n.name == "pressure_curve")
    slope = np.full((400, 1), 8.0)
    monkeypatch.setattr(substitutes, "differentiate_run", lambda *_: None)
    none = SimpleNamespace(numbers=(), values=np.zeros(0), offsets=np.zeros((1, 3)), scales=None, cost=0.0)
    for optimum in (0.9 * curve.lower, 1.1 * curve.lower, 1.1 * curve.upper, 2.0 * curve.lower):
        residual = -optimum * slope[:, 0]
        runs = SimpleNamespace(residuals=(residual,), slopes=(slope,))
        monkeypatch.setattr(substitutes, "describe_fit", lambda *_, runs=runs: runs)
        move = np.clip(optimum, curve.lower, curve.upper)
        weight = 1.0 / np.sqrt(1.0 + residual**2)
        fall = 0.5 * float(weight @ (residual**2 - (residual + move * slope[:, 0]) ** 2))
        assert foresee_falls([None], none, [curve]) == pytest.approx([fall], rel=0.05)
    for number in load_joint_numbers():
        if number.lower == 0.0:
            monkeypatch.setattr(
                substitutes,
                "describe_fit",
                lambda *_: SimpleNamespace(residuals=(slope[:, 0],), slopes=(slope,)),
            )
            assert foresee_falls([None], none, [number]) == [0.0]
