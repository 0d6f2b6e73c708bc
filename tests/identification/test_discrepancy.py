"""Misfit of one channel in one run: it widens that channel's noise there, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.discrepancy import estimate_run_noise, set_run_noise
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.evidence import Evidence
from tasks.identification.inference.fit import fit_hypotheses
from tasks.identification.inference.forward import RunModel
from tasks.vehicle.effects.table import EFFECT_TABLE
from tests.identification.synthetic import NOISE, TOLERANCES, measured, plain_run

FRONT = 2
QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
NOTHING = np.zeros(len(EFFECT_TABLE))


def make_wheel_cycle(run: RunModel) -> RunModel:
    """The run with a front wheel that cycles as under a brake's anti-lock, eight times the noise, at 6 Hz."""
    response = run.run.response.copy()
    response[:, FRONT] += (
        8.0 * NOISE[FRONT] * np.sin(2.0 * np.pi * 6.0 * np.arange(len(response)) * run.run.interval)
    )
    return replace(run, run=replace(run.run, response=response))


def evidence_of(*runs: RunModel) -> Evidence:
    derived = tuple(differentiate_run(r, np.zeros(7), NOISE, NOTHING, (), TOLERANCES, QUIET) for r in runs)
    return Evidence(
        train=derived, held_out=(), effects=(), tolerances=TOLERANCES, disturbance=QUIET,
        sensors=(np.zeros(7), NOISE), rules=load("set of decision rules"),
    )  # fmt: skip


def make_plain_run(seed: int, peak: float = 1.5) -> RunModel:
    return measured(plain_run(25.0, peak, name=str(seed)), NOTHING, seed)


@pytest.fixture(scope="module")
def widened_evidence() -> Evidence:
    evidence = evidence_of(make_plain_run(1), make_wheel_cycle(make_plain_run(2)))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    return set_run_noise(evidence, estimate_run_noise(evidence, null))


def test_runs_that_the_model_follows_keep_the_noise_of_their_sensors(widened_evidence: Evidence) -> None:
    assert np.array_equal(widened_evidence.train[0].sigma, NOISE) and not widened_evidence.train[0].rho.any()


def test_a_channel_that_cycles_is_widened_evidence_where_it_cycles_alone(widened_evidence: Evidence) -> None:
    run = widened_evidence.train[1]
    others = np.arange(7) != FRONT
    assert np.array_equal(run.sigma[others], NOISE[others])
    assert run.sigma[FRONT] == pytest.approx(8.0 / np.sqrt(2.0) * NOISE[FRONT], rel=0.2)
    assert run.rho[FRONT] > 0.8, "a cycle of sixteen samples is no white noise"


def test_what_a_better_fit_follows_again_has_its_sensors_noise_again() -> None:
    evidence = evidence_of(make_plain_run(1), make_plain_run(2))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    wide = replace(evidence, train=(evidence.train[0], replace(evidence.train[1], sigma=8.0 * NOISE)))
    again = set_run_noise(wide, estimate_run_noise(wide, null))
    assert np.array_equal(again.train[1].sigma, NOISE)
    # its derivatives were whitened by the sensors' noise and are read as of the wide one: eight times larger now
    assert again.train[1].nuisance == pytest.approx(8.0 * evidence.train[1].nuisance)
