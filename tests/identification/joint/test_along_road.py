"""A second look by speed and accelerometer alone: when it is taken, and what its name must bear."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.verdict import Trace, find_missing_effects
from tasks.identification.inference.hypothesis import make_library_hypothesis
from tasks.identification.joint import along_road
from tasks.identification.joint.along_road import ALONG_ROAD, look_along_road
from tasks.vehicle.effects.table import build_parameter_vector
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, measured, plain_run

RULES, NUMBERS = load_decision_rules(), load_joint_numbers()
LAG = 0.05
STOPS = ((27.0, 1.2), (20.0, 2.0), (24.0, 1.6), (16.0, 1.8), (29.0, 1.9), (22.0, 1.3))
ROAD = tuple(e for e in load_effects() if e.name in ("brake_lag", "aerodynamic_drag"))
(DAMPER,) = (e for e in load_effects() if e.name == "damper_asymmetry")


@pytest.fixture(scope="module")
def recorded() -> tuple[Campaign, Trace]:
    """Stops of a car with a lag, all channels measured, and a verdict of them that names nothing."""
    runs = []
    for i, (speed, pressure) in enumerate(STOPS):
        run = replace(plain_run(speed, pressure, name=f"run-{i}"), held_out=i > 2)
        response = measured(run, build_parameter_vector({"lag": LAG}), i).run.response
        runs.append(replace(run, pressure=run.pressure[: len(response)], response=response))
    campaign = Campaign(
        name="stops", vehicle="paper-reference", runs=tuple(runs), tolerances=TOLERANCES, content_hash="",
        split_hash="",
    )  # fmt: skip
    found = find_missing_effects(campaign, VEHICLE, SURFACE, ROAD, RULES)
    nothing = replace(found.verdict, verdict="NOTHING", effects=())
    return campaign, replace(found, verdict=nothing, end=found.start, compared=())


def look(recorded: tuple[Campaign, Trace], monkeypatch, inflation: float = 3.0) -> Trace:
    campaign, first = recorded
    monkeypatch.setattr(along_road, "compute_inflation", lambda *_: inflation)
    return look_along_road(first, campaign, VEHICLE, SURFACE, ROAD, NUMBERS, RULES)


def answer(monkeypatch, trace: Trace | None) -> list[Campaign]:
    """Answers in place of the second search, and the campaigns that it was asked about."""
    asked = []

    def search(campaign, *_):
        asked.append(campaign)
        if trace is None:
            raise ForeignCarError("the runs disagree")
        return trace

    monkeypatch.setattr(along_road, "find_single_effects", search)
    return asked


def test_a_name_of_the_motion_along_the_road_is_found_and_its_error_is_of_all_channels(recorded, monkeypatch):
    second = look(recorded, monkeypatch)
    (found,) = second.verdict.effects
    assert found.name == "brake_lag"
    assert found.parameters[0].ci_low < LAG < found.parameters[0].ci_high
    assert set(second.verdict.error) == set(CHANNELS) and "peak_pitch" in second.verdict.manoeuvre_error
    assert (
        second.verdict.error["wheel_speed_front"].after
        < 0.5 * second.verdict.error["wheel_speed_front"].frozen
    )
    assert "by speed and longitudinal acceleration alone" in second.verdict.reasons[0]
    assert "factor of 3.0" in second.verdict.reasons[0]
    seen = [np.isfinite(run.sigma) for run in second.start.evidence.train]
    assert all(tuple(np.array(CHANNELS)[channels]) == ALONG_ROAD for channels in seen)


def test_runs_that_agree_are_not_looked_at_again(recorded, monkeypatch):
    asked = answer(monkeypatch, None)
    assert look(recorded, monkeypatch, inflation=RULES.disagreement) is recorded[1]
    assert not asked
    assert look(recorded, monkeypatch, inflation=RULES.disagreement + 0.1) is recorded[1]
    assert [campaign.channels for campaign in asked] == [ALONG_ROAD]


def test_a_verdict_that_names_something_stays(recorded, monkeypatch):
    asked = answer(monkeypatch, None)
    named = replace(recorded[1], verdict=replace(recorded[1].verdict, effects=("a name",)))
    assert look((recorded[0], named), monkeypatch) is named
    assert not asked


def test_without_wheels_and_body_there_is_no_second_look(recorded, monkeypatch):
    asked = answer(monkeypatch, None)
    bare = replace(recorded[0], channels=ALONG_ROAD)
    assert look((bare, recorded[1]), monkeypatch) is recorded[1]
    assert not asked


def test_a_second_look_that_names_nothing_or_the_body_leaves_the_first(recorded, monkeypatch):
    first = recorded[1]
    answer(monkeypatch, first)
    assert look(recorded, monkeypatch) is first
    base = first.end.base
    of_body = replace(base, parts=(make_library_hypothesis(DAMPER),), values=np.array([0.3]))
    answer(monkeypatch, replace(first, end=replace(first.end, base=of_body)))
    assert look(recorded, monkeypatch) is first


def test_a_name_that_predicts_other_channels_worse_is_not_named(recorded, monkeypatch):
    second = look(recorded, monkeypatch)
    late = replace(second.end, base=replace(second.end.base, values=np.array([10.0 * LAG])))
    answer(monkeypatch, replace(second, end=late))
    kept = look(recorded, monkeypatch)
    assert not kept.verdict.effects
    assert "brake_lag would be named" in kept.verdict.reasons[0]
    assert "worse than the frozen model: not named" in kept.verdict.reasons[0]
