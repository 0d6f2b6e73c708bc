"""A verdict in plain words: what is named and what that does, what stays open, and why nothing is named."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from catalogs.entries import load
from tasks.identification.decision import words
from tasks.identification.decision.answer import (
    ChannelError,
    NamedEffect,
    OpenOdds,
    Parameter,
    Verdict,
    find_kind,
)
from tasks.identification.decision.odds import Explanation, search_explanations
from tasks.identification.decision.open_explanations import OpenExplanation
from tasks.identification.decision.words import describe_open_explanations, describe_unnamed
from tasks.identification.inference.disturbance import Disturbance
from tasks.vehicle.effects.library import Effect
from tests.identification.explained import effect_of, grams_of

RULES = load("set of decision rules")
FORM = NamedEffect(
    name="pitch_form", effect_class="form", port="pitch_moment", variable="speed", parameters=(),
    score=45.6, gain=89.0,
)  # fmt: skip
ERROR = ChannelError(
    frozen=1.0, retuned=1.0, after=1.0, ci_low=0.0, ci_high=1.0, change_low=-1.0, change_high=0.0, wins=3,
    worst_run="run", unit="m/s",
)  # fmt: skip
"""Of the speed on held-out runs."""
LATE = Parameter(name="dead_time", value=0.021, ci_low=0.01, ci_high=0.03, lower=0.0, upper=0.5, unit="s")


def describe_verdict(
    effects: Sequence[NamedEffect],
    library: Sequence[Effect],
    error: dict[str, ChannelError],
    manoeuvres: dict[str, ChannelError],
    *,
    rivals: Sequence[NamedEffect] = (),
    opened: Sequence[OpenOdds] = (),
    misses: bool = False,
    **said: Any,
) -> str:
    """What the words make of a verdict; explanations of a set have odds of 1 unless they are given."""
    named = tuple(effect.name for effect in effects)
    pairs = tuple((named[0], rival) for rival in rivals)
    each = opened or [
        OpenOdds(names=tuple(words._find_name(e) for e in own), odds=1.0)
        for own in (effects, *([r] for r in rivals))
    ]
    verdict = Verdict(
        verdict=find_kind(effects, pairs), effects=tuple(effects), rivals=pairs, odds=tuple(each), tried=(),
        error=error, manoeuvre_error=manoeuvres, correlation={}, session_pulls={}, noise={},
        disturbance=Disturbance(), detectable={},
        campaign="", content_hash="", split_hash="", theta=np.zeros(0), slots=(), experiment=None, step_sensitive=(),
        reasons=(), misses=misses,
    )  # fmt: skip
    return words.describe_verdict(verdict, library, **said)


def weigh_lag(values: Sequence[float], matters: float = 1.0) -> list[Explanation]:
    """All explanations by a lag and a drag of what four runs say, whose error is a tenth."""
    candidates = [
        effect_of("brake_lag", 0, matters=matters), effect_of("aerodynamic_drag", 1),
    ]  # fmt: skip
    design = 5.0 * np.eye(2)
    grams = grams_of(candidates, [design] * 4, [design @ np.array(values)] * 4)
    return search_explanations(grams, most=2, width=4)


def test_a_verdict_of_nothing_says_whether_the_odds_or_the_size_fall_short() -> None:
    best, *_ = weigh_lag([1.0, 0.0], matters=3.0)
    assert best.names == ("brake_lag",)
    (told,) = describe_unnamed([], best, (), RULES)
    assert told == "the runs show brake_lag, smaller than what matters, or not surely larger: not named"
    weak = replace(best, log_odds=1.0)
    (told,) = describe_unnamed([replace(FORM, name="brake_lag", score=np.log(2.7))], weak, (), RULES)
    assert told == "the best candidate, brake_lag, has odds of 2.7 : 1 against nothing; a name needs 20 : 1"
    (told,) = describe_unnamed([], replace(best, members=()), (), RULES)
    assert told == "no effect of the library explains anything of what the model leaves over"


def test_what_is_open_is_told_with_its_odds_and_one_explanation_alone_is_not() -> None:
    best, *others = weigh_lag([2.0, 0.0])
    none = next(e for e in others if not e.members)
    opened = [
        OpenExplanation(explanation=best, named=best.members, log_odds=0.0),
        OpenExplanation(explanation=none, named=(), log_odds=float(np.log(0.25))),
    ]
    (told,) = describe_open_explanations(opened, [best, *others], RULES)
    assert (
        told
        == "of 4 explanations these runs leave 2 open within 20 : 1; against brake_lag: nothing (0.25 : 1)"
    )
    assert describe_open_explanations(opened[:1], [best, *others], RULES) == []


def test_what_has_too_small_odds_for_a_name_is_suggested_and_not_named() -> None:
    told = describe_verdict((), (), {}, {}, suggested=FORM)
    assert told.startswith("These runs prove nothing")
    assert "the pitch moment depends on speed" in told
    assert describe_verdict((), (), {}, {}) == "These runs show nothing that the model lacks."


def test_where_nothing_is_missing_the_verdict_says_what_the_vehicles_own_numbers_do() -> None:
    speed = replace(ERROR, frozen=0.394, retuned=0.081, after=0.08, change_low=-0.6, change_high=-0.1)
    stop = replace(speed, frozen=3.14, after=0.36, unit="m")
    own = "most: the brakes give 5.1 % above the torque of the vehicle file"
    told = describe_verdict((), (), {"speed": speed}, {"stopping_distance": stop}, own=own)
    assert told == (
        "These runs show nothing that the model lacks. Its own numbers, fitted to these runs (most: the brakes give"
        " 5.1 % above the torque of the vehicle file), take the error of the speed from 0.39 to 0.08 m/s and of the"
        " stopping distance from 3.1 to 0.36 m, on runs to which no number was fitted."
    )


def test_own_numbers_are_told_where_resamples_agree_or_the_error_is_halved() -> None:
    """Of three stops, of which one was right before, one resample in 27 holds that one alone."""
    unsure = replace(ERROR, frozen=1.22, retuned=0.62, after=0.62, change_low=-1.8, change_high=0.02)
    for speed, is_said in (
        (unsure, False), (replace(unsure, after=0.6), True), (replace(unsure, change_high=-0.01), True),
    ):  # fmt: skip
        told = describe_verdict((), (), {"speed": speed}, {}, own="the brakes give more")
        assert (". Its own numbers" in told) is is_said


def test_a_name_is_not_credited_with_what_the_vehicles_own_numbers_do() -> None:
    """Brakes 21 ms late were said to take a stop's error from 7.3 to 1.1 m, which a gain 10 % off did."""
    effect = next(e for e in load("library of effects") if e.name == "brake_dead_time")
    late = replace(FORM, name=effect.name, effect_class="effect", parameters=(LATE,))
    error = replace(ERROR, frozen=0.86, retuned=1.04, after=0.092)
    told = describe_verdict((late,), (effect,), {"speed": error}, {}, own="the brakes give 9.9 % below")
    assert told == (
        "The brakes answer 0.021 [0.01, 0.03] s late. With the vehicle's own numbers fitted too (the brakes give 9.9 %"
        " below), that lowers the error of the speed from 0.86 (re-tuned 1) to 0.092 m/s, on runs to which no number"
        " was fitted."
    )


