"""A channel with a sample at every tenth instant: nothing between its samples counts as evidence."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.identification.decision.forms import differentiate_by_splines
from tasks.identification.inference.discrepancy import RunNoise, set_run_noise
from tasks.identification.inference.evidence import Evidence
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.linearisation import prepare_evidence
from tasks.vehicle.effects.table import EFFECT_TABLE
from tests.identification.synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, measured, plain_run

SPEED = CHANNELS.index("speed")
NOTHING = np.zeros(len(EFFECT_TABLE))


@pytest.fixture(scope="module")
def slow_campaign() -> Campaign:
    runs = []
    for k in range(4):
        run = measured(plain_run(25.0, 1.2 + 0.3 * k, name=f"run-{k}"), NOTHING, k).run
        rows = np.arange(k, len(run.response), 10)
        response, sampled = run.response.copy(), np.ones(run.response.shape, dtype=bool)
        response[:, SPEED] = np.interp(np.arange(len(response)), rows, response[rows, SPEED])
        sampled[:, SPEED] = np.isin(np.arange(len(response)), rows)
        runs.append(replace(run, response=response, sampled=sampled, held_out=k > 1))
    return Campaign(
        name="slow",
        vehicle="paper-reference",
        runs=tuple(runs),
        tolerances=TOLERANCES,
        content_hash="",
        split_hash="",
    )


@pytest.fixture(scope="module")
def prepared_evidence(slow_campaign: Campaign) -> tuple[Evidence, Fit]:
    effects = tuple(
        effect for effect in load("library of effects") if effect.name in ("headwind", "brake_lag")
    )
    return prepare_evidence(slow_campaign, VEHICLE, SURFACE, effects, load("set of decision rules"))


def test_residuals_and_derivatives_are_zero_between_samples(prepared_evidence: tuple[Evidence, Fit]) -> None:
    evidence, null = prepared_evidence
    noisier = {run.model.run.name: RunNoise(rho=run.rho, sigma=2.0 * run.sigma) for run in evidence.train}
    for seen in (evidence, set_run_noise(evidence, noisier)):
        splines = differentiate_by_splines(seen, null)
        for run, knots in zip(seen.train, splines, strict=True):
            assert run.model.sampled is not None
            between = ~run.model.sampled.ravel()
            for columns in (
                run.compute_residual(NOTHING),
                run.nuisance,
                run.session,
                run.library,
                run.others,
                knots,
            ):
                assert (columns[between] == 0.0).all() and (columns[~between] != 0.0).any()


def test_a_model_without_fault_leaves_the_noise_of_its_samples(
    prepared_evidence: tuple[Evidence, Fit],
) -> None:
    evidence, _ = prepared_evidence
    for run in evidence.train:
        left = run.compute_residual(NOTHING).reshape(-1, len(CHANNELS))[:, SPEED]
        assert float(np.sum(left**2)) == pytest.approx(len(run.model.find_samples(SPEED)), rel=0.8)
    assert evidence.sensors[1][SPEED] == pytest.approx(NOISE[SPEED], rel=0.6)
