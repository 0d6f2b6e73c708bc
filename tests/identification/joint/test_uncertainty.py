"""How certain a number is follows from the misfit, what it remembers, and the scatter over runs, by the rules."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from catalogs.decision_rules import load_decision_rules
from tasks.identification.joint.uncertainty import (
    compute_interval_reach,
    compute_naming_distance,
    compute_standard_errors,
    measure_certainty,
    weigh_robustly,
)
from tests.identification.joint.known_car import fit_of

RULES = load_decision_rules().joint


def make_correlated_noise(rng: np.random.Generator, count: int, kept: float) -> np.ndarray:
    """Return first-order autoregressive noise of variance 1, float64 [N]."""
    white = rng.standard_normal(count)
    return np.asarray(lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], white))


def test_the_misfit_of_the_run_that_is_followed_worst_widens_an_error():
    fitted = fit_of([np.resize([3.0, -3.0], 100), np.resize([0.5, -0.5], 100)])
    assert compute_standard_errors(fitted, RULES)[0] == pytest.approx(np.sqrt(9.0 / 200.0))
    assert compute_standard_errors(fit_of([np.zeros(100)]), RULES)[0] == pytest.approx(np.sqrt(1.0 / 100.0))


def test_the_scatter_of_runs_counts_where_there_are_enough_of_them():
    runs = [np.resize([level, -level], 100) + level for level in (0.4, -0.4, 0.4, -0.4)]
    (alone,) = compute_standard_errors(fit_of(runs), replace(RULES, fewest_scatter_runs=len(runs) + 1))
    (scattered,) = compute_standard_errors(fit_of(runs), replace(RULES, fewest_scatter_runs=len(runs)))
    assert scattered > 2.0 * alone


@pytest.mark.parametrize("memory", [0.02, 1.0])
def test_an_interval_of_few_runs_is_as_wide_as_misfit_that_remembers_makes_it_up_to_a_limit(memory: float):
    """The mean of N samples that keep rho of the one before has N (1 - rho)/(1 + rho) of them to itself."""
    fitted = fit_of([np.full(4000, 2.0)])  # correlated by 0.99975 from sample to sample
    most = np.exp(-fitted.interval / memory)
    (reach,) = compute_interval_reach(fitted, replace(RULES, longest_memory=memory))
    by_memory = 1.96 * np.sqrt(4.0 * (1.0 + most) / (1.0 - most) / 4000)
    by_misfit = student.ppf(0.975, 1) * np.sqrt(4.0 / 4000)
    assert reach == pytest.approx(max(by_memory, by_misfit), rel=0.02)


def test_two_channels_that_miss_alike_say_no_more_than_one():
    misfit = make_correlated_noise(np.random.default_rng(2), 2000, 0.95)
    both = fit_of([np.repeat(misfit, 2)] * 3, [np.ones((2000, 2), dtype=bool)] * 3)
    (one,), (two,) = (compute_interval_reach(fitted, RULES) for fitted in (fit_of([misfit] * 3), both))
    assert two == pytest.approx(one, rel=1e-6)


def test_a_slow_channel_remembers_from_sample_to_sample():
    misfit = make_correlated_noise(np.random.default_rng(3), 500, 0.9)
    slow = np.zeros((5000, 1), dtype=bool)
    slow[::10] = True
    (dense,), (sparse,) = (
        compute_interval_reach(fitted, RULES)
        for fitted in (fit_of([misfit] * 3), fit_of([misfit] * 3, [slow] * 3))
    )
    assert sparse == pytest.approx(dense, rel=1e-6)


@pytest.mark.parametrize("kept", [0.0, 0.95, 0.99])
def test_intervals_of_three_runs_hold_the_truth_whatever_the_misfit_remembers(kept: float):
    """The truth is 0: a derivative of 1 in each of two channels makes the number the mean of what is left."""
    rng, held = np.random.default_rng(4), 0
    for _ in range(200):
        runs = [np.column_stack([make_correlated_noise(rng, 300, kept) for _ in range(2)]) for _ in range(3)]
        found = float(np.mean(runs))
        fitted = fit_of([(run - found).ravel() for run in runs], [np.ones((300, 2), dtype=bool)] * 3)
        held += abs(found) < compute_interval_reach(fitted, RULES)[0]
    # a memory of a second is hardly seen in runs of three
    assert held >= (160 if kept > 0.95 else 180)


@pytest.mark.parametrize("size", [0.45, 1.0, 2.0])
@pytest.mark.parametrize("count", [4, 10])
def test_intervals_of_many_runs_hold_the_truth_however_large_the_robust_misfit_is(count: int, size: float):
    """The truth is 0: a robust fit of a derivative of 1, whose loss weighs large misfit less."""
    rng, held = np.random.default_rng(5), 0
    for _ in range(150):
        runs = [size * make_correlated_noise(rng, 200, 0.95) for _ in range(count)]
        every, found = np.concatenate(runs), 0.0
        for _ in range(20):
            found += float(
                np.sum(weigh_robustly(every - found)) / np.sum((1.0 + (every - found) ** 2) ** -0.5)
            )
        fitted = fit_of([run - found for run in runs])
        held += abs(found) < compute_interval_reach(fitted, RULES)[0]
    assert held >= 134  # of 150; 0.95 less three standard errors


def test_a_number_is_certain_from_the_chance_of_a_false_name():
    for chance in (RULES.false_name_chance, 0.01):
        rules = replace(RULES, false_name_chance=chance)
        for runs, freedom in ((2, 3), (4, 3), (9, 8)):
            assert compute_naming_distance(runs, rules) == pytest.approx(student.ppf(1.0 - chance, freedom))


@pytest.mark.parametrize(("runs", "kept"), [(2, 0.0), (3, 0.98), (5, 0.0)])
def test_no_number_is_certain_whose_interval_holds_0(runs: int, kept: float):
    misfit = make_correlated_noise(np.random.default_rng(6), 400, kept)
    fitted = fit_of([misfit] * runs)
    (reach,) = compute_interval_reach(fitted, RULES)
    (error,) = compute_standard_errors(fitted, RULES)
    needed = max(reach, compute_naming_distance(runs, RULES) * error)
    for share in (0.99, 1.01):
        (certainty,) = measure_certainty(replace(fitted, values=np.array([share * needed])), RULES)
        assert certainty == pytest.approx(share)


@pytest.mark.parametrize("runs", [2, 12])
def test_a_delay_is_no_surer_than_when_the_driver_lifts_and_other_numbers_are(runs: int):
    fitted = fit_of([np.resize([1.0, -1.0], 100)] * runs)
    (known,), (guessed,) = (
        compute_interval_reach(replace(fitted, delay_doubt=doubt), RULES) for doubt in (0.0, 0.02)
    )
    assert guessed == pytest.approx(np.hypot(known, 1.96 * 0.02), rel=1e-3)
    fade = tuple(replace(n, group="curve") for n in fitted.numbers)
    assert compute_interval_reach(replace(fitted, numbers=fade, delay_doubt=0.02), RULES) == [known]
