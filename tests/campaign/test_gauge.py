"""The gauge's noise is taken out of the pressure that drives the model; what the driver did is kept."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from catalogs.entries import load
from studies.closing_benchmark.harder import load_harder
from studies.closing_benchmark.synthetic import make_synthetic_campaign
from tasks.campaign.gauge import denoise_pressure, estimate_gauge_noise
from tasks.identification.decision.verdict import judge_runs

TIME = np.arange(600) * 0.01
STOP = 2.0 * np.clip((TIME - 1.0) / 0.3, 0.0, 1.0)
PULSED = STOP * np.where((TIME > 1.5) & ((TIME - 1.5) % 1.0 < 0.5), 0.3, 1.0)


def noise(sigma: float, rho: float = 0.5, seed: int = 1) -> NDArray[np.float64]:
    white = np.random.Generator(np.random.Philox(seed)).standard_normal(len(TIME) + 100)
    return sigma * np.sqrt(1.0 - rho**2) * lfilter([1.0], [1.0, -rho], white)[100:]


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("sigma", [0.005, 0.02])
def test_scale_and_correlation_of_the_gauges_noise_are_found_on_a_slope(sigma: float, rho: float) -> None:
    found = np.array([estimate_gauge_noise(0.2 * TIME + noise(sigma, rho, seed)) for seed in range(20)])
    assert found[:, 1].min() >= 0, (
        "noise that is not correlated does not come out as correlated the other way"
    )
    assert found.mean(axis=0) == pytest.approx((sigma, rho), rel=0.2, abs=0.12 if rho == 0.0 else 0.0)


def test_a_pressure_without_noise_is_left_as_it_is() -> None:
    np.testing.assert_array_equal(denoise_pressure(PULSED), np.where(PULSED < 1e-9, 0.0, PULSED))
    np.testing.assert_array_equal(denoise_pressure(np.zeros(50)), np.zeros(50))


@pytest.mark.parametrize("sigma", [0.005, 0.01, 0.03])
def test_of_a_held_pressure_most_of_the_noise_is_gone(sigma: float) -> None:
    held = (TIME > 1.6) & (TIME < 5.6)
    left = [(denoise_pressure(STOP + noise(sigma, seed=seed)) - STOP)[held].std() for seed in range(10)]
    assert np.mean(left) < 0.5 * sigma


@pytest.mark.parametrize("pressure", [STOP, PULSED], ids=["ramp", "pulses"])
def test_ramps_and_steps_stay_within_the_noise(pressure: NDArray[np.float64]) -> None:
    braking = TIME > 1.1
    for seed in range(10):
        found = denoise_pressure(pressure + noise(0.01, seed=seed))
        assert np.abs(found - pressure)[braking].max() < 3.5 * 0.01


def test_a_foot_that_trembles_is_no_noise_of_the_gauge() -> None:
    trembling = STOP * (1.0 + 0.02 * np.sin(2.0 * np.pi * 5.0 * TIME))
    assert np.abs(denoise_pressure(trembling) - trembling).max() < 0.15 * 0.04


def test_a_gauge_that_cannot_read_below_zero_brakes_no_wheel_at_rest() -> None:
    off = TIME < 0.9
    assert np.all(denoise_pressure(np.maximum(STOP + noise(0.02), 0.0))[off] == 0.0)


@pytest.mark.minutes
def test_stops_of_one_kind_and_a_noisy_gauge_are_no_discovery() -> None:
    """Judged with the pressure as read, a form at the brake is found in it."""
    model, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
    campaign = make_synthetic_campaign(model, surface, {}, 700_100, design=load_harder().drives())
    lag = tuple(
        effect
        for effect in load("library of effects")
        if effect.name in {"brake_lag", "pressure_nonlinearity"}
    )
    assert (
        judge_runs(campaign, model, surface, lag, load("set of decision rules")).verdict.verdict == "NOTHING"
    )
