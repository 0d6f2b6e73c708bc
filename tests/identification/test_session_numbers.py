"""Numbers of the vehicle that the runs can hardly tell apart: pulled together, and rivals of each other."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from tasks.campaign.campaign import CHANNELS, SESSION, Tolerances
from tasks.identification.decision import search
from tasks.identification.decision.rivals import compare_with_rivals
from tasks.identification.decision.search import SearchState, find_retune, search_library
from tasks.identification.decision.session_numbers import (
    compute_joint_pull,
    find_alike_numbers,
    free_session_number,
)
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.fit import fit_hypotheses
from tasks.identification.inference.hypothesis import Hypothesis
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, TOLERANCES, measured, plain_run

QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
NUMBERS = tuple(e for e in load_effects() if e.name in ("retuned_pressure_gain", "retuned_mass"))
SPEED_ALONE = np.where([name == "speed" for name in CHANNELS], NOISE, np.inf)


WHEELS = tuple(e for e in load_effects() if e.name in ("retuned_wheel_radius", "sensor_wheel_speed_scale"))
KNOWN_RADIUS = TOLERANCES.with_session({"wheel_radius": 1e-5})


def evidence_of(
    theta: np.ndarray,
    sigma: np.ndarray,
    effects: tuple[Effect, ...] = NUMBERS,
    tolerances: Tolerances = KNOWN_RADIUS,
) -> Evidence:
    drives = [(30.0, 0.0), (28.0, 1.2), (25.0, 1.6), (18.0, 0.8), (27.0, 1.0)]
    runs = tuple(
        differentiate_run(
            measured(plain_run(v, p, name=str(i)), theta, i), np.zeros(7), sigma, np.zeros(len(EFFECT_TABLE)), effects,
            tolerances, QUIET,
        )
        for i, (v, p) in enumerate(drives)
    )  # fmt: skip
    return Evidence(
        train=runs[:3], held_out=runs[3:], effects=effects, tolerances=tolerances, disturbance=QUIET,
        sensors=(np.zeros(7), sigma), rules=load_decision_rules(),
    )  # fmt: skip


def find_gain(gain: float, sigma: np.ndarray) -> tuple[SearchState, list[str]]:
    return find_wrong_number(evidence_of(build_parameter_vector({"pressure_gain": gain}), sigma))


def find_wrong_number(evidence: Evidence) -> tuple[SearchState, list[str]]:
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, iterations=6)
    reasons: list[str] = []
    return find_retune(SearchState(evidence=evidence, base=null), reasons), reasons


def test_a_number_that_would_have_to_leave_its_bounds_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wheel radius 3 % off was named as 8.1 %, with an interval that ended at 8 %."""
    assert find_gain(0.1, NOISE)[0].rounds

    def free_within_half(*given: Any) -> Hypothesis:
        freed = free_session_number(*given)
        assert freed is not None
        return replace(freed, upper=np.array([0.05]))

    monkeypatch.setattr(search, "free_session_number", free_within_half)
    assert not find_gain(0.1, NOISE)[0].rounds


def test_speed_alone_shows_gain_over_mass_and_the_body_tells_the_two_apart() -> None:
    plain = np.zeros(len(EFFECT_TABLE))
    assert find_alike_numbers(evidence_of(plain, SPEED_ALONE), "pressure_gain") == ["mass"]
    assert find_alike_numbers(evidence_of(plain, NOISE), "pressure_gain") == []


def test_a_number_that_the_library_does_not_hold_is_neither_freed_nor_alike() -> None:
    evidence = replace(evidence_of(np.zeros(len(EFFECT_TABLE)), SPEED_ALONE), effects=NUMBERS[:1])
    assert find_alike_numbers(evidence, "slope") == []
    assert free_session_number(evidence, SimpleNamespace(session=np.zeros(7)), "slope") is None  # type: ignore[arg-type]


