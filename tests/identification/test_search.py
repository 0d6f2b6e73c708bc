"""Parts of the search: runs sensitive to the step, numerical doubt, nuisances taken over, experiments, look-alikes."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tasks.identification.decision.attribution import Candidate, refine_candidates
from tasks.identification.decision.screening import (
    compute_inflation,
    find_detectable_sizes,
    find_look_alikes,
)

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from tasks.campaign.campaign import SESSION
from tasks.campaign.planned_runs import RICH, RunPlan, make_planned_run, plan_experiments
from tasks.identification.decision import experiment, search
from tasks.identification.decision.experiment import plan_next_experiment
from tasks.identification.decision.search import relinearise_candidate
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.fit import Fit, fit_hypotheses, sum_misfit_falls
from tasks.identification.inference.forward import prepare_run
from tasks.identification.inference.hypothesis import make_library_hypothesis
from tasks.identification.inference.linearisation import compute_step_misfit
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, measured, plain_run

QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
LIBRARY = {e.name: e for e in load_effects()}


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
        held_out=derived[-2:],
        effects=effects,
        tolerances=TOLERANCES,
        disturbance=QUIET,
        sensors=(np.zeros(7), NOISE),
        rules=load_decision_rules(),
    )


def test_a_run_that_depends_on_the_step_is_told_from_sound_ones() -> None:
    """Light wheels and an anti-lock band a quarter as wide: steps of 2 ms swing the wheels through it."""
    limit = load_decision_rules().step_misfit
    hard = replace(RICH[2], speed=12.0, peak=12.0)
    narrow = replace(VEHICLE, abs_release_width=0.05, wheel_inertia_f=0.3 * VEHICLE.wheel_inertia_f)
    sound, coarse = (
        [compute_step_misfit(prepare_run(make_planned_run(drive, "run"), car, SURFACE), np.zeros(7), NOISE)
         for drive in drives]
        for car, drives in ((VEHICLE, (RICH[0], RICH[2], RICH[11], RICH[19], hard)), (narrow, (hard,)))
    )  # fmt: skip
    assert max(sound) < 0.5 * limit < 10.0 * limit < min(coarse)


def test_a_fall_counts_only_beyond_the_doubt() -> None:
    before = (np.array([100.0, 100.0, 50.0]), np.array([0.0, 30.0, 0.0]))
    after = (np.array([90.0, 60.0, 55.0]), np.array([2.0, 20.0, 1.0]))
    assert sum_misfit_falls(before, after) == pytest.approx(8.0 + 0.0 - 4.0)


def test_a_held_out_misfit_that_moves_with_the_derivatives_is_in_doubt_by_that_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A stop on snow at the threshold of the ABS: 2644 or 3134, by where the derivatives are taken."""
    rules = load_decision_rules()
    before, after = (
        SimpleNamespace(held_out=name, train=(), session_sigma=None, rules=rules) for name in "ba"
    )
    misfits = {
        "b": (np.array([2644.0, 3128.0]), np.array([4.0, 0.0])),
        "a": (np.array([3134.0, 3128.5]), np.array([30.0, 0.0])),
    }
    fitted = SimpleNamespace(parts=(), values=np.ones(1), session=None)
    monkeypatch.setattr(search, "differentiate_at", lambda *_, library: after)
    monkeypatch.setattr(search, "fit_hypotheses", lambda *_, **__: fitted)
    monkeypatch.setattr(search, "compute_misfit_by_run", lambda runs, _: misfits[runs])
    monkeypatch.setattr(search, "assess_fit", lambda _, base, held_out, *__: held_out)
    candidate = SimpleNamespace(gain=1000.0, fitted=fitted, hypothesis=None)
    _, (misfit, doubt) = relinearise_candidate(before, None, candidate)
    assert misfit.tolist() == [3134.0, 3128.5]
    assert doubt == pytest.approx([520.0, 0.5])


def test_a_free_parameter_takes_its_session_nuisance_over() -> None:
    evidence = evidence_of(build_parameter_vector({"pressure_gain": 0.1}), "retuned_pressure_gain")
    fitted = fit_hypotheses(
        evidence.train, (make_library_hypothesis(LIBRARY["retuned_pressure_gain"]),), evidence.session_sigma,
        iterations=8,
    )  # fmt: skip
    assert abs(fitted.session[SESSION.index("pressure_gain")]) < 1e-12
    assert fitted.values[0] == pytest.approx(0.1, abs=0.01)


