"""How certain a number is follows from the misfit, what it remembers, and the scatter over runs, by the rules."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from catalogs.decision_rules import load_decision_rules
from tasks.identification.joint.uncertainty import (
    certain_from,
    compute_interval_reach,
    standard_errors,
)
from tests.identification.joint.known_car import fit_of

RULES = load_decision_rules().joint
MOST = RULES.most_residual_correlation


def remembering(rng: np.random.Generator, count: int, kept: float) -> np.ndarray:
    """Return first-order autoregressive noise of variance 1, float64 [N]."""
    white = rng.standard_normal(count)
    return np.asarray(lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], white))


def test_the_misfit_of_the_run_that_is_followed_worst_widens_an_error():
    fitted = fit_of([np.resize([3.0, -3.0], 100), np.resize([0.5, -0.5], 100)])
    assert standard_errors(fitted, RULES)[0] == pytest.approx(np.sqrt(9.0 / 200.0))
    assert standard_errors(fit_of([np.zeros(100)]), RULES)[0] == pytest.approx(np.sqrt(1.0 / 100.0))


def test_the_scatter_of_runs_counts_where_there_are_enough_of_them():
    runs = [np.resize([level, -level], 100) + level for level in (0.4, -0.4, 0.4, -0.4)]
    (alone,) = standard_errors(fit_of(runs), replace(RULES, fewest_scatter_runs=len(runs) + 1))
    (scattered,) = standard_errors(fit_of(runs), replace(RULES, fewest_scatter_runs=len(runs)))
    assert scattered > 2.0 * alone


@pytest.mark.parametrize("most", [0.5, MOST])
def test_an_interval_of_few_runs_is_as_wide_as_misfit_that_remembers_makes_it_up_to_a_limit(most: float):
    """The mean of N samples that keep rho of the one before has N (1 - rho)/(1 + rho) of them to itself."""
    fitted = fit_of([np.full(4000, 2.0)])  # correlated by 0.99975 from sample to sample
    (reach,) = compute_interval_reach(fitted, replace(RULES, most_residual_correlation=most))
    by_memory = 1.96 * np.sqrt(4.0 * (1.0 + most) / (1.0 - most) / 4000)
    by_misfit = student.ppf(0.975, 1) * np.sqrt(4.0 / 4000)
    assert reach == pytest.approx(max(by_memory, by_misfit), rel=0.02)


def test_two_channels_that_miss_alike_say_no_more_than_one():
    misfit = remembering(np.random.default_rng(2), 2000, 0.95)
    both = fit_of([np.repeat(misfit, 2)] * 3, [np.ones((2000, 2), dtype=bool)] * 3)
    (one,), (two,) = (compute_interval_reach(fitted, RULES) for fitted in (fit_of([misfit] * 3), both))
    assert two == pytest.approx(one, rel=0.01)  # but for the prior


def test_a_slow_channel_remembers_from_sample_to_sample():
    misfit = remembering(np.random.default_rng(3), 500, 0.9)
    slow = np.zeros((5000, 1), dtype=bool)
    slow[::10] = True
    (dense,), (sparse,) = (
        compute_interval_reach(fitted, RULES)
        for fitted in (fit_of([misfit] * 3), fit_of([misfit] * 3, [slow] * 3))
    )
    assert sparse == pytest.approx(dense, rel=1e-6)


@pytest.mark.parametrize("kept", [0.0, 0.95])
def test_intervals_of_three_runs_hold_the_truth_whatever_the_misfit_remembers(kept: float):
    """The truth is 0: a derivative of 1 in each of two channels makes the number the mean of what is left."""
    rng, held = np.random.default_rng(4), 0
    for _ in range(200):
        runs = [np.column_stack([remembering(rng, 300, kept) for _ in range(2)]) for _ in range(3)]
        found = float(np.mean(runs))
        fitted = fit_of([(run - found).ravel() for run in runs], [np.ones((300, 2), dtype=bool)] * 3)
        held += abs(found) < compute_interval_reach(fitted, RULES)[0]
    assert held >= 180


def test_a_number_is_certain_from_the_chance_of_a_false_name():
    assert certain_from(fit_of([np.zeros(100)] * 2), RULES) == pytest.approx(student.ppf(0.975, 1))
    fitted = fit_of([np.zeros(100)] * 3)
    for chance in (RULES.false_name_chance, 0.01):
        rules = replace(RULES, false_name_chance=chance)
        limit = student.ppf(1.0 - chance, RULES.fewest_scatter_runs - 1)
        assert certain_from(fitted, rules) == pytest.approx(limit)
