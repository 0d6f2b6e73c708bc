"""The generator of known truths, and the interval that its counts are given with."""

import numpy as np
import pytest
from scipy.stats import binom

from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle
from tasks.closure.benchmark import TRAINING, exact_interval, synthetic_campaign

VEHICLE, SURFACE = load_vehicle("paper-reference"), load_surface("dense-asphalt")


def test_the_same_seed_gives_the_same_campaign_and_another_does_not() -> None:
    first, again, other = (synthetic_campaign(VEHICLE, SURFACE, {"fade": 0.05}, seed) for seed in (3, 3, 4))
    assert all(np.array_equal(a.response, b.response) for a, b in zip(first.runs, again.runs, strict=True))
    assert not np.array_equal(first.runs[0].response, other.runs[0].response)
    assert len(first.train) == TRAINING and len(first.held_out) == len(first.runs) - TRAINING


def test_the_truth_shows_in_the_runs_that_feel_it() -> None:
    plain, faded = (synthetic_campaign(VEHICLE, SURFACE, truth, 5) for truth in ({}, {"fade": 0.06}))
    hot = next(i for i, run in enumerate(plain.runs) if run.disc_rise == 350.0)
    assert faded.runs[hot].response[-1, 0] - plain.runs[hot].response[-1, 0] > 1.0
    coasting = next(i for i, run in enumerate(plain.runs) if run.pressure.max() == 0.0)
    assert np.array_equal(faded.runs[coasting].response, plain.runs[coasting].response)


def test_the_exact_interval_is_clopper_and_pearsons() -> None:
    assert exact_interval(0, 100) == pytest.approx((0.0, 1.0 - 0.025**0.01))
    low, high = exact_interval(3, 40)
    assert binom.sf(2, 40, low) == pytest.approx(0.025) and binom.cdf(3, 40, high) == pytest.approx(0.025)
