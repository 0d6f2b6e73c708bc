"""The physics judge on random clips of both modes: sound ones keep every law, errors are named with place and size."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario
from studies.physics_judge.__main__ import draw_braked_clip, judge
from studies.physics_judge.clips import TYRE, StudyClip, draw_clip, make_clip
from studies.physics_judge.errors import ERRORS
from studies.physics_judge.laws.audit import audit_clip
from studies.physics_judge.laws.constants import DT
from studies.physics_judge.laws.tyres import find_curve
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.tyres.magic_formula_tyre import MagicFormulaTyre, compute_magic_formula_friction

SHARP = (
    "torque 3 % high", "axles swapped", "friction of the neighbouring rate", "held speed drifts", "mass 1 % high",
    "camera 5 cm too high", "jump of 2 cm", "static pitch twice", "dampers 3 % soft", "brake share 2 % off",
)  # fmt: skip
STOP = Scenario(
    weather="rain", precipitation_mm_h=5.0, initial_speed_km_h=47.0, peak_pressure_mpa=6.0, ramp_s=0.3,
    brake_onset_s=0.6, hold_speed=True,
)  # fmt: skip


@pytest.fixture(scope="module")
def braked_clips() -> dict[str, StudyClip]:
    draw, found = np.random.Generator(np.random.Philox(5)), {}
    while len(found) < 2:
        clip = draw_braked_clip(draw)
        assert not judge(clip)
        found.setdefault(clip.rides[2], clip)
    return found


def test_sound_random_clips_of_both_modes_keep_every_law() -> None:
    draw = np.random.Generator(np.random.Philox(8))
    clips = [draw_clip(draw) for _ in range(12)]
    assert {clip.rides[2] for clip in clips} == {"paper", "coupled"}
    assert {clip.name: judge(clip) for clip in clips} == {clip.name: [] for clip in clips}


@pytest.mark.parametrize("mode", ["paper", "coupled"])
@pytest.mark.parametrize("name", SHARP)
def test_an_injected_error_breaks_a_law_that_names_its_place_and_size(
    braked_clips: dict[str, StudyClip], name: str, mode: str
) -> None:
    clip = braked_clips[mode]
    worst = judge(clip, ERRORS[name](clip))[0]
    assert worst.excess > 2
    assert worst.size > 0
    assert worst.of in worst.columns


@pytest.mark.parametrize("car", ["multibody-grown", "bmw-m8"])
def test_a_wheel_inertia_that_is_five_per_cent_off_breaks_the_wheels_torque_balance(car: str) -> None:
    clip = make_clip(STOP, load("vehicle", car), "coupled", duration_s=6.0)
    assert not judge(clip)
    broken = {law.name: law.size for law in judge(clip, ERRORS["wheel inertia 5 % high"](clip))}
    assert broken["wheel torque balance, f"] == pytest.approx(1 - 1 / 1.05, rel=0.1)


@pytest.mark.parametrize("effect", ["relaxation_length", "fade"])
def test_a_law_that_an_effect_takes_away_is_named_and_all_others_are_judged(effect: str) -> None:
    vehicle = load("vehicle", "multibody-staged")
    plain = make_clip(STOP, vehicle, "coupled", duration_s=3.0)
    clip = make_clip(STOP, replace(vehicle, effects={effect: 0.2}), "coupled", duration_s=3.0)
    verdict = audit_clip(clip.ticks, clip.frames, clip.facts, clip.constants)
    assert verdict.passed
    (law,) = verdict.not_judged
    assert verdict.not_judged[law] == f"effect {effect}"
    every = audit_clip(plain.ticks, plain.frames, plain.facts, plain.constants)
    assert {x.name for x in every.laws} - {x.name for x in verdict.laws} == {f"{law}, f", f"{law}, r"}


def test_the_judges_magic_formula_is_that_of_the_property_file() -> None:
    vehicle = replace(load("vehicle", "paper-reference"), tyre=load("tyre", TYRE))
    clip = make_clip(STOP, vehicle, "coupled", duration_s=1.0)
    curve = find_curve(clip.facts, clip.constants)
    tyre = compute_surface_response(vehicle, "rain", clip.facts["surface_friction"]).tyre
    assert isinstance(tyre, MagicFormulaTyre)
    assert curve.target_slip == pytest.approx(tyre.target_slip, abs=1e-12)
    for slip, wheel_load in ((0.01, 2000.0), (0.05, 8000.0), (0.9, 40000.0)):
        expected = compute_magic_formula_friction(slip, wheel_load, tyre)
        assert curve.friction(np.array(slip), np.array(wheel_load)) == pytest.approx(expected, abs=1e-12)


def test_a_break_is_found_at_the_tick_where_it_is(braked_clips: dict[str, StudyClip]) -> None:
    clip = braked_clips["coupled"]
    speed = clip.ticks["speed"].copy()
    speed[400:] += 0.002
    station = clip.ticks["station"] + 0.002 * DT * np.maximum(np.arange(len(speed)) - 400, 0)
    ticks = clip.ticks | {"speed": speed, "station": station}
    laws = {law.name: law for law in judge(clip, (ticks, clip.frames))}
    found = laws["speed is the integral of acceleration"]
    assert found.at == 399
    assert found.size == pytest.approx(0.002, rel=1e-3)
