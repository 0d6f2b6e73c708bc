"""The table of weathers: one row a kind, the judge's own table beside it, and no kind beyond them anywhere."""

from dataclasses import fields, replace
from math import inf

import pytest

from catalogs.entries import load
from catalogs.physical_limits import PhysicalLimits
from catalogs.scenario import Scenario, find_scenario_problems
from flows.making.driving import weather_of
from studies.physics_judge.laws.constants import SURFACE_FORMS, derive_surface
from tasks.campaign.planned_runs import RunPlan, make_planned_run
from tasks.errors import InputError
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.weather import DRY, WEATHERS, Weather, find_weather, list_by_code, surface_state

ASPHALT = load("surface", "dense-asphalt")


def sound(kind: str) -> Scenario:
    """A scenario of the kind with what its row asks for."""
    row = WEATHERS[kind]
    return Scenario(
        weather=kind,
        precipitation_mm_h=1.5 if row.rate_limit else 0.0,
        snow_accumulation_h=0.7 if row.accumulates else 0.0,
        visual_range_m=80.0 if row.obscures else None,
    )


@pytest.mark.parametrize("kind", WEATHERS)
def test_a_row_says_what_its_scenarios_give(kind):
    row, limits = WEATHERS[kind], load("table of physical limits")
    assert row.name == kind and find_scenario_problems(sound(kind)) == []
    wrong = Scenario(
        weather=kind,
        precipitation_mm_h=0.0 if row.rate_limit else 1.5,
        snow_accumulation_h=0.0 if row.accumulates else 0.7,
        visual_range_m=80.0 if row.obscures else None,
    )
    assert len(find_scenario_problems(wrong)) == 2
    assert row.rate_limit is None or row.rate_limit in PhysicalLimits.model_fields
    if row.rate_limit:
        beyond = getattr(limits, row.rate_limit).value + 1
        (found,) = find_scenario_problems(Scenario(**sound(kind).as_row() | {"precipitation_mm_h": beyond}))
        assert found.startswith("precipitation_mm_h must be at most")


def test_the_judge_has_a_closed_form_for_each_row():
    assert set(SURFACE_FORMS) == set(WEATHERS)


@pytest.mark.parametrize("kind", WEATHERS)
def test_the_judge_finds_the_same_surface_and_the_derivation_names_what_moved(kind):
    scenario = sound(kind)
    weather = weather_of(scenario)
    state = surface_state(weather, ASPHALT)
    numbers = {name: value for name, value in vars(ASPHALT).items() if isinstance(value, float)}
    found = derive_surface(kind, scenario.precipitation_mm_h, scenario.snow_accumulation_h, numbers)
    assert found == pytest.approx(
        {name: getattr(state, name) for name in ("film_depth_mm", "snow_depth_mm", "snow_coverage")}
        | {"surface_friction": state.friction}
    )
    derived = [one.field for one in WEATHERS[kind].derive(weather, state, ASPHALT)]
    names = {field.name for field in fields(SurfaceState)} - {
        "kind",
        "precipitation_mm_h",
        "grip",
        "visual_range_m",
    }
    assert derived[-1] == "friction"
    assert set(derived[:-1]) == {name for name in names - {"friction"} if getattr(state, name) > 0}


@pytest.mark.parametrize(
    "use",
    [
        lambda: Weather(kind="hail"),
        lambda: find_weather("hail"),
        lambda: surface_state(Weather(kind="hail"), ASPHALT),
        lambda: make_planned_run(RunPlan(weather="hail", speed=10.0, peak=2.0), "a"),
        lambda: find_scenario_problems(Scenario(weather="hail")),
    ],
)
def test_an_unknown_kind_is_refused_and_the_known_are_listed(use):
    known = ", ".join(list(WEATHERS)[:-1]) + f" or {list(WEATHERS)[-1]}"
    with pytest.raises(InputError, match=f"weather must be {known}; it is 'hail'"):
        use()


