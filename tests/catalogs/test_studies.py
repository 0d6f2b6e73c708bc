"""The paper's conditions and its surface study, as the catalogue holds them."""

from catalogs.scenario import scenario_problems
from catalogs.studies import load_conditions, load_sensitivity_study


def test_there_are_nineteen_development_and_twelve_held_out_conditions():
    splits = [condition.split for condition in load_conditions()]
    assert (splits.count("development"), splits.count("held-out")) == (19, 12)
    assert len({condition.name for condition in load_conditions()}) == 31


def test_every_condition_is_a_sound_scenario():
    assert not [
        problem for condition in load_conditions() for problem in scenario_problems(condition.scenario)
    ]


def test_held_out_conditions_change_one_control_each():
    held_out = {c.name: c.scenario for c in load_conditions() if c.split == "held-out"}
    assert held_out["pressure-1.6mpa"].peak_pressure_mpa == 1.6
    assert held_out["ramp-0.2s"].ramp_s == 0.2
    assert held_out["onset-12m"].brake_onset_m == 12.0 and held_out["onset-12m"].brake_onset_s is None
    assert held_out["depression-80x3000"].hazard_height_m == -0.08
    rates = {c.precipitation_mm_h for c in held_out.values() if c.weather == "rain"}
    assert rates == {5, 15, 35}


def test_the_study_samples_the_published_parameters():
    protocol, printed = load_sensitivity_study()
    assert (
        protocol.weathers["rain"].parameters[0] == protocol.weathers["snow"].parameters[0] == "dry_friction"
    )
    assert (len(protocol.weathers["rain"].parameters), len(protocol.weathers["snow"].parameters)) == (6, 5)
    assert (protocol.samples, protocol.weathers["rain"].seed) == (128, 20260725)
    assert sum(figure.unit == "m" for figure in printed) == 7
