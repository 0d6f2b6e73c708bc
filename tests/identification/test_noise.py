"""Noise from what precedes the brake: known noise is found, a coarse sensor is no breakdown, no quiet is told."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.campaign.campaign import CHANNELS, Campaign, Run
from tasks.errors import InputError
from tasks.identification.inference.noise import estimate_channel_noise, unwhiten_channels, whiten_channels
from tests.identification.synthetic import NOISE, TOLERANCES, plain_run


def quiet_campaign(step: np.ndarray | float = 0.0, brake_at: float = 1.0, *, noise: float = 1.0) -> Campaign:
    """Runs at constant speed before the brake, read in steps of ``step``."""
    rng = np.random.default_rng(1)
    runs = []
    for k in range(4):
        run: Run = plain_run(15.0, 1.5, name=f"run-{k + 1:02d}")
        response = run.response + noise * NOISE * rng.standard_normal(run.response.shape)
        steps = np.broadcast_to(step, len(CHANNELS))
        coarse = np.where(steps > 0, np.round(response / np.where(steps > 0, steps, 1)) * steps, response)
        shift = round((1.0 - brake_at) / run.interval)
        pressure = np.concatenate((run.pressure[shift:], np.full(shift, run.pressure[-1])))
        runs.append(replace(run, response=coarse, pressure=pressure, held_out=k == 3))
    return Campaign(
        name="quiet", vehicle="paper-reference", runs=tuple(runs), tolerances=TOLERANCES, content_hash="",
        split_hash="",
    )  # fmt: skip


def test_white_noise_is_found() -> None:
    rho, sigma = estimate_channel_noise(quiet_campaign())
    assert sigma == pytest.approx(NOISE, rel=0.25) and (rho < 0.3).all()


@pytest.mark.parametrize("coarseness", [3.0, 10.0])
def test_a_coarse_channel_has_the_noise_of_its_rounding(coarseness: float) -> None:
    step = coarseness * NOISE
    campaign = quiet_campaign(step)
    # one far reading, so that a channel that stands still before the brake has a step at all
    moved = campaign.runs[0].response.copy()
    moved[-1] += step
    moved[-2, CHANNELS.index("wheel_speed_rear")] += step[CHANNELS.index("wheel_speed_rear")]
    campaign = replace(campaign, runs=(replace(campaign.runs[0], response=moved), *campaign.runs[1:]))
    rho, sigma = estimate_channel_noise(campaign)
    assert (sigma >= 0.999 * step / np.sqrt(12)).all() and (sigma < step).all()
    assert np.isfinite(whiten_channels(campaign.runs[0].response, rho, sigma)).all()


def test_one_coarse_channel_leaves_the_others_as_they_are() -> None:
    step = np.zeros(len(CHANNELS))
    step[CHANNELS.index("wheel_speed_rear")] = 0.3
    rho, sigma = estimate_channel_noise(quiet_campaign(step))
    whole_rho, whole_sigma = estimate_channel_noise(quiet_campaign())
    fine = step == 0
    assert (rho[fine] == whole_rho[fine]).all() and (sigma[fine] == whole_sigma[fine]).all()


def test_a_channel_that_was_not_measured_weighs_nothing() -> None:
    campaign = quiet_campaign()
    seen = tuple(name for name in CHANNELS if name != "pitch")
    _, sigma = estimate_channel_noise(replace(campaign, channels=seen))
    assert (
        np.isinf(sigma[CHANNELS.index("pitch")])
        and np.isfinite(np.delete(sigma, CHANNELS.index("pitch"))).all()
    )
    assert (
        whiten_channels(np.ones((5, 7)), np.zeros(7), sigma).reshape(5, 7)[:, CHANNELS.index("pitch")] == 0.0
    ).all()


def test_a_channel_that_never_changes_and_runs_that_are_too_short_are_both_named() -> None:
    campaign = quiet_campaign()
    runs = []
    for run in campaign.runs:
        still = run.response[:9].copy()
        still[:, CHANNELS.index("pitch")] = 0.0
        runs.append(replace(run, response=still, pressure=run.pressure[:9]))
    with pytest.raises(InputError) as caught:
        estimate_channel_noise(replace(campaign, runs=tuple(runs)))
    text = str(caught.value)
    assert (
        len(caught.value.problems) == 2
        and "channel pitch must change" in text
        and "more than 9 samples" in text
    )


def log_slowly(campaign: Campaign, channel: int, every: int) -> Campaign:
    """The campaign with one channel that has a sample at every few instants only, and a line between them."""
    runs = []
    for k, run in enumerate(campaign.runs):
        rows = np.arange(k % every, len(run.response), every)
        response, sampled = run.response.copy(), np.ones(run.response.shape, dtype=bool)
        response[:, channel] = np.interp(np.arange(len(response)), rows, response[rows, channel])
        sampled[:, channel] = np.isin(np.arange(len(response)), rows)
        runs.append(replace(run, response=response, sampled=sampled))
    return replace(campaign, runs=tuple(runs))


def test_the_noise_of_a_slow_channel_is_that_of_its_own_samples() -> None:
    speed = CHANNELS.index("speed")
    rho, sigma = estimate_channel_noise(log_slowly(quiet_campaign(), speed, 4))
    _, whole_sigma = estimate_channel_noise(quiet_campaign())
    assert sigma[speed] == pytest.approx(NOISE[speed], rel=0.4) and rho[speed] < 0.5
    assert np.delete(sigma, speed) == pytest.approx(np.delete(whole_sigma, speed), rel=1e-9)


def test_a_slow_channel_is_white_at_its_samples_and_weighs_nothing_between_them() -> None:
    x = np.random.default_rng(2).standard_normal((40, 7, 2))
    rho = np.full(7, 0.5)
    sampled = np.ones((40, 7), dtype=bool)
    sampled[:, 0] = np.arange(40) % 5 == 3
    white = whiten_channels(x, rho, NOISE, sampled).reshape(x.shape)
    alone = whiten_channels(x[3::5], rho, NOISE).reshape((8, 7, 2))
    np.testing.assert_array_equal(white[3::5, 0], alone[:, 0])
    assert (white[~sampled[:, 0], 0] == 0.0).all()
    np.testing.assert_array_equal(white[:, 1:], whiten_channels(x, rho, NOISE).reshape(x.shape)[:, 1:])
    back = unwhiten_channels(white.reshape(-1, 2), rho, NOISE, sampled)
    assert back[sampled] == pytest.approx(x[sampled]) and (back[~sampled] == 0.0).all()


@pytest.mark.parametrize(("quiet", "is_told"), [(1.5, True), (0.8, False)])
def test_a_receiver_of_10_hz_has_the_noise_of_its_few_samples_before_the_brake(
    quiet: float, is_told: bool
) -> None:
    """Fifteen samples were too few, the braking counted as noise of 0.65 m/s, and no stop was missed."""
    rng = np.random.default_rng(5)
    time = np.arange(50) * 0.1
    runs = []
    for k in range(8):
        response = np.zeros((50, len(CHANNELS)))
        response[:, 0] = 25.0 - 4.0 * np.maximum(time - quiet, 0.0) + 0.03 * rng.standard_normal(50)
        pressure = np.where(time > quiet, 2.0, 0.0)
        runs.append(
            replace(plain_run(25.0, 2.0), name=f"r{k}", interval=0.1, response=response, pressure=pressure)
        )
    campaign = Campaign(
        name="slow", vehicle="paper-reference", runs=tuple(runs), tolerances=TOLERANCES, content_hash="",
        split_hash="", channels=("speed",),
    )  # fmt: skip
    sigma = estimate_channel_noise(campaign)[1][0]
    assert bool(abs(sigma - 0.03) < 0.01) is is_told
