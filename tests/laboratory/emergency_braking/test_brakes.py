"""Emergency brakes: the closed form of the impact, what they know of the road, tracks of targets, the protocols."""

from math import inf, pi, sqrt

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.road_users import EGO, RoadUser
from catalogs.scenario import Scenario
from catalogs.weather.look import load_weather
from flows.making.driving import find_visual_range, surface_of
from studies.emergency_braking.brakes import Approach, BlindTrigger, find_threat
from studies.emergency_braking.cases import Case, list_cases
from studies.emergency_braking.compare import compare_brakes, drive_approach, find_tyre_friction, make_brake
from studies.emergency_braking.table import load_table
from tasks.driving.targets import Target, TargetTrack
from tasks.errors import InputError

TABLE = load_table()
CAR = load("vehicle", "bmw-320i")
ASPHALT = load("wet friction").apply(load("surface", "dense-asphalt"))
OVERHANG = load("road user sizes")[EGO][0]


def road(weather: str):
    return surface_of(Scenario(**TABLE.list_weathers()[weather]), ASPHALT)


def brake(kind: str, state):
    return make_brake(kind, CAR, find_tyre_friction(CAR, state), TABLE)


def compute_impact_speed(closing: float, gap: float, deceleration: float, delay: float, rise: float) -> float:
    """Return the closing speed at the impact, of a deceleration that rises on a straight line and then stays [m/s]."""
    left = gap - closing * (delay + rise) + deceleration * rise * rise / 6.0
    after = closing - 0.5 * deceleration * rise
    return sqrt(max(after * after - 2.0 * deceleration * left, 0.0))


def approach_at(speed_km_h: float, target_km_h: float) -> Case:
    gap = OVERHANG + 4.0 * (speed_km_h - target_km_h) / 3.6
    return make_case(speed_km_h, gap_m=gap, speed_km_h=target_km_h)


def make_case(approach_km_h: float, **track: float) -> Case:
    target = RoadUser.model_validate({"kind": "car", "track": track})
    scenario = Scenario(initial_speed_km_h=approach_km_h, hold_speed=True, objects=(target,))
    return Case(protocol="test", name="test", scenario=scenario)


@pytest.mark.parametrize(("speed", "target"), [(50, 0), (60, 0), (70, 0), (70, 20), (80, 20)])
def test_the_impact_in_the_dry_is_the_closed_form(speed, target):
    dry, case = road("dry"), approach_at(speed, target)
    trigger, line = brake("blind", dry)
    outcome = drive_approach(CAR, dry, case, trigger, line, TABLE)
    assert outcome.collided and outcome.clearance == outcome.min_ttc == 0.0
    # the demand falls on a look, and the first pressure that is seen is that of the middle of a step
    look = 1 / TABLE.rate_hz.value
    demanded = round((outcome.brake_time - line.delay) / look) * look
    friction = find_tyre_friction(CAR, dry)(0.0)
    mean_speed = 0.5 * (case.speed + outcome.impact_speed + target / 3.6)
    air = 0.5 * 1.2 * CAR.effects["drag_area"] * mean_speed**2 / CAR.mass
    whole = CAR.mass + (CAR.wheel_inertia_f + CAR.wheel_inertia_r) / CAR.wheel_radius**2
    jerk = CAR.brake_gain * line.full_mpa / line.build_up / (CAR.wheel_radius * whole)
    expected = compute_impact_speed(
        (speed - target) / 3.6, case.follow().find(demanded).station - case.speed * demanded - OVERHANG,
        friction * CAR.gravity + air, line.delay, friction * CAR.gravity / jerk,
    )  # fmt: skip
    assert 3.6 * outcome.impact_speed == pytest.approx(3.6 * expected, abs=0.3)
    assert 3.6 * outcome.avoided_speed == pytest.approx(speed - target - 3.6 * outcome.impact_speed, abs=0.01)


@pytest.mark.parametrize("weather", ["dry", "rain-50", "snow-3"])
def test_the_brake_that_knows_friction_stops_a_margin_before_the_target_and_brakes_no_earlier_than_it_must(
    weather,
):
    state, case = road(weather), approach_at(50, 0)
    outcome = drive_approach(CAR, state, case, *brake("friction", state), TABLE)
    assert not outcome.collided and 0.3 < outcome.clearance < 4.0
    blind = drive_approach(CAR, state, case, *brake("blind", state), TABLE)
    assert blind.collided and blind.brake_time > outcome.brake_time