def name(effect: str, *numbers: tuple[float, float, float]) -> NamedEffect:
    """An effect of the library with the values and intervals of its numbers."""
    known = next(e for e in load("library of effects") if e.name == effect)
    parameters = tuple(
        replace(LATE, name=p.name, value=value, ci_low=low, ci_high=high, unit=p.unit)
        for p, (value, low, high) in zip(known.parameters, numbers, strict=True)
    )
    return replace(
        FORM, name=effect, effect_class=known.effect_class, port=known.port, variable=known.variable,
        parameters=parameters,
    )  # fmt: skip


def test_a_set_says_first_what_its_explanations_share_and_then_each_with_its_odds() -> None:
    lag, pads = name("brake_lag", (0.079, 0.077, 0.081)), name("pad_drag", (46.0, 41.4, 50.6))
    rolling = name("rolling_resistance", (0.011, 0.01, 0.012))
    opened = [
        OpenOdds(names=("brake_lag", "pad_drag"), odds=1.0),
        OpenOdds(names=("brake_lag", "rolling_resistance"), odds=0.49),
    ]
    error = {"speed": replace(ERROR, after=0.1)}
    told = describe_verdict(
        (lag, pads), load("library of effects"), error, {}, rivals=[rolling], opened=opened, force=0.1
    )
    first, apart, *_ = told.split(". ")
    assert first == (
        "The brakes follow the pressure with a lag of 0.079 [0.077, 0.081] s and a further 0.1 [0.09, 0.11] m/s2 on"
        " average holds the car back, whatever its law"
    )
    assert apart == (
        "They cannot tell apart: pads that rub hold the wheels back with 46 [41, 51] N m (1 : 1); or the wheels roll"
        " with a further resistance of 1.1 % [1, 1.2] of the weight (0.49 : 1)"
    )
    late = describe_verdict(
        (lag,), load("library of effects"), error, {}, rivals=[name("brake_dead_time", (0.08, 0.07, 0.09))]
    )
    assert late.startswith(
        "The brakes answer late, whatever the law. They cannot tell apart: the brakes follow"
    )
    mass = name("retuned_mass", (-0.1, -0.12, -0.08))
    told = describe_verdict((lag,), load("library of effects"), error, {}, rivals=[mass])
    assert told.startswith(
        "These runs show something that the model lacks, and leave 2 explanations open. They"
    )
    assert "the car's mass is 10 % [8, 12] below that of the vehicle file (1 : 1)" in told