def test_numbers_are_pulled_together_by_the_root_of_their_squares() -> None:
    pulls = np.zeros(len(SESSION))
    pulls[[SESSION.index("pressure_gain"), SESSION.index("mass")]] = 3.0, 4.0
    fitted = SimpleNamespace(pulls=pulls)
    assert compute_joint_pull(fitted, ["pressure_gain", "mass"]) == pytest.approx(5.0)  # type: ignore[arg-type]
    assert compute_joint_pull(fitted, ["pressure_gain", "slope"]) == pytest.approx(3.0)  # type: ignore[arg-type]


def test_a_gain_whose_pull_the_mass_shares_is_named_with_the_mass_as_its_rival() -> None:
    found, reasons = find_gain(0.095, SPEED_ALONE)
    limit = found.evidence.rules.retune_pull
    null = found.rounds[0].base
    assert np.max(null.pulls) < limit < compute_joint_pull(null, ["pressure_gain", "mass"])
    assert "pressure_gain and mass, which they hardly tell apart" in reasons[0]
    assert [r.accepted.hypothesis.name for r in found.rounds] == ["retuned_pressure_gain"]
    (compared,) = compare_with_rivals(found.evidence, found.base, found.rounds)
    assert [c.hypothesis.name for c, _ in compared.near] == ["retuned_mass"]


def test_a_gain_within_its_tolerance_is_left_alone() -> None:
    found, reasons = find_gain(0.03, SPEED_ALONE)
    assert not found.rounds
    assert not reasons


def test_a_gain_that_the_body_tells_from_the_mass_has_no_rival() -> None:
    found, _ = find_gain(0.1, NOISE)
    assert [r.accepted.hypothesis.name for r in found.rounds] == ["retuned_pressure_gain"]
    (compared,) = compare_with_rivals(found.evidence, found.base, found.rounds)
    assert not compared.near


@pytest.mark.parametrize("tolerance", [0.002, 0.005, 0.015])
@pytest.mark.parametrize(("name", "sign"), [("wheel_speed_scale", 1.0), ("wheel_radius", -1.0)])
def test_wheels_that_are_too_small_and_a_sensor_that_counts_too_much_are_rivals(
    name: str, sign: float, tolerance: float
) -> None:
    size = 4.3 * tolerance
    truth = build_parameter_vector({name: sign * size})
    evidence = evidence_of(truth, NOISE, WHEELS, TOLERANCES.with_session({"wheel_radius": tolerance}))
    found, _ = find_wrong_number(evidence)
    assert [r.accepted.hypothesis.name for r in found.rounds] == ["retuned_wheel_radius"]
    (compared,) = compare_with_rivals(found.evidence, found.base, found.rounds)
    ((sensor, _),) = compared.near
    assert sensor.hypothesis.name == "sensor_wheel_speed_scale"
    assert sensor.fitted.values == pytest.approx(size, rel=0.1)
    assert abs(sensor.fitted.session[SESSION.index("wheel_radius")]) < 1e-3 * size


def test_a_sensor_that_does_not_read_like_the_wrong_number_is_no_rival() -> None:
    sensor = tuple(e for e in load_effects() if e.name == "sensor_speed_delay")
    theta = build_parameter_vector({"wheel_radius": -0.027})
    found, _ = find_wrong_number(evidence_of(theta, NOISE, WHEELS[:1] + sensor, TOLERANCES))
    (compared,) = compare_with_rivals(found.evidence, found.base, found.rounds)
    assert [r.accepted.hypothesis.name for r in found.rounds] == ["retuned_wheel_radius"]
    assert not compared.others


def test_a_wrong_number_that_no_session_holds_has_no_instrument_that_reads_like_it() -> None:
    split = tuple(e for e in load_effects() if e.name in ("bias_shift", "sensor_wheel_speed_scale"))
    evidence = evidence_of(build_parameter_vector({"front_bias": 0.08}), NOISE, split)
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, iterations=6)
    found = search_library(SearchState(evidence=evidence, base=null), gated=True)
    assert [r.accepted.hypothesis.name for r in found.rounds] == ["bias_shift"]
    (compared,) = compare_with_rivals(found.evidence, found.base, found.rounds)
    assert not compared.near
