"""Motion of a real vehicle that the model lacks is no fault of its measurement."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.effects import load_effects
from tasks.campaign.campaign import CHANNELS, Run
from tasks.campaign.run_validation import find_motion_problem, find_recording_problems
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import EFFECT_TABLE
from tests.identification.synthetic import NOISE, SURFACE, VEHICLE, plain_run

EFFECTS = load_effects()


def columns_of(run: Run, theta: np.ndarray) -> dict[str, np.ndarray]:
    """The run as a car with ``theta`` would have been measured."""
    clean = predict_channels(prepare_run(run, VEHICLE, SURFACE), theta, refinement=4)
    response = clean + NOISE * np.random.default_rng(3).standard_normal(clean.shape)
    columns = dict(zip(CHANNELS, response.T, strict=True))
    return {"time": run.interval * np.arange(len(response)), "brake_pressure": run.pressure, **columns}


def test_a_stop_that_a_slow_log_leaves_with_few_samples_is_no_car_that_stands() -> None:
    city_stop = np.concatenate((np.full(8, 14.0), np.linspace(14.0, 0.0, 8), np.zeros(4)))
    problem = find_motion_problem(city_stop, 0.5, False)
    assert problem is not None and "for 20 samples, which take 10 s at 2 Hz" in problem
    assert "where it drives, log faster or take a longer run" in problem


@pytest.mark.parametrize(("count", "interval"), [(20, 0.01), (150, 0.001)])
def test_a_run_shorter_than_the_smoothing_is_checked_as_any_other(count: int, interval: float) -> None:
    """Twenty samples at 100 Hz are a run; they used to end in a traceback."""
    run = replace(plain_run(20.0, 2.0), interval=interval)
    columns = {name: values[:count] for name, values in columns_of(run, np.zeros(len(EFFECT_TABLE))).items()}
    columns["brake_pressure"] = np.linspace(0.0, 0.5, count)
    assert find_recording_problems(columns, {}, interval, CHANNELS) == []


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
@pytest.mark.parametrize("share", [-0.5, 0.5])
def test_an_effect_that_the_model_lacks_is_no_fault(effect: Effect, share: float) -> None:
    theta = np.zeros(len(EFFECT_TABLE))
    for k, parameter in enumerate(effect.parameters):
        bound = parameter.upper if share > 0 else parameter.lower
        size = abs(share) * bound
        if parameter.effect == "engine braking":
            size = min(size, 10.0 * parameter.step)  # a car's, where the bounds are those of trucks
        theta[parameter.index] = size if k == 0 else parameter.start
    for speed, peak in ((6.0, 1.0), (15.0, 1.5), (20.0, 4.0)):
        run = replace(plain_run(speed, peak), disc_rise=150.0)
        assert find_recording_problems(columns_of(run, theta), {}, run.interval, CHANNELS) == []
