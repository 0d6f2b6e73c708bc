"""Intervals stay within bounds and say of 'no effect' what the likelihood says."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from tasks.identification.benchmark import make_synthetic_campaign
from tasks.identification.decision.attribution import Candidate, judge_hypothesis
from tasks.identification.decision.intervals import (
    compute_curvature_interval,
    compute_profile_interval,
    refit_named,
)
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.fit import compute_misfit_by_run, fit_hypotheses
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.identification.inference.hypothesis import make_library_hypothesis
from tasks.identification.inference.linearisation import prepare_evidence
from tasks.identification.inference.quantiles import compute_student_quantile
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, plain_run

LIBRARY = tuple(
    e for e in load_effects() if e.name in ("wet_friction_speed", "rolling_resistance", "brake_lag")
)
WET = LIBRARY[[e.name for e in LIBRARY].index("wet_friction_speed")]
Judged = tuple[Evidence, Candidate, float]


def rain_stops(
    speeds: tuple[float, ...], truth: dict[str, float], disturbance: Disturbance, seconds: float
) -> Judged:
    theta, zero, derived = build_parameter_vector(truth), np.zeros(len(EFFECT_TABLE)), []
    for i, speed in enumerate(speeds):
        run = replace(plain_run(speed, 6.0, seconds=seconds), weather="rain", precipitation_mm_h=8.0)
        clean = predict_channels(prepare_run(run, VEHICLE, SURFACE), theta, refinement=4)
        noise = NOISE * np.random.default_rng(i).standard_normal(clean.shape)
        model = prepare_run(replace(run, response=clean + noise), VEHICLE, SURFACE)
        derived.append(differentiate_run(model, np.zeros(7), NOISE, zero, LIBRARY, TOLERANCES, disturbance))
    evidence = Evidence(
        train=tuple(derived), held_out=tuple(derived[-2:]), effects=LIBRARY, tolerances=TOLERANCES,
        disturbance=disturbance, sensors=(np.zeros(7), NOISE), rules=load_decision_rules(),
    )  # fmt: skip
    base = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    held_out = compute_misfit_by_run(evidence.held_out, base)
    return (
        evidence,
        judge_hypothesis(evidence, base, held_out, make_library_hypothesis(WET, 0.004)),
        base.objective,
    )


@pytest.fixture(scope="module")
def sharp() -> Judged:
    """Fast and slow stops under small disturbances: slope and threshold are both well known."""
    quiet = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
    return rain_stops((31.0, 25.0, 19.0), {"wet_speed": 0.008, "wet_threshold": 10.0}, quiet, 4.0)


@pytest.fixture(scope="module")
def valley() -> Judged:
    """Slower stops under larger disturbances: slope and threshold can be traded for each other."""
    rough = Disturbance(scale=(40.0, 0.01, 20.0), time=(1.0, 0.3, 0.3))
    return rain_stops((22.0, 20.0, 18.0, 16.0), {"wet_speed": 0.01, "wet_threshold": 8.0}, rough, 3.0)


def test_an_effect_whose_score_excludes_zero_has_an_interval_that_does(
    valley: Judged,
) -> None:
    evidence, candidate, none = valley
    root = np.sqrt(none - candidate.fitted.objective)
    wanted = (
        compute_student_quantile(candidate.informed) * candidate.rules.interval_widening * candidate.inflation
    )
    assert candidate.passes and root > wanted
    low, high = compute_profile_interval(candidate, evidence)
    assert low[0] > 0.0
    assert low[0] < 0.01 < high[0] and low[1] < 8.0 < high[1]


@pytest.mark.parametrize("inflation", [1.0, 2.0])
def test_at_an_end_of_the_interval_the_best_fit_is_worse_by_the_quantile(
    sharp: Judged, inflation: float
) -> None:
    evidence, candidate, _ = sharp
    candidate = replace(candidate, inflation=inflation)
    h, best = candidate.hypothesis, candidate.fitted.objective
    for ends in compute_profile_interval(candidate, evidence):
        for j in (j for j in range(2) if h.lower[j] < ends[j] < h.upper[j]):
            # the other parameter on a grid, not by the optimiser under test
            k = 1 - j
            reach = 1.5 * np.ptp(np.array(compute_curvature_interval(candidate))[:, k])
            near = candidate.fitted.values[k] + np.linspace(-reach, reach, 9)
            rises = []
            for other in near:
                pair = np.array([ends[0], other] if j == 0 else [other, ends[1]])
                held = replace(h, lower=pair, upper=pair, start=pair)
                rises.append(
                    fit_hypotheses(evidence.train, (held,), evidence.session_sigma, iterations=1).objective
                )
            root = np.sqrt(min(rises) - best)
            wanted = (
                compute_student_quantile(candidate.informed) * candidate.rules.interval_widening * inflation
            )
            assert root == pytest.approx(wanted, rel=0.15), (j, ends[j])


def test_an_interval_is_as_many_times_as_long_as_the_runs_disagree(sharp: Judged) -> None:
    candidate = replace(sharp[1], inflation=1.0)
    ends, wide = (
        np.ptp(np.array(compute_curvature_interval(replace(candidate, inflation=factor)))[:, 0])
        for factor in (1.0, 1.5)
    )
    assert wide == pytest.approx(1.5 * ends)


def test_intervals_stay_within_the_bounds_of_their_parameters(
    valley: Judged,
) -> None:
    evidence, candidate, _ = valley
    wide = replace(candidate, fitted=replace(candidate.fitted, covariance=1e6 * candidate.fitted.covariance))
    h = candidate.hypothesis
    for low, high in (compute_curvature_interval(wide), compute_profile_interval(wide, evidence)):
        assert np.all(low >= h.lower) and np.all(high <= h.upper)
    assert np.array_equal(compute_curvature_interval(wide)[0], h.lower)


@pytest.mark.minutes
def test_with_derivatives_taken_at_it_an_estimate_forgets_where_it_started() -> None:
    rolling = next(e for e in LIBRARY if e.name == "rolling_resistance")
    campaign = make_synthetic_campaign(VEHICLE, SURFACE, {"rolling_coefficient": 0.012}, 56)
    evidence, _ = prepare_evidence(campaign, VEHICLE, SURFACE, (rolling,), load_decision_rules())
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma, iterations=6)
    part = make_library_hypothesis(rolling)
    far = fit_hypotheses(evidence.train, (part,), evidence.session_sigma, session=null.session, iterations=8)
    true = np.array([0.012])
    here, settled, _ = refit_named(evidence, far, [])
    near = fit_hypotheses(
        here.train, (part,), here.session_sigma, values=true, session=far.session, iterations=8
    )
    sigma = np.sqrt(settled.covariance[0, 0])
    assert abs(settled.values[0] - near.values[0]) < 0.3 * sigma < abs(far.values[0] - near.values[0])
    # what the stale derivatives promised was too much
    assert sigma > 1.3 * np.sqrt(far.covariance[0, 0])
