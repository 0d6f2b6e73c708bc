"""Wet friction by film and speed: published values that it was fitted to and others, its limits, the judge's form."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario
from studies.physics_judge.__main__ import judge
from studies.physics_judge.clips import make_clip
from studies.physics_judge.laws.constants import compute_wet_friction, derive_surface
from tasks.studies.label_ranges import sampled_friction
from tasks.surface.weather import Weather, find_wet_grip, surface_state
from tasks.surface.wet_friction import ANY_SPEED, compute_wet_share

PAPER = load("surface", "dense-asphalt")
ASPHALT = load("wet friction").apply(PAPER)
TEXTURE_MM = ASPHALT.texture_depth_mm
STORM = Weather(kind="rain", precipitation_mm_h=50.0)
BOSCH = {0.2: (0.65, 0.60, 0.55), 1.0: (0.55, 0.30, 0.20), 2.0: (0.50, 0.05, 0.00)}
"""Film [mm] to friction of new tyres at 50, 90 and 130 km/h."""


def friction_at(speed_km_h: float, above_mm: float, pavement=ASPHALT) -> float:
    grip = find_wet_grip(TEXTURE_MM + above_mm, pavement)
    return pavement.wet_friction * compute_wet_share(speed_km_h / 3.6, grip)


def test_the_law_is_the_least_squares_fit_to_the_handbook():
    for film, values in BOSCH.items():
        found = [friction_at(speed, film) for speed in (50, 90, 130)]
        assert found == pytest.approx(list(values), abs=0.031)


def test_it_meets_the_wet_runway_of_14_cfr_25_109_that_the_fit_did_not_use():
    aircraft = replace(ASPHALT, wet_tyre_pressure_kpa=50 * 6.895)
    for speed in (30, 50, 90, 130):
        knots = speed / 1.852 / 100
        rule = np.polyval([-0.0350, 0.306, -0.851, 0.883], knots)
        assert friction_at(speed, 0.5, aircraft) == pytest.approx(rule, abs=0.08)


def test_a_deep_film_carries_the_tyre_from_horne_s_speed_on_and_water_in_the_texture_nothing():
    onset = 6.36 * 220**0.5
    assert friction_at(onset - 10, 5.0) > 1.5 * ASPHALT.wet_planing_friction
    assert friction_at(onset, 5.0) == friction_at(200, 5.0) == pytest.approx(ASPHALT.wet_planing_friction)
    assert friction_at(100, -0.3) == friction_at(100, 0.0) > 0.55


def test_mu_c_is_friction_at_the_reference_speed_and_the_paper_s_law_knows_none():
    state, paper = surface_state(STORM, ASPHALT), surface_state(STORM, PAPER)
    assert state.friction == pytest.approx(friction_at(60, state.film_depth_mm - TEXTURE_MM), abs=1e-15)
    assert compute_wet_share(60 / 3.6, state.grip) == state.grip.reference
    assert (paper.grip, paper.friction) == (ANY_SPEED, pytest.approx(0.347126, abs=1e-6))
    assert surface_state(Weather(kind="dry"), ASPHALT) == surface_state(Weather(kind="dry"), PAPER)


def test_the_judge_s_own_form_is_the_law():
    numbers = {name: value for name, value in vars(ASPHALT).items() if isinstance(value, float)}
    found = derive_surface("rain", 50.0, 0.0, numbers)["surface_friction"]
    assert found == pytest.approx(surface_state(STORM, ASPHALT).friction, abs=1e-14)
    for above in (0.0, 0.4, 3.0):
        speeds = np.array([0.0, 10.0, 22.0, 26.0, 27.0, 40.0])
        own = compute_wet_friction(speeds, TEXTURE_MM + above, numbers)
        assert own == pytest.approx([friction_at(3.6 * v, above) for v in speeds], abs=1e-14)


def test_its_bands_reach_the_labels():
    study = load("sensitivity study")[0]
    low, high = np.percentile(sampled_friction(STORM, ASPHALT, study), (5, 95))
    assert low < surface_state(STORM, ASPHALT).friction - 0.03
    assert high > surface_state(STORM, ASPHALT).friction + 0.03


def test_a_stop_in_a_storm_keeps_every_law_and_one_of_the_other_law_breaks_the_tyre_s():
    stop = Scenario(
        weather="rain", precipitation_mm_h=50.0, initial_speed_km_h=110.0, peak_pressure_mpa=8.0, ramp_s=0.3,
        brake_onset_s=0.3,
    )  # fmt: skip
    clip = make_clip(stop, load("vehicle", "bmw-m8"), "coupled", duration_s=5.0)
    assert not judge(clip)
    other = replace(clip, constants=replace(clip.constants, surface={
        **clip.constants.surface, "wet_decay_speed": 1.02 * ASPHALT.wet_decay_speed,
    }))  # fmt: skip
    assert {law.name for law in judge(other)} >= {"tyre force of slip and load, f"}