def test_no_brake_sees_through_fog_and_one_that_needs_more_road_than_that_brakes_at_its_visual_range():
    state, case = surface_of(Scenario(weather="fog", visual_range_m=12.0), ASPHALT), approach_at(60, 0)
    far, near = (
        drive_approach(CAR, state, case, *brake("friction", state), TABLE, visual_range_m)
        for visual_range_m in (inf, find_visual_range(state, load_weather()))
    )
    line = TABLE.brake_line
    seen = near.brake_time - line.delay_s.value
    gap = case.follow().find(0.0).station - OVERHANG - case.speed * seen
    assert gap == pytest.approx(12.0, abs=case.speed / TABLE.rate_hz.value)
    assert near.collided and not far.collided and far.brake_time < near.brake_time


@pytest.mark.parametrize("slows", [2.0, 6.0])
@pytest.mark.parametrize("gap", [12.0, 40.0])
def test_the_brake_that_knows_friction_stops_behind_one_that_brakes(gap, slows):
    dry = road("dry")
    case = make_case(50, gap_m=OVERHANG + gap, speed_km_h=50, change_at_s=1, acceleration_m_s2=-slows)
    outcome = drive_approach(CAR, dry, case, *brake("friction", dry), TABLE)
    assert not outcome.collided and outcome.clearance < 4.0 and outcome.brake_time > 1.0


def test_nothing_ahead_or_going_away_is_no_threat_and_who_walks_into_the_path_is():
    def threat_of(*targets: Target):
        return find_threat(Approach(time=0.0, bumper=10.0, speed=10.0, width=1.8, targets=targets))

    assert threat_of() is None and threat_of(Target(station=30.0, lateral=3.0)) is None
    assert threat_of(Target(station=30.0, lateral=-3.0, lateral_speed=1.5, width=0.5)).gap == 20.0
    assert threat_of(Target(station=30.0, lateral=-9.0, lateral_speed=1.5, width=0.5)) is None
    faster = threat_of(Target(station=30.0, speed=12.0))
    assert faster.time_to_collision == inf
    assert not BlindTrigger(time_to_collision=9.0).demands(
        Approach(time=0.0, bumper=10.0, speed=10.0, width=1.8, targets=(faster.target,))
    )


def test_a_track_brakes_to_its_final_speed_and_crosses_where_it_heads():
    lead = TargetTrack(station=5.0, speed=10.0, change_at=1.0, acceleration=-4.0)
    assert [lead.find(t).speed for t in (0.5, 2.0, 3.5, 9.0)] == [10.0, 6.0, 0.0, 0.0]
    assert lead.find(9.0).station == pytest.approx(5 + 10 + 100 / 8) and lead.settles_at == 3.5
    assert (lead.find(2.0).acceleration, lead.find(9.0).acceleration) == (-4.0, 0.0)
    walker = TargetTrack(station=20.0, speed=1.5, heading=pi / 2, lateral=-3.0).find(2.0)
    assert (walker.station, walker.lateral, walker.lateral_speed) == pytest.approx((20.0, 0.0, 1.5))
    with pytest.raises(InputError, match="speed must not be negative; it is -1"):
        TargetTrack(station=5.0, speed=-1.0)


@pytest.mark.parametrize("name", TABLE.protocols)
def test_every_protocol_has_a_source_and_an_unbraked_car_meets_its_target(name):
    entry = TABLE.protocols[name]
    assert entry.source.startswith(("UN R152", "Euro NCAP"))
    for case in list_cases(name, entry):
        time = np.arange(0.0, 40.0, 0.05)
        track = case.follow()
        there = [track.find(float(t)) for t in time]
        meets = [t for t, one in zip(time, there, strict=True) if one.station <= OVERHANG + case.speed * t]
        assert meets and abs(track.find(float(meets[0])).lateral) < 0.5


def test_the_command_compares_brakes_writes_a_page_and_refuses_names_that_are_none(tmp_path):
    asked = {"protocol": ["r152-pedestrian"], "weather": ["dry", "snow-3"], "out": str(tmp_path)}
    result = compare_brakes(**asked, brake=["blind", "friction"])
    again = compare_brakes(**asked | {"weather": ["dry"]}, brake=["blind"])["rows"]
    assert again == [row for row in result["rows"] if (row["brake"], row["weather"]) == ("blind", "dry")]
    assert len(result["rows"]) == 10 * 2 * 2
    for row in result["rows"]:
        assert row["p05"] <= row["p50"] <= row["p95"]
    told = {(row["brake"], row["weather"]): row["collided"] for row in result["summary"]}
    assert told["blind", "snow-3"] > told["friction", "snow-3"] >= told["friction", "dry"] == 0
    assert "Emergency brakes by approach and weather" in (tmp_path / "aeb.html").read_text()
    with pytest.raises(
        InputError, match="--brake clever: there is none of this name; there are blind, friction"
    ):
        compare_brakes(brake=["clever"])
