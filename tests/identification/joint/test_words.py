"""Reasons of a joint verdict are sentences, in the plain words of the catalogue."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.answer import NamedEffect, Parameter
from tasks.identification.inference.forward import prepare_run
from tasks.identification.joint.stops import make_stop
from tasks.identification.joint.words import (
    tell_guessed_lift,
    tell_lumped_resistance,
    tell_rivals,
    tell_what_was_used,
)
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, plain_run


def named_effect(effect: str, number: str, value: float) -> NamedEffect:
    p = Parameter(name=number, value=value, ci_low=0.0, ci_high=1.0, lower=0.0, upper=1.0, unit="s")
    return NamedEffect(
        name=effect, effect_class="effect", port="", variable="", parameters=(p,), score=0.0, gain=0.0,
    )  # fmt: skip


def test_a_rival_is_told_in_plain_words_with_the_run_that_separates_the_two():
    lag, dead = named_effect("brake_lag", "lag", 0.056), named_effect("brake_dead_time", "dead_time", 0.05)
    (sentence,) = tell_rivals([lag], [("brake_lag", dead)], load_joint_numbers())
    assert sentence == (
        "these runs cannot tell whether the brakes follow the pressure with a lag of 0.056 s or the brakes answer"
        " 0.05 s late: press the brake in steps from constant speed, logging at 100 Hz or more"
    )


def test_a_rival_that_no_known_run_separates_is_told_without_one():
    """A gain and a mass look alike in every stop: "cannot tell whether A or B: None", it said."""
    gain = named_effect("retuned_pressure_gain", "pressure_gain", 0.1)
    (sentence,) = tell_rivals(
        [gain], [(gain.name, named_effect("retuned_mass", "mass", -0.1))], load_joint_numbers()
    )
    assert sentence.endswith("the car's mass is 10 % below that of the vehicle file")
    wet = named_effect("retuned_wet_friction", "wet_friction", -0.2)
    (sentence,) = tell_rivals(
        [wet], [(wet.name, named_effect("wet_friction_speed", "wet_speed", 0.01))], load_joint_numbers()
    )
    assert sentence.endswith(
        "brake to the limit of the tyres on one wet road, from a high and from a low speed"
    )


def test_a_resistance_is_told_from_anything_else_by_coasting():
    curve, engine = (
        named_effect("pressure_nonlinearity", "pressure_curve", 0.04),
        named_effect("engine_braking", "engine_torque", 80.0),
    )
    for named, rival in ((curve, engine), (engine, curve)):
        (sentence,) = tell_rivals([named], [(named.name, rival)], load_joint_numbers())
        assert sentence.endswith(
            "coast down from the highest speed to 5 m/s with the clutch open, and once in gear"
        )


def test_an_effect_is_said_with_its_first_number_alone_and_the_other_at_its_start() -> None:
    pads = next(effect for effect in load_effects() if effect.name == "pad_friction_speed")
    assert pads.say({"pad_speed": 0.02}) == "the pads' friction falls by 2 % per m/s above 15 m/s"
    assert "above 20 m/s" in pads.say({"pad_speed": 0.02, "pad_speed_reference": 20.0})


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("brake_fade", 0.06, "the brakes' torque falls by 6 % per 100 K of disc temperature"),
        ("brake_fade", -0.035, "the brakes' torque grows by 3.5 % per 100 K of disc temperature"),
        ("load_sensitivity", -0.2, "friction grows by 20 % where the wheel load doubles"),
        ("sensor_gravity_leak", 0.996, "the accelerometer feels 100 % of the gravity that pitch turns into its axis"),
        ("retuned_pressure_gain", 1.25, "the brakes give 125 % above the torque of the vehicle file"),
        ("pad_drag", 99.7, "pads that rub hold the wheels back with 100 N m"),
    ],
)  # fmt: skip
def test_a_number_is_said_with_its_direction_and_without_an_exponent(
    name: str, value: float, said: str
) -> None:
    effect = next(effect for effect in load_effects() if effect.name == name)
    assert effect.say({effect.parameters[0].name: value}) == said


def test_a_number_is_said_as_the_effect_that_it_is_alone() -> None:
    said = {number.name: number.say(0.05) for number in load_joint_numbers()}
    assert said["rolling_coefficient"] == "the wheels roll with a further resistance of 5 % of the weight"
    assert said["drag_area"] == "the air holds the car back with a further drag area of 0.05 m2"


def test_a_resistance_without_a_coast_down_is_told_to_be_the_sum_of_all():
    rules = load_decision_rules().joint
    numbers = {n.name: n for n in load_joint_numbers()}
    braking, coasting = plain_run(20.0, 2.0), plain_run(20.0, 0.0)
    slowed = replace(coasting, response=coasting.response - np.linspace(0.0, 9.0, 300)[:, None])
    models = [prepare_run(run, VEHICLE, SURFACE) for run in (braking, slowed)]
    (told,) = tell_lumped_resistance([numbers["lag"], numbers["drag_area"]], models[:1], rules)
    assert told.startswith("drag_area stands for air, tyres and engine together") and "coast down" in told
    assert tell_lumped_resistance([numbers["lag"]], models[:1], rules) == []
    assert tell_lumped_resistance([numbers["drag_area"]], models, rules) == []


@pytest.mark.parametrize("deceleration, told", [(5.0, True), (12.0, False)])
def test_a_full_stop_that_the_road_slows_less_than_the_model_is_told_for_what_it_is(
    deceleration: float, told: bool
) -> None:
    rules = load_decision_rules().joint
    run = plain_run(30.0, 15.0, seconds=4.0)
    slowed = run.response.copy()
    slowed[100:, 0] -= deceleration * 0.01 * np.arange(300) * (slowed[100:, 0] > 0.0)
    campaign = Campaign(
        name="stops", vehicle="paper-reference", runs=(replace(run, response=np.maximum(slowed, 0.0)),),
        tolerances=TOLERANCES, content_hash="", split_hash="", channels=("speed", "longitudinal_acceleration"),
    )  # fmt: skip
    stops = [make_stop(run, VEHICLE, SURFACE, campaign.channels, rules) for run in campaign.train]
    text = "; ".join(tell_what_was_used(campaign, stops, (1, 1), rules))
    assert ("no run slowed down harder than the model's tyres allow" in text) is told


@pytest.mark.parametrize(
    ("signal", "said"),
    [
        ("pedal_force", "a pedal force of 1 N is taken for 0.02 MPa"),
        ("brake_torque", "a brake torque of 1 N m is taken for 0.001 MPa"),
        ("brake_command", "a brake command of 1 is taken for 10 MPa"),
    ],
)
def test_what_stands_for_the_pressure_is_told_with_its_unit(signal: str, said: str) -> None:
    rules, run = load_decision_rules().joint, plain_run(20.0, 2.0)
    campaign = Campaign(
        name="known", vehicle="paper-reference", runs=(run,), channels=("speed",), content_hash="", split_hash="",
        tolerances=TOLERANCES, brake_signal=signal,
    )  # fmt: skip
    stop = make_stop(run, VEHICLE, SURFACE, campaign.channels, rules)
    assert tell_what_was_used(campaign, [stop], (1, 1), rules)[0] == f"{said}, and the gain is fitted"


def test_a_signal_that_a_map_turns_into_a_pressure_is_told_by_its_unit_alone() -> None:
    rules, run = load_decision_rules().joint, plain_run(20.0, 2.0)
    campaign = Campaign(
        name="known", vehicle="paper-reference", runs=(run,), channels=("speed",), content_hash="", split_hash="",
        tolerances=TOLERANCES, brake_signal="a signal in N m",
    )  # fmt: skip
    stop = make_stop(run, VEHICLE, SURFACE, campaign.channels, rules)
    told = tell_what_was_used(campaign, [stop], (1, 1), rules)
    assert told[0] == "inputs that were measured: a signal in N m; compared: speed"


def test_a_delay_says_that_nobody_knows_when_the_driver_lifts_where_that_is_so():
    numbers = {n.name: n for n in load_joint_numbers()}
    (told,) = tell_guessed_lift([numbers["drag_area"], numbers["dead_time"]], 0.031)
    assert "when the driver lifts" in told and "a standard deviation of 0.031 s: log the throttle" in told
    assert tell_guessed_lift([numbers["dead_time"]], 0.004) == []
    assert tell_guessed_lift([numbers["drag_area"]], 0.031) == []