def test_an_interval_does_not_depend_on_the_unit_of_its_parameter() -> None:
    evidence = evidence_of(np.zeros(len(EFFECT_TABLE)), "progressive_spring")
    spring = make_library_hypothesis(LIBRARY["progressive_spring"])
    build = spring.build
    scaled = replace(
        spring, build=lambda x: build(1e9 * x), **{
            key: getattr(spring, key) / 1e9 for key in ("lower", "upper", "step", "start")
        },
    )  # fmt: skip
    sigmas = [
        np.sqrt(fit_hypotheses(evidence.train, (h,), evidence.session_sigma).covariance[0, 0])
        for h in (spring, scaled)
    ]
    assert sigmas[0] > 0.0 and sigmas[0] == pytest.approx(1e9 * sigmas[1], rel=1e-3)


def test_effects_of_one_shape_are_look_alikes_and_others_are_not() -> None:
    names = ("rolling_resistance", "pad_drag", "sensor_pitch_scale", "brake_fade")
    alike = find_look_alikes(evidence_of(np.zeros(len(EFFECT_TABLE)), *names), 0)
    assert alike == [1]


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
    plan = plan_next_experiment(evidence, faded, null, VEHICLE, SURFACE)
    assert plan is not None
    assert plan.plan == "hard stop from 33 m/s with hot discs, 2.4 MPa"
    assert plan.expected_d2 > 20.0
    # a slower log has fewer samples of the same run, each with the noise that the campaign says
    slow = [
        replace(run, model=replace(run.model, run=replace(run.model.run, interval=0.05)))
        for run in evidence.train
    ]
    slower = plan_next_experiment(replace(evidence, train=slow), faded, null, VEHICLE, SURFACE)
    assert slower is not None and slower.expected_d2 < 0.7 * plan.expected_d2
    # its noise is that of the sensors, and not of the run whose noise was widened most
    wide = [replace(run, sigma=5.0 * run.sigma) for run in evidence.train]
    assert plan_next_experiment(replace(evidence, train=wide), faded, null, VEHICLE, SURFACE) == plan
    # of two that are alike, the run that told the others apart best is refused too
    # runs that cannot be better are not differentiated, and any order gives the same one
    offer(is_offered, -1)
    assert plan_next_experiment(evidence, faded, null, VEHICLE, SURFACE) == plan
    offer(plan.plan.__eq__)
    assert plan_next_experiment(evidence, faded, faded, VEHICLE, SURFACE) is None


def test_what_the_screen_thinks_little_of_is_refined_where_it_is_asked_for() -> None:
    evidence = evidence_of(build_parameter_vector({"fade": 0.06}), "brake_fade", "rolling_resistance")
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    plain, asked = (
        {c.hypothesis.name for c in refine_candidates(evidence, null, gated=False, also=also)}
        for also in (frozenset[str](), frozenset({"rolling_resistance"}))
    )
    assert plain == {"brake_fade"} and asked == {"brake_fade", "rolling_resistance"}


@pytest.mark.parametrize(
    ("pulls", "asked"), [(False, ["open", "nested"]), (True, ["open", "alike", "nested"])]
)
def test_only_what_may_be_named_is_cross_validated(
    monkeypatch: pytest.MonkeyPatch, pulls: bool, asked: list[str]
) -> None:
    def make_candidate(name: str, *names: str, unseen: float = 0.0) -> SimpleNamespace:
        return SimpleNamespace(
            hypothesis=SimpleNamespace(name=name, names=names), passes=unseen > 4.0, pulls_session=pulls
        )

    # best first; the second passes, and is credible unless it pulls the session
    tried = [
        make_candidate("open", "a"),
        make_candidate("best", "b", "c", unseen=9.0),
        make_candidate("alike", "d"),
        make_candidate("nested", "b"),
    ]
    seen: list[str] = []

    def cross_validate(evidence: Evidence, base: Fit, candidate: Candidate) -> Candidate:
        seen.append(candidate.hypothesis.name)
        return candidate

    monkeypatch.setattr(search, "cross_validate_candidate", cross_validate)
    search._confirm_open(SimpleNamespace(evidence=None, base=None), tried, {})  # type: ignore[arg-type]
    assert [name for name in seen if name != "best"] == asked


