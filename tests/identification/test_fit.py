"""Fitting through the simulation: where derivatives are taken, what disturbances may swallow, where a run starts."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.campaign.campaign import SESSION
from tasks.errors import InputError
from tasks.identification.decision.candidates import Candidate, list_columns
from tasks.identification.decision.forms import (
    KNOTS,
    RANGE,
    RIDGE,
    differentiate_by_splines,
    find_scanned_ranges,
    make_form_hypotheses,
    make_form_in_range,
)
from tasks.identification.decision.odds import search_explanations
from tasks.identification.decision.search import gather_grams
from tasks.identification.inference import evidence as inference_evidence
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.evidence import Evidence
from tasks.identification.inference.fit import Fit, _measure_scatter, fit_hypotheses
from tasks.identification.inference.forward import (
    RunModel,
    compute_starting_speed,
    predict_channels,
    prepare_run,
)
from tasks.identification.inference.hypothesis import Hypothesis, make_library_hypothesis
from tasks.identification.inference.linearisation import (
    compute_whitened_residuals,
    differentiate_about_offsets,
    fit_disturbance,
)
from tasks.vehicle.effects.forms import SHAPES, Form, count_coefficients, name_form
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, measured, plain_run

QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
LIBRARY = {e.name: e for e in load("library of effects")}
PLAIN = np.zeros(len(EFFECT_TABLE))


def evidence_of(models: list[RunModel], effects: tuple[Effect, ...]) -> Evidence:
    runs = tuple(differentiate_run(m, np.zeros(7), NOISE, PLAIN, effects, TOLERANCES, QUIET) for m in models)
    return Evidence(
        train=runs, held_out=(), effects=effects, tolerances=TOLERANCES, disturbance=QUIET,
        sensors=(np.zeros(7), NOISE),
        rules=load("set of decision rules"),
    )  # fmt: skip


def over_a_hump(speed_offset: float) -> RunModel:
    run = replace(plain_run(11.0, 0.0), hazard_center=12.0, hazard_length=3.7, hazard_height=0.075)
    model = measured(run, PLAIN, 0)
    late = predict_channels(replace(model, initial_speed=11.0 + speed_offset), PLAIN, refinement=4)
    # the speed before the brake is read off other noise than the hump is: the run starts a little off
    return replace(model, run=replace(model.run, response=late), initial_speed=11.0)


def test_a_hump_that_is_reached_a_moment_later_is_not_taken_for_information() -> None:
    rolling = LIBRARY["rolling_resistance"]
    widths = []
    for offset in (0.0, 0.08):
        evidence = evidence_of([over_a_hump(offset), over_a_hump(-offset)], (rolling,))
        null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
        fitted = fit_hypotheses(
            evidence.train, (make_library_hypothesis(rolling),), evidence.session_sigma, values=np.zeros(1),
            offsets=null.offsets,
        )  # fmt: skip
        widths.append(np.sqrt(fitted.covariance[0, 0]))
    assert widths[1] == pytest.approx(widths[0], rel=0.1)


def test_a_start_on_the_accepted_fit_finds_what_a_fresh_one_finds() -> None:
    fade = LIBRARY["brake_fade"]
    truth = build_parameter_vector({"fade": 0.06})
    models = [
        measured(plain_run(25.0, p, disc_rise=t), truth, i)
        for i, (p, t) in enumerate(((1.8, 250.0), (1.2, 150.0)))
    ]
    evidence = evidence_of(models, (fade,))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    held, fresh = (
        fit_hypotheses(
            evidence.train,
            (make_library_hypothesis(fade),),
            evidence.session_sigma,
            values=start,
            offsets=offsets,
        )
        for start, offsets in ((np.zeros(1), null.offsets), (np.array([0.06]), None))
    )
    assert held.objective == pytest.approx(fresh.objective, abs=1.0)
    assert held.values[0] == pytest.approx(fresh.values[0], rel=0.05)


def test_a_threshold_of_what_starts_at_nothing_is_fitted_once_that_has_moved() -> None:
    creep = LIBRARY["idle_creep"]
    truth = build_parameter_vector({"creep_force": 250.0, "creep_speed": 5.0})
    models = [
        measured(plain_run(v, p), truth, i) for i, (v, p) in enumerate(((6.5, 0.0), (5.0, 0.1), (3.5, 0.0)))
    ]
    evidence = evidence_of(models, (creep,))
    fitted = fit_hypotheses(
        evidence.train, (make_library_hypothesis(creep),), evidence.session_sigma, values=np.array([0.0, 4.0]),
        iterations=12,
    )  # fmt: skip
    assert fitted.values == pytest.approx([250.0, 5.0], rel=0.2)


def test_a_free_parameter_takes_its_session_nuisance_over() -> None:
    gain = build_parameter_vector({"pressure_gain": 0.1})
    models = [
        measured(plain_run(v, p), gain, i) for i, (v, p) in enumerate(((28.0, 1.5), (25.0, 1.8), (15.0, 0.0)))
    ]
    evidence = evidence_of(models, (LIBRARY["retuned_pressure_gain"],))
    fitted = fit_hypotheses(
        evidence.train, (make_library_hypothesis(LIBRARY["retuned_pressure_gain"]),), evidence.session_sigma,
        iterations=8,
    )  # fmt: skip
    assert abs(fitted.session[SESSION.index("pressure_gain")]) < 1e-12
    assert fitted.values[0] == pytest.approx(0.1, abs=0.01)


def test_an_interval_does_not_depend_on_the_unit_of_its_parameter() -> None:
    models = [measured(plain_run(v, p), PLAIN, i) for i, (v, p) in enumerate(((28.0, 1.5), (25.0, 1.8)))]
    evidence = evidence_of(models, (LIBRARY["progressive_spring"],))
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


@pytest.mark.parametrize("reading", [1e200, np.inf, np.nan])
def test_a_trial_whose_simulation_diverges_is_broken_and_overflows_nowhere(
    reading: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run,) = evidence_of([measured(plain_run(25.0, 1.5), PLAIN, 0)], ()).train
    monkeypatch.setattr(
        inference_evidence, "predict_channels", lambda *_, **__: np.full((run.model.samples, 7), reading)
    )
    assert np.array_equal(run.compute_residual(PLAIN), np.full(len(run.nuisance), inference_evidence.BROKEN))


def test_a_run_starts_at_the_speed_the_sensor_read_less_its_scale_error() -> None:
    model = prepare_run(plain_run(20.0, 0.0), VEHICLE, SURFACE)
    scaled = build_parameter_vector({"speed_scale": 0.02})
    assert compute_starting_speed(model, scaled) == pytest.approx(20.0 / 1.02)
    assert predict_channels(model, scaled)[0, 0] == pytest.approx(20.0)


HUMP = Slot(
    port="brake_torque",
    variable="speed",
    origin=0.0,
    spacing=8.0,
    values=np.array([0.0, 0.07, 0.15, 0.07, 0.0]),
)


def hump_in_the_brake() -> Evidence:
    models = []
    for i, (speed, peak) in enumerate(((30.0, 1.6), (26.0, 1.2), (20.0, 1.4), (14.0, 1.0), (28.0, 1.0))):
        model = prepare_run(plain_run(speed, peak), VEHICLE, SURFACE)
        clean = predict_channels(model, PLAIN, slots=(HUMP,), refinement=4)
        noise = NOISE * np.random.default_rng(i).standard_normal(clean.shape)
        models.append(prepare_run(replace(model.run, response=clean + noise), VEHICLE, SURFACE))
    return evidence_of(models, (LIBRARY["brake_fade"],))


def find_best_form(evidence: Evidence, null: Fit) -> tuple[Candidate, list[Hypothesis]]:
    """The form that alone explains most of what a fit leaves over, and the shapes that follow it best."""
    rules = load("set of decision rules")
    columns = list_columns(evidence.effects, (), evidence.session_sigma, rules)
    grams = gather_grams(evidence, null, differentiate_by_splines(evidence, null), columns)
    best = search_explanations(grams, most=1, width=1, spread=False)[0]
    (form,) = best.members
    grid = np.linspace(*find_scanned_ranges(evidence.train)[form.variable], KNOTS)
    return form, make_form_hypotheses(form.port, form.variable, grid, best.values, best.errors)


def test_a_form_outside_the_library_does_not_pass_for_a_disturbance() -> None:
    evidence = hump_in_the_brake()
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    splines = differentiate_by_splines(evidence, null)
    told, blind = (
        fit_disturbance(
            evidence.train,
            compute_whitened_residuals(evidence, null),
            TOLERANCES,
            evidence.effects,
            QUIET,
            columns,
            RIDGE,
        )
        for columns in (splines, tuple(np.zeros_like(x) for x in splines))
    )
    assert told.scale[0] < 0.5 * blind.scale[0]


def test_a_bump_is_in_the_grammar() -> None:
    evidence = hump_in_the_brake()
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    best, shapes = find_best_form(evidence, null)
    assert (best.port, best.variable) == ("brake_torque", "speed")
    assert "a exp(-(4x - 2)^2)" in shapes[0].name


def test_what_a_stop_at_the_limit_of_friction_tells_of_the_brake_does_not_hang_on_its_noise() -> None:
    curve = LIBRARY["pressure_nonlinearity"]
    stops = ((25.0, 2.0, 0.0), (28.0, 1.2, 0.0), (12.0, 3.5, 0.05), (24.0, 2.6, -0.04))
    widths = []
    for seed in (0, 20):
        models = [
            measured(plain_run(speed, peak), build_parameter_vector({"pressure_curve": 0.04, "friction": mu}), seed + i)
            for i, (speed, peak, mu) in enumerate(stops)
        ]  # fmt: skip
        evidence = evidence_of(models, (curve,))
        first = fit_hypotheses(
            evidence.train, (make_library_hypothesis(curve, 0.04),), evidence.session_sigma
        )
        fitted = fit_hypotheses(
            differentiate_about_offsets(evidence, first), first.parts, evidence.session_sigma, values=first.values,
            session=first.session, offsets=first.offsets,
        )  # fmt: skip
        widths.append(np.sqrt(fitted.covariance[0, 0]))
        assert abs(fitted.values[0] - 0.04) < 3.0 * widths[-1]
    assert widths[0] == pytest.approx(widths[1], rel=0.05)


def test_a_form_over_pressure_is_found_as_far_as_weak_brakes_are_pressed() -> None:
    """Brakes with 0.3 of the gain need 8 MPa for what 2.4 does, and a form is constant beyond its range."""
    weak = replace(VEHICLE, brake_gain=0.3 * VEHICLE.brake_gain)
    bump = Form(
        port="brake_torque", variable="pressure", shape="a exp(-(4x - 3)^2)", coefficients=(0.25,), scale=8.0,
        low=0.0, high=8.0,
    )  # fmt: skip
    models = []
    for i, (speed, peak) in enumerate(((30.0, 8.0), (20.0, 3.0), (26.0, 7.0), (15.0, 5.5))):
        model = prepare_run(plain_run(speed, peak), weak, SURFACE)
        clean = predict_channels(model, PLAIN, slots=(bump.slot,), refinement=4)
        noise = NOISE * np.random.default_rng(i).standard_normal(clean.shape)
        models.append(prepare_run(replace(model.run, response=clean + noise), weak, SURFACE))
    evidence = evidence_of(models, (LIBRARY["brake_fade"],))
    assert find_scanned_ranges(evidence.train) == RANGE | {
        "pressure": (0.0, 8.0),
        "pressure_rate": (-26.7, 26.7),
    }
    best, shapes = find_best_form(evidence, fit_hypotheses(evidence.train, (), evidence.session_sigma))
    assert (best.port, best.variable) == ("brake_torque", "pressure")
    assert shapes[0].name == bump.name


def test_the_noise_of_a_pressure_at_the_end_of_its_range_makes_no_other_scale() -> None:
    runs = evidence_of([measured(plain_run(30.0, 3.6), PLAIN, 0)], ()).train
    noisy = [
        replace(
            run, model=replace(run.model, run=replace(run.model.run, pressure=1.04 * run.model.run.pressure))
        )
        for run in runs
    ]
    assert find_scanned_ranges(noisy) == RANGE


def test_a_form_is_made_again_from_its_name() -> None:
    for shape in SHAPES:
        for port, variable, scale in (
            ("brake_torque", "pressure", 8.1),
            ("pitch_moment", "pressure_rate", 27.0),
        ):
            name = name_form(port, variable, shape, scale)
            form = make_form_in_range(name, (0.1,) * count_coefficients(shape), -40.0, 40.0)
            assert (form.port, form.variable, form.shape, form.scale) == (port, variable, shape, scale)
            assert (form.low, form.high) == (0.0 if variable == "pressure" else -27.0, scale)
    for wrong in (
        "brake_torque ~ a x, x = pressure/8.1 m",
        "brakes ~ a x, x = pressure/8.1 MPa",
        "brake_lag",
    ):
        with pytest.raises(InputError, match="no port, variable and shape of the grammar"):
            make_form_in_range(wrong, (0.1,), 0.0, 1.0)


def test_scatter_of_the_runs_is_what_they_differ_beyond_noise_by_the_t_of_so_few() -> None:
    """Scores of 2, -2, 2, -2 standard errors: a mean square of 16/3 over three degrees of freedom, t 3.18 over 1.96."""
    slopes = [(np.array([[1.0]]), np.zeros((1, 1)))] * 4
    scores = np.array([[2.0], [-2.0], [2.0], [-2.0]])
    widened = 2.0 * np.sqrt(16.0 / 3.0 - 1.0) * 3.182446 / 1.959964
    assert _measure_scatter(scores, slopes, np.eye(1)) == pytest.approx([widened], rel=1e-6)
    assert _measure_scatter(scores / 4.0, slopes, np.eye(1)) == [0.0]
    assert _measure_scatter(scores[:2], slopes[:2], np.eye(1)) == [0.0], (
        "two runs say nothing of their scatter"
    )
