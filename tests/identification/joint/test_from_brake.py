"""Numbers of the brakes that only the drive before the brake shows are a driver's doing, whom no channel tells of."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.identification.joint import from_brake
from tasks.identification.joint.from_brake import drop_feigned_numbers, make_driver_check
from tests.identification.joint.known_car import (
    FEW,
    NUMBERS,
    RULES,
    campaign_of,
    fit_of,
    judge_car,
)
from tests.identification.synthetic import SURFACE, VEHICLE

PADS = next(n for n in NUMBERS if n.name == "pad_speed")
LAG = next(n for n in NUMBERS if n.name == "lag")
JOINT = RULES.joint


def fit_with(values: dict[str, float]):
    """Return a fit of a lag and the pads' friction by speed."""
    both = fit_of([np.zeros(100)])
    return replace(both, numbers=(LAG, PADS), values=np.array([values["lag"], values["pad_speed"]]))


@pytest.mark.parametrize(("from_the_brake", "feigned"), [(0.0021, ["pad_speed"]), (0.0029, [])])
def test_a_number_of_the_brakes_must_differ_from_the_file_from_the_brake_on(
    monkeypatch, from_the_brake: float, feigned: list[str]
):
    """Pads of .44 % per m/s were named on a car that lacked nothing, whose driver lifted before he braked."""
    campaign = campaign_of({})
    stops = judge_car(campaign, numbers=FEW).train
    asked = []

    def fit_from_brake(begun, numbers, starts, *, scales):
        asked.append([stop.model.samples for stop in begun])
        return [fit_with({"lag": 0.0, "pad_speed": from_the_brake})]

    monkeypatch.setattr(from_brake, "fit_jointly", fit_from_brake)
    monkeypatch.setattr(
        "tasks.identification.joint.elimination.compute_interval_reach", lambda *_: np.array([0.1, 0.0025])
    )
    find_feigned = make_driver_check(campaign, VEHICLE, SURFACE, stops, JOINT)
    found = find_feigned(fit_with({"lag": 0.1, "pad_speed": 0.0044}))
    assert [number.name for number in found] == feigned, "a lag is no number of the brake's curve"
    assert all(now < stop.model.samples for now, stop in zip(asked[0], stops, strict=True))


def test_a_logged_throttle_tells_of_the_driver(monkeypatch):
    campaign = campaign_of({})
    stops = judge_car(campaign, numbers=FEW).train
    told = [replace(s, model=replace(s.model, run=replace(s.model.run, throttle=s.drive))) for s in stops]
    monkeypatch.setattr(from_brake, "fit_jointly", None)
    assert not make_driver_check(campaign, VEHICLE, SURFACE, told, JOINT)(
        fit_with({"lag": 0.1, "pad_speed": 0.01})
    )


def test_what_a_driver_feigns_goes_with_a_reason(monkeypatch):
    fitted, left = fit_with({"lag": 0.1, "pad_speed": 0.0044}), fit_of([np.zeros(100)])
    monkeypatch.setattr(
        from_brake, "eliminate_without", lambda _s, _f, gone, _r: left if gone == [PADS] else None
    )
    reasons: list[str] = []
    found = drop_feigned_numbers(
        (), fitted, lambda fit: [n for n in fit.numbers if n is PADS], JOINT, reasons
    )
    assert found is left
    assert reasons == [
        "the training runs suggest that the pads' friction falls by 0.44 % per m/s above 15 m/s, but from the brake on"
        " they do not tell that from nothing, and no channel says what drove the car before it: not named"
    ]
