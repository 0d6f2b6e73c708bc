"""Every vehicle that ships has the figures of a car, and each slip of a number is told."""

from dataclasses import replace

import pytest
import yaml
from pydantic import ValidationError

from catalogs.entries import entry_names, find_entry, load
from catalogs.plausible_vehicle import (
    PlausibleVehicle,
    find_plausibility_problems,
)
from catalogs.vehicles import open_vehicle, vehicle_units
from tasks.vehicle.figures import compute_figures

REFERENCE = replace(
    load("vehicle", "paper-reference"), effects={"rolling_coefficient": 0.012, "drag_area": 0.7}
)
"""The paper's car on a road that holds it back."""
SLIPS = {
    "a mass in tonnes": ({"sprung_mass": 1.2}, {"mass", "static_front_load"}),
    "unsprung masses of all four corners at each axle": (
        {"unsprung_mass_f": 250, "unsprung_mass_r": 250}, {"unsprung_share"},
    ),
    "a wheelbase in decimetres": ({"cg_to_front_axle": 12, "cg_to_rear_axle": 15}, {"wheelbase"}),
    "axles far off the centre": ({"cg_to_front_axle": 2.2, "cg_to_rear_axle": 0.5}, {"static_front_share"}),
    "a height in decimetres": ({"cg_height": 5.5}, {"cg_height_over_wheelbase"}),
    "a height above the axle": ({"cg_height": 0.23}, {"cg_height_over_wheelbase"}),
    "the inertia in yaw of a van": ({"pitch_inertia": 4000}, {"dynamic_index"}),
    "springs in N/mm": (
        {"suspension_stiffness_f": 27, "suspension_stiffness_r": 27}, {"heave_frequency", "pitch_frequency"},
    ),
    "wheels of a bicycle below springs ten times too stiff": (
        {"suspension_stiffness_f": 27e4, "unsprung_mass_f": 15}, {"wheel_hop_frequency_f"},
    ),
    "dampers of one metre per hour": (
        {"suspension_damping_f": 39, "suspension_damping_r": 39}, {"heave_damping_ratio", "pitch_damping_ratio"},
    ),
    "tyres of one side": ({"tyre_stiffness_r": 60_000}, {"wheel_hop_frequency_r"}),
    "a diameter": ({"wheel_radius": 0.64}, {"wheel_radius"}),
    "wheels in kg cm2": (
        {"wheel_inertia_f": 24_000, "wheel_inertia_r": 24_000}, {"wheel_inertia_f", "wheel_inertia_r"},
    ),
    "a gain for bar": ({"brake_gain": 100}, {"deceleration_per_pressure"}),
    "a share of the rear": ({"front_brake_share": 0.35}, {"front_brake_share"}),
    "a rear axle in g": ({"unsprung_mass_r": 54_000}, {"static_rear_load"}),
    "air drag at speed": ({"coast_deceleration": 3.0}, {"coast_deceleration"}),
    "no road load": ({"effects": {}}, {"road_load"}),
    "springs without travel": (
        {"suspension_stiffness_f": 5e5, "suspension_stiffness_r": 5e5}, {"dive_gradient"},
    ),
    "feet": ({"gravity": 32.2}, {"gravity", "peak_deceleration"}),
}  # fmt: skip
"""Fields of the reference vehicle, and figures of which one sentence each must tell."""


def named(problems):
    return {problem.split()[0] for problem in problems}


@pytest.mark.parametrize("name", entry_names("vehicle"))
def test_every_vehicle_that_ships_is_plausible_but_for_those_that_hardly_roll_out(name):
    problems = find_plausibility_problems(
        compute_figures(load("vehicle", name)), open_vehicle(name).tolerances
    )
    coasting = {"paper-reference", "bmw-m8"}
    assert named(problems) == ({"road_load"} if name in coasting else set())


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_a_number_is_told(slip):
    fields, figures = SLIPS[slip]
    assert figures <= named(find_plausibility_problems(compute_figures(replace(REFERENCE, **fields)), {}))


def test_a_sentence_has_rule_value_reason_and_what_to_look_at():
    (problem,) = find_plausibility_problems(compute_figures(replace(REFERENCE, front_brake_share=0.35)), {})
    limits = load("table of plausible figures").figures["front_brake_share"]
    assert problem == (
        f"front_brake_share must lie within 0.45 to 0.85 ({limits.source}); it is 0.35: check {limits.check}"
    )


@pytest.mark.parametrize("share", [1e-4, 5.0])
def test_a_tolerance_that_is_a_percentage_or_nothing_is_told(share):
    (problem,) = find_plausibility_problems(
        compute_figures(REFERENCE), {"cg_height": share, "sprung_mass": 0.02}
    )
    assert problem.startswith(
        "tolerance of cg_height over its value must lie within 0.0005 to 0.5 (own choice"
    )


def test_usual_tolerances_are_of_numbers_that_exist_and_plausible():
    ranges = load("table of plausible figures")
    shares = {name: number.value for name, number in ranges.usual_tolerances.items()}
    assert shares.keys() <= vehicle_units().keys()
    assert not find_plausibility_problems({}, shares)


def test_the_catalogue_has_every_figure_in_its_unit_and_says_why():
    content = yaml.safe_load(find_entry("table of plausible figures").read_text())
    assert all(len(row["source"]) > 15 for row in content["figures"].values())
    del content["figures"]["mass"]
    content["figures"]["charm"] = content["figures"]["wheelbase"]
    content["figures"]["gravity"]["unit"] = "ft s-2"
    with pytest.raises(ValidationError) as caught:
        PlausibleVehicle.model_validate(content)
    for words in ("mass is missing", "no figure charm", "unit of gravity must be m s-2; it is ft s-2"):
        assert words in str(caught.value)
    content["figures"]["wheelbase"]["low"] = 9
    with pytest.raises(ValidationError, match="low must be below high; they are 9 and 4"):
        PlausibleVehicle.model_validate(content)