def test_what_could_be_seen_is_what_the_score_asks_for_and_nothing_beyond_the_bounds() -> None:
    evidence = evidence_of(np.zeros(len(EFFECT_TABLE)), "rolling_resistance", "wet_friction_speed")
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    sizes = find_detectable_sizes(evidence, null)
    assert 0.0 < sizes["rolling_resistance"] < 0.05
    rolling = LIBRARY["rolling_resistance"]
    found = fit_hypotheses(evidence.train, (make_library_hypothesis(rolling),), evidence.session_sigma)
    inflation, tried = compute_inflation(evidence, null, None), {}
    for score in (evidence.rules.accept_score, 45.0):
        asked = replace(evidence, rules=replace(evidence.rules, accept_score=score))
        tried[score] = find_detectable_sizes(asked, null)["rolling_resistance"]
        needed = 2.0 * (score + np.log(evidence.samples)) * inflation
        assert tried[score] == pytest.approx(np.sqrt(needed * found.covariance[0, 0]), rel=0.05)
    assert tried[evidence.rules.accept_score] == sizes["rolling_resistance"]
    (first,) = rolling.parameters
    tight = replace(rolling, parameters=(replace(first, bounds=(0.0, 0.9 * sizes["rolling_resistance"])),))
    bounded = replace(evidence, effects=(tight, *evidence.effects[1:]))
    assert find_detectable_sizes(bounded, null)["rolling_resistance"] == np.inf
    # stops on a dry road say nothing of wet friction
    assert sizes["wet_friction_speed"] == np.inf


@pytest.mark.parametrize(("score", "arrives"), [(16.0, True), (5.0, False)])
def test_a_large_gain_is_linearised_anew_though_it_scores_below_a_name(
    monkeypatch: pytest.MonkeyPatch, score: float, arrives: bool
) -> None:
    """A pressure curve whose first fit stops at half its size: score 16, and 122 at the truth."""

    def make_candidate(score: float) -> SimpleNamespace:
        return SimpleNamespace(
            hypothesis=SimpleNamespace(name="curve", names=("b",), port="brake_torque"), fitted=None, gain=520.0,
            score=score, passes=score > 20.0, pulls_session=False,
        )  # fmt: skip

    rules = load_decision_rules()
    start = search.SearchState(evidence=SimpleNamespace(rules=replace(rules, most_effects=1)), base=None)  # type: ignore[arg-type]
    monkeypatch.setattr(search, "refine_candidates", lambda *_, **__: [make_candidate(score)])
    monkeypatch.setattr(
        search, "relinearise_candidate", lambda evidence, *_, **__: (evidence, make_candidate(122.0))
    )
    monkeypatch.setattr(search, "cross_validate_candidate", lambda _, __, candidate: candidate)
    found = search.search_library(start, gated=True)
    assert bool(found.rounds) is arrives


@pytest.mark.parametrize(
    ("inflation", "gain", "port", "left"),
    [
        (
            4.1,
            750.0,
            "suspension_force",
            True,
        ),  # a bump stop beside dampers of another law: 9 % of what both explain
        (4.1, 2000.0, "suspension_force", False),
        (1.0, 750.0, "suspension_force", False),  # the runs agree about the dampers
        (4.1, 750.0, "longitudinal_force", False),  # no damper leaves a drag over
    ],
)
def test_a_second_effect_may_be_what_a_name_leaves_over_about_which_the_runs_disagree(
    inflation: float, gain: float, port: str, left: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rules = replace(load_decision_rules(), most_effects=2)
    runs = SimpleNamespace(rules=rules)

    def make_candidate(name: str, gain: float, inflation: float, port: str) -> SimpleNamespace:
        return SimpleNamespace(
            hypothesis=SimpleNamespace(name=name, names=(name,), port=port), fitted=None, gain=gain,
            score=gain / inflation, inflation=inflation, passes=True, pulls_session=False, held_out_gain=11.0,
        )  # fmt: skip

    dampers = make_candidate("damper_asymmetry", 7624.0, inflation, "suspension_force")
    tried = iter(([dampers], [make_candidate("second", gain, 1.4, port)]))
    monkeypatch.setattr(search, "refine_candidates", lambda *_, **__: next(tried))
    monkeypatch.setattr(search, "relinearise_candidate", lambda evidence, _, near, **__: (evidence, near))
    monkeypatch.setattr(search, "cross_validate_candidate", lambda _, __, candidate: candidate)
    found = search.search_library(search.SearchState(evidence=runs, base=None), gated=True)  # type: ignore[arg-type]
    assert [r.accepted.hypothesis.name for r in found.rounds][1:] == ([] if left else ["second"])
    assert [c.hypothesis.name for c in found.tried] == (["second"] if left else [])
