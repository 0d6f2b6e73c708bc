"""Speed and accelerometer say of each other what they read, whatever drives the car."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import CHANNELS
from tasks.campaign.speed_by_acceleration import FEWEST_SAMPLES
from tasks.identification.inference.forward import RunModel, predict_channels, prepare_run
from tasks.identification.joint import instruments
from tasks.identification.joint.elimination import refit_numbers
from tasks.identification.joint.instruments import (
    drop_contradicted_instruments,
    drop_contradicted_readings,
    relate_instruments,
)
from tasks.vehicle.effects.table import build_parameter_vector
from tests.identification.joint.known_car import RULES, campaign_of, judge_car, slow_brakes
from tests.identification.synthetic import SURFACE, VEHICLE, measured, plain_run

SPEED, ACCELERATION = CHANNELS.index("speed"), CHANNELS.index("longitudinal_acceleration")
NUMBERS = {n.name: n for n in load_joint_numbers()}


def drive(theta: dict[str, float], seed: int = 3) -> list[RunModel]:
    runs = ((29.0, 0.9), (17.0, 2.0), (22.0, 1.4))
    return [measured(plain_run(*run), build_parameter_vector(theta), seed + i) for i, run in enumerate(runs)]


def compare(models: list[RunModel]) -> np.ndarray:
    found = relate_instruments(models, [model.measured for model in models])
    assert found is not None
    return np.array([found.scale, found.delay])


@pytest.mark.parametrize("car", [{}, {"lag": 0.1, "pressure_gain": -0.3, "drag_area": 1.5}])
def test_scale_and_delay_are_those_of_the_instruments_and_not_of_the_car(car: dict[str, float]) -> None:
    plain = compare(drive(car))
    assert plain[1] == pytest.approx(0.0, abs=0.01)
    read = compare(drive(car | {"acceleration_scale": 0.08, "speed_delay": 0.06}))
    assert read[0] - plain[0] == pytest.approx(0.08, abs=0.015)
    assert read[1] - plain[1] == pytest.approx(0.06, abs=0.012)


def test_a_bias_of_each_run_and_a_slow_speed_change_nothing() -> None:
    models = drive({"speed_delay": 0.06})
    slow = []
    for i, model in enumerate(models):
        response = model.run.response.copy()
        response[:, ACCELERATION] += (-1) ** i * 0.4
        sampled = np.ones(response.shape, dtype=bool)
        sampled[:, SPEED] = np.arange(len(response)) % 10 == 3
        response[~sampled[:, SPEED], SPEED] = 99.0
        slow.append(replace(model, run=replace(model.run, response=response, sampled=sampled)))
    assert compare(slow) == pytest.approx(compare(models), abs=0.02)


def test_too_little_motion_tells_nothing() -> None:
    model = prepare_run(plain_run(20.0, 0.0), VEHICLE, SURFACE)
    flat = np.zeros_like(predict_channels(model, build_parameter_vector({})))
    assert relate_instruments([model], [flat]) is None
    short = replace(drive({})[0], samples=FEWEST_SAMPLES - 1)
    assert relate_instruments([short], [short.measured]) is None


def test_an_instruments_error_that_the_instruments_show_stays_and_one_that_they_contradict_goes() -> None:
    late = slow_brakes()
    reasons = list[str]()
    scale = NUMBERS["acceleration_scale"]
    louder = np.where(np.arange(len(CHANNELS)) == ACCELERATION, 1.12, 1.0)
    loud = []
    for stop in late.train:
        run = replace(stop.model.run, response=stop.model.run.response * louder)
        loud.append(replace(stop, model=replace(stop.model, run=run)))
    true = refit_numbers(loud, late.fitted, (*late.fitted.numbers, scale), {"acceleration_scale": 0.05})
    assert true.by_name["acceleration_scale"] == pytest.approx(0.12, abs=0.03)
    assert drop_contradicted_instruments(loud, true, RULES.joint, reasons) is true and not reasons
    wrong = refit_numbers(
        late.train, late.fitted, (*late.fitted.numbers, NUMBERS["acceleration_scale"], NUMBERS["speed_delay"])
    )
    place = [n.name for n in wrong.numbers].index("speed_delay")
    values = wrong.values.copy()
    values[place] = 0.1
    wrong = replace(wrong, values=values)
    left = drop_contradicted_instruments(late.train, wrong, RULES.joint, reasons)
    assert "speed_delay" not in left.by_name and "lag" in left.by_name
    assert any("the speed signal is 0.1 s late, but that makes good less than half" in r for r in reasons)
    # the same of what stands for a named number; other numbers are none of theirs
    rivals = [SimpleNamespace(name=name, fitted=wrong) for name in ("speed_delay", "lag")]
    assert [rival.name for rival in drop_contradicted_readings(late.train, rivals)] == ["lag"]


@pytest.mark.parametrize("name", ["acceleration_scale", "speed_delay"])
@pytest.mark.parametrize(("told", "wrong"), [(0.02, True), (0.04, False), (0.08, False), (0.10, True)])
def test_an_instruments_error_must_explain_half_of_what_the_two_disagree_by(
    monkeypatch: pytest.MonkeyPatch, name: str, told: float, wrong: bool
) -> None:
    """An accelerometer was 11 % off where it read 6 % more than the rate of speed."""
    readings = iter(SimpleNamespace(scale=1.0 + off, delay=off) for off in (0.06, told, 0.0))
    monkeypatch.setattr(instruments, "relate_instruments", lambda *_: next(readings))
    fitted = SimpleNamespace(by_name={name: told}, offsets=())
    assert instruments.make_instrument_check([])(fitted, name) is wrong


def test_nothing_is_contradicted_where_no_accelerometer_was_measured() -> None:
    late = judge_car(campaign_of({"pressure_gain": 0.3, "lag": 0.09}, channels=("speed",)))
    wrong = refit_numbers(
        late.train, late.fitted, (*late.fitted.numbers, NUMBERS["speed_delay"]), {"speed_delay": 0.1}
    )
    assert drop_contradicted_instruments(late.train, wrong, RULES.joint, []) is wrong
