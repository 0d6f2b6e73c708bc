"""Effects are recovered where they are, and nothing is found where nothing is."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, measured, plain_run

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from tasks.identification.decision.attribution import refine_candidates
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.disturbance import Disturbance, compute_prior_precision
from tasks.identification.inference.evidence import differentiate_run
from tasks.identification.inference.fit import fit_hypotheses
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector

WANTED = (
    "aerodynamic_drag",
    "rolling_resistance",
    "brake_lag",
    "brake_fade",
    "anti_dive",
    "sensor_pitch_scale",
)
LIBRARY = tuple(e for e in load_effects() if e.name in WANTED)
QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))


RUNS = (
    (30.0, 0.0, 1, 20.0),
    (28.0, 1.5, -1, 20.0),
    (25.0, 1.8, 1, 250.0),
    (12.0, 1.0, -1, 150.0),
    (15.0, 0.0, 1, 20.0),
)


def evidence_of(theta: np.ndarray, runs: tuple[tuple[float, float, int, float], ...] = RUNS) -> Evidence:
    derived = tuple(
        differentiate_run(
            measured(plain_run(v, p, name=str(i), direction=d, disc_rise=t), theta, i),
            np.zeros(7),
            NOISE,
            np.zeros(len(EFFECT_TABLE)),
            LIBRARY,
            TOLERANCES,
            QUIET,
        )
        for i, (v, p, d, t) in enumerate(runs)
    )
    return Evidence(
        train=derived,
        held_out=derived[-2:],
        effects=LIBRARY,
        tolerances=TOLERANCES,
        disturbance=QUIET,
        sensors=(np.zeros(7), NOISE),
        rules=load_decision_rules(),
    )


@pytest.mark.parametrize(
    ("effect", "parameter", "value"),
    [
        ("brake_lag", "lag", 0.08),
        ("brake_fade", "fade", 0.06),
        ("rolling_resistance", "rolling_coefficient", 0.012),
    ],
)
def test_the_effect_in_the_data_tops_the_ladder_with_its_value(
    effect: str, parameter: str, value: float
) -> None:
    evidence = evidence_of(build_parameter_vector({parameter: value}))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    best = refine_candidates(evidence, null, count=3)[0]
    assert best.hypothesis.name == effect and best.score > evidence.rules.accept_score
    sigma = np.sqrt(best.fitted.covariance[-1, -1] * best.inflation)
    assert abs(best.fitted.values[0] - value) < 4.0 * sigma + 0.02 * value


def test_nothing_passes_where_nothing_is_missing() -> None:
    evidence = evidence_of(np.zeros(len(EFFECT_TABLE)))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    assert not any(c.passes for c in refine_candidates(evidence, null, count=3))


@pytest.mark.parametrize(("stops", "passes"), [(2, True), (1, False)])
def test_an_effect_that_no_held_out_run_excites_needs_two_training_runs_that_predict_each_other(
    stops: int, passes: bool
) -> None:
    coasting = (15.0, 0.0, 1, 20.0)
    evidence = evidence_of(
        build_parameter_vector({"anti_dive": 0.5}), (*RUNS[1 : 1 + stops], coasting, coasting)
    )
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    best = refine_candidates(evidence, null, count=3)[0]
    assert best.hypothesis.name == "anti_dive" and best.is_open
    assert best.passes is passes and (best.cross_validated_gain > 100.0) is passes


def test_the_marginal_misfit_is_that_of_the_dense_covariance() -> None:
    evidence = evidence_of(np.zeros(len(EFFECT_TABLE)))
    run = evidence.train[0]
    keep = slice(0, 600)
    precision, _ = compute_prior_precision(run.knots, TOLERANCES, QUIET)
    j = run.nuisance[keep]
    r = np.random.default_rng(0).standard_normal(600)
    dense = r @ np.linalg.solve(np.eye(600) + j @ np.linalg.inv(precision) @ j.T, r)
    q = np.linalg.solve(np.linalg.cholesky(j.T @ j + precision), j.T @ r)
    assert dense == pytest.approx(float(r @ r - q @ q), rel=1e-8)


def test_every_library_effect_moves_some_instrument_and_zero_moves_none() -> None:
    run = plain_run(15.0, 2.2)
    plain = {}
    for weather, rate, hours in (("dry", 0.0, 0.0), ("rain", 10.0, 0.0), ("snow", 1.0, 1.0)):
        changed = type(run)(
            **{
                **run.__dict__,
                "weather": weather,
                "precipitation_mm_h": rate,
                "snow_accumulation_h": hours,
                "hazard_center": 12.0,
                "hazard_length": 3.7,
                "hazard_height": 0.075,
            }
        )
        model = prepare_run(changed, VEHICLE, SURFACE)
        plain[weather] = (model, predict_channels(model, np.zeros(len(EFFECT_TABLE))))
    for effect in load_effects():
        theta = build_parameter_vector({p.name: p.start for p in effect.parameters})
        theta[effect.parameters[0].index] = 5 * effect.parameters[0].step
        moved = max(float(np.max(np.abs(predict_channels(m, theta) - y) / NOISE)) for m, y in plain.values())
        assert moved > 0.3, effect.name
        off = build_parameter_vector({p.name: p.start for p in effect.parameters[1:]})
        if effect.name != "pad_friction_speed":
            assert all(np.array_equal(predict_channels(m, off), y) for m, y in plain.values()), effect.name


def test_halving_the_step_changes_less_than_the_noise() -> None:
    model = prepare_run(plain_run(20.0, 2.0), VEHICLE, SURFACE)
    theta = np.zeros(len(EFFECT_TABLE))
    difference = np.abs(predict_channels(model, theta) - predict_channels(model, theta, refinement=4))
    assert np.all(difference.max(axis=0) < 0.35 * NOISE)