def test_a_first_sentence_has_at_most_thirty_words() -> None:
    three = [
        name("brake_lag", (0.079, 0.077, 0.081)), name("anti_dive", (0.2, 0.1, 0.3)),
        name("rolling_resistance", (0.011, 0.01, 0.012)),
    ]  # fmt: skip
    told = describe_verdict(three, load("library of effects"), {"speed": replace(ERROR, after=0.1)}, {})
    first, second, third = told.split(". ")
    assert len(first.split()) <= words.MOST_WORDS and "lag" in first
    assert "resistance" in second and third.startswith("That lowers")


def test_an_error_that_reads_the_same_before_and_after_is_not_told_as_taken_from_one_to_the_other() -> None:
    speed = replace(ERROR, frozen=2.145, retuned=2.082, after=2.082, change_low=-0.1, change_high=-0.01)
    stop = replace(speed, frozen=7.668, after=7.426, unit="m")
    own = "most: braking pitches the body by a moment 37 % below the vehicle file's"
    told = describe_verdict((), (), {"speed": speed}, {"stopping_distance": stop}, misses=True, own=own)
    assert (
        told
        == "The model misses these runs by more than their noise, and nothing that can be named explains it."
    )


def test_an_instruments_error_is_told_by_its_own_channel_and_not_by_the_speed() -> None:
    speed = replace(ERROR, frozen=0.065, retuned=0.44, after=0.094, change_low=0.0, change_high=1.0)
    error = {
        "speed": speed,
        "longitudinal_acceleration": replace(speed, frozen=0.46, after=0.073, unit="m/s^2"),
    }
    tilt = replace(FORM, name="sensor_mount_tilt", effect_class="sensor", variable="mount")
    told = describe_verdict((tilt,), (), error, {"stopping_distance": speed})
    assert "the error of the longitudinal acceleration from 0.46 (re-tuned 0.44) to 0.073 m/s^2" in told
    assert "speed from" not in told and "stopping" not in told
    assert "of the speed from" in describe_verdict((replace(tilt, variable="speed"),), (), error, {})


def test_a_name_that_the_speed_does_not_show_is_told_by_the_channel_that_does() -> None:
    """A late brake took the error of the acceleration from 0.79 to 0.29, and was told by a speed that got worse."""
    speed = replace(ERROR, frozen=0.22, retuned=0.22, after=0.25, change_low=0.0, change_high=1.0)
    felt = replace(speed, frozen=0.79, retuned=0.78, after=0.29, unit="m/s^2")
    error = {"speed": speed, "longitudinal_acceleration": felt}
    told = describe_verdict((FORM,), (), error, {})
    assert (
        "lowers the error of the longitudinal acceleration from 0.79 (re-tuned 0.78) to 0.29 m/s^2 and raises that of"
        in told
    )
    assert "of the speed from 0.22 (re-tuned 0.22) to 0.25 m/s" in told
    assert "acceleration" not in describe_verdict(
        (FORM,), (), {**error, "speed": replace(speed, after=0.1)}, {}
    )


def test_a_form_of_another_shape_is_not_told_as_the_same_words_again() -> None:
    speed = replace(ERROR, frozen=0.42, retuned=0.41, after=0.07, change_low=-1.0, change_high=0.0)
    drag = replace(FORM, name="drag_form", port="longitudinal_force")
    told = describe_verdict((FORM,), (), {"speed": speed}, {}, rivals=[replace(FORM, name="other_shape")])
    assert told.count("itch moment depends on speed") == 1
    assert "cannot tell apart" not in told
    both = describe_verdict(
        (FORM,), (), {"speed": speed}, {}, rivals=[replace(FORM, name="other_shape"), drag]
    )
    assert "or the longitudinal force depends on speed" in both and both.count("itch moment depends") == 1
