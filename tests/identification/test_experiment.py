"""Runs that the engine leaves out because they hang on the step, and the run that it plans next."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from studies.closing_benchmark.synthetic import RICH
from tasks.campaign.planned_runs import RunPlan, make_planned_run, plan_experiments
from tasks.identification.decision import experiment
from tasks.identification.decision.experiment import plan_next_experiment
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.evidence import Evidence
from tasks.identification.inference.fit import fit_hypotheses
from tasks.identification.inference.forward import prepare_run
from tasks.identification.inference.hypothesis import make_library_hypothesis
from tasks.identification.inference.linearisation import compute_step_misfit
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, measured, plain_run

NOTHING = np.zeros(len(EFFECT_TABLE))
QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
LIBRARY = {e.name: e for e in load("library of effects")}
BETWEEN = ("brake_fade", "the model as it stands")


def evidence_of(theta: np.ndarray, *names: str) -> Evidence:
    effects = tuple(LIBRARY[name] for name in names)
    runs = [(30.0, 0.0, 1, 20.0), (28.0, 1.5, -1, 20.0), (25.0, 1.8, 1, 250.0), (15.0, 0.0, -1, 20.0)]
    derived = tuple(
        differentiate_run(
            measured(plain_run(v, p, name=str(i), direction=d, disc_rise=t), theta, i), np.zeros(7), NOISE,
            np.zeros(len(EFFECT_TABLE)), effects, TOLERANCES, QUIET,
        )
        for i, (v, p, d, t) in enumerate(runs)
    )  # fmt: skip
    return Evidence(
        train=derived,
        held_out=tuple(run.model for run in derived[-2:]),
        effects=effects,
        tolerances=TOLERANCES,
        disturbance=QUIET,
        sensors=(np.zeros(7), NOISE),
        rules=load("set of decision rules"),
    )


def test_a_run_that_depends_on_the_step_is_told_from_sound_ones() -> None:
    """Light wheels and an anti-lock band a quarter as wide: steps of 2 ms swing the wheels through it."""
    limit = load("set of decision rules").step_misfit
    hard = replace(RICH[2], speed=12.0, peak=12.0)
    narrow = replace(VEHICLE, abs_release_width=0.05, wheel_inertia_f=0.3 * VEHICLE.wheel_inertia_f)
    sound, coarse = (
        [compute_step_misfit(prepare_run(make_planned_run(drive, "run"), car, SURFACE), NOTHING, np.zeros(7), NOISE)
         for drive in drives]
        for car, drives in ((VEHICLE, (RICH[0], RICH[2], RICH[11], RICH[19], hard)), (narrow, (hard,)))
    )  # fmt: skip
    assert max(sound) < 0.5 * limit < 10.0 * limit < min(coarse)


def test_the_next_experiment_excites_what_tells_the_two_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    evidence = evidence_of(build_parameter_vector({"fade": 0.06}), "brake_fade", "pressure_nonlinearity")
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    faded = fit_hypotheses(
        evidence.train, (make_library_hypothesis(LIBRARY["brake_fade"], 0.06),), evidence.session_sigma
    )

    def offer(choose: Callable[[str], bool], order: int = 1) -> None:
        def plan(gain: float) -> tuple[tuple[str, RunPlan], ...]:
            return tuple(drive for drive in plan_experiments(gain) if choose(drive[0]))[::order]

        monkeypatch.setattr(experiment, "plan_experiments", plan)

    def is_offered(words: str) -> bool:
        return words.startswith(("hard", "gentle", "roll"))

    offer(is_offered)
    plan = plan_next_experiment(evidence, faded, null, BETWEEN, VEHICLE, SURFACE)
    assert plan is not None
    assert plan.plan == "hard stop from 33 m/s with hot discs, 2.4 MPa"
    assert plan.expected_d2 > 20.0 and plan.between == BETWEEN
    # a slower log has fewer samples of the same run, each with the noise that the campaign says
    slow = [
        replace(run, model=replace(run.model, run=replace(run.model.run, interval=0.05)))
        for run in evidence.train
    ]
    slower = plan_next_experiment(replace(evidence, train=slow), faded, null, BETWEEN, VEHICLE, SURFACE)
    assert slower is not None and slower.expected_d2 < 0.7 * plan.expected_d2
    # its noise is that of the sensors, and not of the run whose noise was widened most
    wide = [replace(run, sigma=5.0 * run.sigma) for run in evidence.train]
    assert plan_next_experiment(replace(evidence, train=wide), faded, null, BETWEEN, VEHICLE, SURFACE) == plan
    # of two that are alike, the run that told the others apart best is refused too
    # runs that cannot be better are not differentiated, and any order gives the same one
    offer(is_offered, -1)
    assert plan_next_experiment(evidence, faded, null, BETWEEN, VEHICLE, SURFACE) == plan
    offer(plan.plan.__eq__)
    assert plan_next_experiment(evidence, faded, faded, BETWEEN, VEHICLE, SURFACE) is None