def test_a_kinds_code_stays_what_files_and_fmus_hold():
    held = {"dry": 1, "rain": 2, "snow": 3, "ice": 4, "fog": 5}
    codes = {name: row.code for name, row in WEATHERS.items()}
    assert codes | held == codes and len(set(codes.values())) == len(codes)


def test_a_kind_may_grip_as_another_does_and_leave_codes_free(monkeypatch):
    """Without a tyre family of its own; an FMU refuses the codes that no kind has."""
    names = list(WEATHERS)
    gravel = replace(WEATHERS["dry"], name="gravel", code=len(names) + 2, grips_as="dry")
    monkeypatch.setitem(WEATHERS, "gravel", gravel)
    vehicle = load("vehicle", "paper-reference")
    assert vehicle.find_tyre_family("gravel") is vehicle.find_tyre_family("dry")
    assert vehicle.find_weathers() == [*names, "gravel"]
    assert list_by_code() == (*names, "", "gravel")


def test_dry_is_the_kind_that_changes_no_picture():
    assert [name for name, row in WEATHERS.items() if not row.overcast] == [DRY]


def test_no_number_of_the_pavement_is_left_out():
    """Kinds of weather and the law of wet friction bring the fields that a pavement's file does not have."""
    whole = load("wet friction").apply(ASPHALT)
    assert all(value == value for name, value in vars(whole).items() if name != "bounds")
    assert set(ASPHALT.bounds) <= {field.name for field in fields(SurfaceParameters)}


@pytest.mark.parametrize("kind", ["rain", "snow"])
def test_precipitation_that_has_ended_leaves_the_road_and_its_grip_as_they_were(kind):
    falling = weather_of(sound(kind))
    during, after = (surface_state(replace(falling, falling=now), ASPHALT) for now in (True, False))
    assert during.precipitation_mm_h > after.precipitation_mm_h == 0
    assert replace(during, precipitation_mm_h=0.0) == after


def test_what_never_fell_cannot_have_ended_and_skies_must_fit_what_falls():
    def problems(kind, **given):
        return find_scenario_problems(replace(sound(kind), **given))

    assert len(problems("dry", falling=False)) == len(problems("ice", falling=False)) == 1
    assert len(problems("rain", sky="clear")) == 1
    assert problems("rain", sky="overcast") == problems("rain", sky="clear", falling=False) == []
    assert (
        len(problems("dry", sun_azimuth_deg=90.0))
        == len(problems("dry", sky="overcast", sun_azimuth_deg=9.0))
        == 1
    )
    assert len(problems("fog", sky="clear")) == 1
    assert problems("fog", sky="overcast") == []
    assert problems("dry", sky="haze", sun_azimuth_deg=90.0, sun_elevation_deg=5.0) == []
    assert len(problems("dry", sky="haze", sun_azimuth_deg=361.0, sun_elevation_deg=0.5)) == 2


@pytest.mark.parametrize(
    ("weather", "visual_range_m", "rule"),
    [
        ("fog", None, "weather fog needs visual_range_m"),
        ("dry", 80.0, "visual_range_m belongs to fog; the weather is dry and it is 80"),
        ("fog", 1001.0, "visual_range_m must be at most 1000 m"),
        ("fog", 0.0, "visual_range_m must be at least 10 m"),
    ],
)
def test_fog_and_its_visual_range_go_together_within_limits(weather, visual_range_m, rule):
    (problem,) = find_scenario_problems(Scenario(weather=weather, visual_range_m=visual_range_m))
    assert problem.startswith(rule)


def test_a_foggy_road_grips_as_the_dry_one_and_only_its_air_differs():
    foggy = surface_state(Weather(kind="fog", visual_range_m=80.0), ASPHALT)
    assert replace(foggy, kind="dry", visual_range_m=inf) == surface_state(Weather(kind="dry"), ASPHALT)
    assert foggy.visual_range_m == 80.0
