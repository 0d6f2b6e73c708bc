"""The odds of explanations are those of the Gaussian that they stand for, and runs that disagree count less."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.stats import multivariate_normal

from tasks.identification.decision.agreement import is_one_size
from tasks.identification.decision.comparison import compare_explanations, temper_odds
from tasks.identification.decision.odds import (
    RunGrams,
    can_stand_for,
    search_explanations,
    weigh_explanation,
)
from tasks.identification.decision.random_effects import estimate_spread
from tests.identification.explained import effect_of, form_of, grams_of

LAG, DRAG = effect_of("brake_lag", 0, log_prior=-1.5), effect_of("aerodynamic_drag", 1, log_prior=-2.5)
SPIKE = 0.3


def make_data(
    amplitudes: list[tuple[float, float]], samples: int = 6
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Derivatives by two numbers, and residuals of a car that has them, with another size in each run."""
    rng = np.random.default_rng(2)
    designs = [rng.standard_normal((samples, 2)) for _ in amplitudes]
    return designs, [
        x @ np.array(a) + rng.standard_normal(samples) for x, a in zip(designs, amplitudes, strict=True)
    ]


@pytest.mark.parametrize("centre", [0.0, 1.5])
def test_the_gain_of_a_candidate_is_that_of_the_integral_over_its_slab_and_the_others_spike(
    centre: float,
) -> None:
    designs, residuals = make_data([(2.0, 0.1), (1.6, 0.0)])
    # about any linearisation point the runs say the same
    moved = [r - centre * x[:, 0] for x, r in zip(designs, residuals, strict=True)]
    grams = grams_of((LAG, DRAG), designs, moved, SPIKE)
    point = grams.centre.copy()
    point[0] = centre
    weighed = weigh_explanation(replace(grams, centre=point), [LAG], spread=False)
    assert weighed is not None

    def integrate(slab: float) -> float:
        def density(drag: float, lag: float) -> float:
            left = [r - x @ (lag, drag) for x, r in zip(designs, residuals, strict=True)]
            misfit = sum(e @ e for e in left) + (lag / slab) ** 2 + (drag / SPIKE) ** 2
            return float(np.exp(-0.5 * misfit) / slab)

        return dblquad(density, -5.0, 5.0, -2.0, 2.0, epsabs=0.0, epsrel=1e-6)[0]

    gain = np.log(integrate(LAG.slab) / integrate(SPIKE))
    assert gain > 5.0 and weighed.gain == pytest.approx(gain, abs=1e-3)
    assert weighed.log_odds == pytest.approx(gain + LAG.log_prior, abs=1e-3)


def test_with_a_spread_every_run_has_an_amplitude_of_its_own_that_is_integrated_out_too() -> None:
    designs, residuals = make_data([(4.0, 0.0), (1.0, 0.0), (6.0, 0.0), (2.5, 0.0)])
    grams = grams_of((LAG, DRAG), designs, residuals, SPIKE)
    plain, spread = (weigh_explanation(grams, [LAG], spread=s) for s in (False, True))
    assert plain is not None and spread is not None
    (share,) = spread.spreads
    assert 0.2 < share < 1.0
    whole, joined = np.vstack(designs), np.concatenate(residuals)
    noise = np.eye(len(joined))
    for i, x in enumerate(designs):
        own = slice(i * len(x), (i + 1) * len(x))
        # the direction is the explanation's mean: what else it holds than the lag is no part of it
        direction = x[:, 0] * plain.values[0] * share
        noise[own, own] += np.outer(direction, direction)
    named, none = (
        multivariate_normal(cov=noise + whole @ np.diag((prior**2, SPIKE**2)) @ whole.T).logpdf(joined)
        for prior in (LAG.slab, SPIKE)
    )
    assert spread.log_odds - LAG.log_prior == pytest.approx(named - none, rel=1e-6)
    assert spread.errors[0] > 1.5 * plain.errors[0]


def test_the_spread_of_runs_is_that_of_dersimonian_and_laird() -> None:
    # estimates 0, 1 and 4 with weights 2, 4 and 2: mean 1.5, Q = 18, scale 8 - 24/8 = 5, (18 - 2) / 5
    size, pull = np.array([2.0, 4.0, 2.0]), np.array([0.0, 4.0, 8.0])
    assert estimate_spread(size, pull) == pytest.approx(3.2)
    assert estimate_spread(size, size) == 0.0, "runs that agree"
    assert estimate_spread(size[:2], pull[:2]) == 0.0, "two runs tell no scatter"
    silent = np.append(size, 1e-8), np.append(pull, 1e-3)
    assert estimate_spread(*silent) == pytest.approx(3.2), "a run that hardly feels it says nothing of it"


def balance(*pulls: tuple[float, float]) -> RunGrams:
    """Runs of the same information about two numbers, and of these scores."""
    designs = [np.eye(2) * 5.0 for _ in pulls]
    return grams_of((LAG, replace(DRAG, log_prior=LAG.log_prior)), designs, [np.array(p) for p in pulls])


@pytest.mark.parametrize("signature_error", [0.0, 0.1])
def test_a_comparison_reads_the_same_from_either_side(signature_error: float) -> None:
    pulls = ((5.0, 4.0), (6.0, 4.5), (5.0, 5.0), (7.0, 3.0), (5.0, 5.0))
    compared = []
    for runs in (pulls, pulls[:2]):
        grams = balance(*runs)
        one, other = (weigh_explanation(grams, [c]) for c in grams.columns.candidates)
        assert one is not None and other is not None
        compared.append(compare_explanations(grams, one, other, signature_error))
        assert compare_explanations(grams, other, one, signature_error) == pytest.approx(
            -compared[-1], rel=1e-9
        )
    assert all(odds > 0.5 for odds in compared)


def test_no_comparison_hangs_on_one_run() -> None:
    grams = balance((12.0, 0.0), (5.0, 5.0), (5.0, 5.0), (5.0, 5.0), (5.0, 5.0))
    one, other = (weigh_explanation(grams, [c]) for c in grams.columns.candidates)
    assert one is not None and other is not None and one.gain - other.gain > 5.0
    assert abs(compare_explanations(grams, one, other, 0.0)) < 1.0


def test_two_explanations_that_half_of_the_runs_decide_either_way_are_not_told_apart() -> None:
    agreed, split = balance(*[(5.5, 5.0)] * 4), balance((21.0, 0.0), (0.0, 20.0), (0.0, 20.0), (21.0, 0.0))
    plain, compared = [], []
    for grams in (agreed, split):
        one, other = (weigh_explanation(grams, [c]) for c in grams.columns.candidates)
        assert one is not None and other is not None
        plain.append(one.gain - other.gain)
        compared.append(compare_explanations(grams, one, other, 0.0))
    assert compared[0] > 0.5 * plain[0], "runs that agree decide"
    assert plain[1] > 20.0 and abs(compared[1]) < 1.0


def test_what_the_runs_disagree_about_does_not_gain_by_that() -> None:
    """A force along the road that fitted one of three stops was held to be e^109 times as likely as the lag."""
    sizes, drags = (10.0, 1.0, 1.0, 1.0), (1.0, 8.0, 9.0, 10.0)
    designs = [size * np.eye(2) for size in sizes]
    grams = grams_of((LAG, DRAG), designs, [x @ (10.0, drag) for x, drag in zip(designs, drags, strict=True)])
    lag, drag = (weigh_explanation(grams, [c]) for c in grams.columns.candidates)
    assert lag is not None and drag is not None
    assert lag.gain > 50.0 * drag.gain and drag.spreads[0] > 1.0
    assert compare_explanations(grams, lag, drag, 0.0) > 3.0


def test_what_an_error_of_the_signature_may_make_is_no_evidence() -> None:
    assert temper_odds(10.0, 100.0, 0.0, 0.1) == pytest.approx(5.0)
    assert temper_odds(-10.0, 100.0, 0.0, 0.1) == pytest.approx(-5.0)
    assert temper_odds(10.0, -3.0, 0.0, 0.1) == temper_odds(10.0, 100.0, 50.0, 0.0) == 10.0
    # a small second effect beside a large one, and what a tenth of the large one would make
    assert temper_odds(100.0, 2100.0, 2000.0, 0.1) == pytest.approx(40.0)
    assert temper_odds(19.0, 2019.0, 2000.0, 0.1) == 0.0


@pytest.mark.parametrize(("sizes", "one"), [((1.0, 1.1, 0.9, 1.0), True), ((0.2, 0.5, 1.0, 2.0), False)])
def test_an_effect_has_one_size_in_all_runs(sizes: tuple[float, ...], one: bool) -> None:
    """Errors of a tenth are no other size, however well each run tells its own."""
    designs = [np.eye(2) * 50.0 for _ in sizes]
    grams = grams_of((LAG, DRAG), designs, [x @ (size, 0.0) for x, size in zip(designs, sizes, strict=True)])
    weighed = weigh_explanation(grams, [LAG])
    assert weighed is not None
    assert is_one_size(grams, weighed, LAG, 0.2) is one
    assert not is_one_size(grams, weighed, LAG, 0.0)


def test_the_search_finds_a_set_that_no_single_candidate_explains_and_none_beyond_its_bounds() -> None:
    grams = balance(*[(6.0, 7.0)] * 3)
    found = search_explanations(grams, most=2, width=2)
    assert [e.names for e in found[:2]] == [("brake_lag", "aerodynamic_drag"), ("aerodynamic_drag",)]
    assert () in [e.names for e in found] and len(found) == 4
    short = replace(LAG, upper=1.0)
    columns = replace(grams.columns, candidates=(short, DRAG))
    names = [e.names for e in search_explanations(replace(grams, columns=columns), most=2, width=2)]
    assert sorted(names) == [(), ("aerodynamic_drag",)]
    # another value of the second number of the same effect is no second member
    again = replace(grams.columns, candidates=(LAG, replace(LAG, second=2.0)))
    names = [e.names for e in search_explanations(replace(grams, columns=again), most=2, width=2)]
    assert names == [("brake_lag",), ("brake_lag",), ()]


@pytest.mark.parametrize(
    ("port", "variable", "name", "stands"),
    [
        ("brake_torque", "pressure", "pressure_nonlinearity", True),
        ("brake_torque", "pressure", "retuned_pressure_gain", True),  # a constant at its port
        ("longitudinal_force", "speed", "pad_drag", True),  # one force along the road
        ("longitudinal_force", "speed", "engine_braking_speed", True),  # speeds that differ by the slip alone
        ("longitudinal_force", "speed", "pressure_nonlinearity", False),
        ("friction", "speed", "pad_drag", False),
        ("brake_torque", "pressure", "sensor_speed_delay", False),
    ],
)
def test_a_form_stands_for_what_acts_at_its_port_by_its_variable(
    port: str, variable: str, name: str, stands: bool
) -> None:
    assert can_stand_for(form_of(port, variable, [1]), effect_of(name, 0)) is stands
