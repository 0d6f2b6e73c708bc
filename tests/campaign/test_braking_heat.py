"""Heat of the discs that a drive leaves, from what the car loses of its kinetic energy while the brake is applied."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.campaign.braking_heat import (
    estimate_disc_temperatures,
    measure_braking_heat,
)
from tasks.campaign.campaign import Campaign
from tasks.campaign.signals import ChannelRule, Signal
from tests.identification.synthetic import TOLERANCES, VEHICLE, plain_run

RATE = 50.0


def make_drive(*legs: tuple[float, float, float, float], pressed_at: float = 3.0) -> tuple[Signal, Signal]:
    """Return speed and brake pressure of a drive in legs of duration, first and last speed, and pressure."""
    speed, pressure = [], []
    for seconds, first, last, applied in legs:
        count = round(seconds * RATE)
        speed.append(np.linspace(first, last, count, endpoint=False))
        pressure.append(np.full(count, applied * pressed_at))
    values = np.concatenate(speed)
    time = np.arange(len(values)) / RATE
    return Signal(time=time, values=values), Signal(time=time, values=np.concatenate(pressure))


RULES = [
    ChannelRule(channel="speed", sources=("v",), unit="m/s"),
    ChannelRule(channel="brake_pressure", sources=("p",), unit="MPa"),
]


def heat_at(time: float, speed: Signal, brake: Signal) -> float:
    [heat] = measure_braking_heat({"v": speed, "p": brake}, RULES, [time])
    return heat


def test_a_stop_heats_the_discs_by_the_kinetic_energy_of_the_car():
    speed, brake = make_drive((10.0, 30.0, 30.0, 0.0), (3.0, 30.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))
    # v^2/2 = 450 J/kg, of which the air has taken some 2 % by the time the car stands
    assert heat_at(13.0, speed, brake) == pytest.approx(450.0, rel=0.03)
    assert heat_at(9.0, speed, brake) == 0.0


@pytest.mark.parametrize(("pace", "seconds"), [(14.0, 200.0), (28.0, 200.0 / 2.0**0.8), (0.0, 1000.0)])
def test_discs_cool_by_the_loss_of_the_model_and_faster_in_faster_air(pace: float, seconds: float):
    """12 kJ/K over 60 W/K is 200 s at 14 m/s; the loss grows with the speed to the power of 0.8, from a fifth on."""
    speed, brake = make_drive(
        (5.0, 30.0, 30.0, 0.0), (2.0, 30.0, 14.0, 1.0), (1.0, 14.0, pace, 0.0), (1100.0, pace, pace, 0.0)
    )
    early, late = heat_at(20.0, speed, brake), heat_at(20.0 + seconds, speed, brake)
    assert late / early == pytest.approx(np.exp(-1.0), rel=1e-3)


def test_a_car_that_slows_down_without_its_brakes_heats_nothing():
    speed, brake = make_drive((20.0, 30.0, 15.0, 0.0), (2.0, 15.0, 10.0, 1.0))
    assert heat_at(19.0, speed, brake) == 0.0


def test_noise_of_the_speed_heats_nothing():
    speed, brake = make_drive((5.0, 30.0, 30.0, 0.0), (6.0, 30.0, 10.0, 1.0), (5.0, 10.0, 10.0, 0.0))
    noise = np.random.default_rng(3).normal(0.0, 0.2, len(speed.values))
    noisy = replace(speed, values=speed.values + noise)
    assert heat_at(14.0, noisy, brake) == pytest.approx(heat_at(14.0, speed, brake), rel=0.03)


def test_spikes_and_gaps_of_the_speed_heat_nothing():
    speed, brake = make_drive((5.0, 30.0, 30.0, 0.0), (6.0, 30.0, 10.0, 1.0), (5.0, 10.0, 10.0, 0.0))
    values = speed.values.copy()
    values[549:551], values[330] = 900.0, np.nan  # the first at the end of the braking
    assert heat_at(14.0, replace(speed, values=values), brake) == pytest.approx(
        heat_at(14.0, speed, brake), rel=0.01
    )
    assert heat_at(14.0, replace(speed, values=np.full(len(values), np.nan)), brake) == 0.0


def test_five_samples_of_a_receiver_of_1_hz_are_a_stop_and_no_spike():
    speed, brake = make_drive(
        (5.0, 30.0, 30.0, 0.0), (4.0, 30.0, 10.0, 1.0), (4.0, 10.0, 30.0, 0.0), (2.0, 30.0, 30.0, 0.0)
    )
    slow = Signal(time=speed.time[24::50], values=speed.values[24::50])
    # the last half second of the braking lies between two samples
    lost = 0.5 * (30.0**2 - 12.5**2)
    assert heat_at(9.5, slow, brake) == pytest.approx(lost, rel=0.03)


def test_brake_signals_of_any_size_and_rest_give_the_same_heat():
    speed, brake = make_drive((5.0, 30.0, 30.0, 0.0), (3.0, 30.0, 10.0, 1.0), (5.0, 10.0, 10.0, 0.0))
    command = replace(brake, values=1.5 + 2.0 * brake.values)
    assert heat_at(9.0, speed, command) == heat_at(9.0, speed, brake) > 0.0


def test_a_brake_that_is_hardly_ever_applied_is_told_from_the_noise_of_its_gauge():
    speed, brake = make_drive((3000.0, 30.0, 30.0, 0.0), (100.0, 30.0, 10.0, 0.0), (3.0, 10.0, 5.0, 1.0))
    noise = np.random.default_rng(1).normal(0.0, 0.02, len(brake.values))
    assert heat_at(3099.0, speed, replace(brake, values=brake.values + noise)) == 0.0
    assert heat_at(3099.0, speed, replace(brake, values=noise)) == 0.0


def test_a_descent_heats_the_discs_by_the_height_that_it_loses():
    """600 s at 15 m/s down a slope of 0.08 are g x 720 m = 7,060 J/kg, braked in applications of 10 s every 20."""
    legs = [(10.0, 15.0, 15.0, applied) for _ in range(30) for applied in (0.0, 1.0)]
    speed, brake = make_drive(*legs)
    slope = replace(speed, values=np.full(len(speed.time), -np.degrees(np.arcsin(0.08))))
    rules = [*RULES, ChannelRule(channel="road_slope", sources=("s",), unit="deg")]
    [flat] = measure_braking_heat({"v": speed, "p": brake}, RULES, [599.9])
    [found] = measure_braking_heat({"v": speed, "p": brake, "s": slope}, rules, [600.0])
    # each leaves 117.7 J/kg, of which the air takes its share in 189 s: a geometric series
    left = np.exp(-20.0 / (200.0 / (15.0 / 14.0) ** 0.8))
    assert flat == 0.0 and found == pytest.approx(117.7 * (1.0 - left**30) / (1.0 - left), rel=0.01)


def test_a_run_that_begins_within_an_application_has_the_heat_so_far():
    speed, brake = make_drive((5.0, 30.0, 30.0, 0.0), (4.0, 30.0, 10.0, 1.0), (1.0, 10.0, 10.0, 0.0))
    assert heat_at(7.0, speed, brake) == pytest.approx(0.5 * (30.0**2 - 20.0**2), rel=0.02)


def test_a_car_that_speeds_up_under_its_brakes_cools_no_disc():
    speed, brake = make_drive(
        (2.0, 5.0, 5.0, 0.0),
        (4.0, 5.0, 25.0, 1.0),
        (1.0, 25.0, 25.0, 0.0),
        (4.0, 25.0, 5.0, 1.0),
        (9.0, 5.0, 5.0, 0.0),
    )
    assert heat_at(11.1, speed, brake) == pytest.approx(300.0, rel=0.03)


def test_a_drive_is_read_through_its_map():
    speed, brake = make_drive((5.0, 30.0, 30.0, 0.0), (3.0, 30.0, 10.0, 1.0), (5.0, 10.0, 10.0, 0.0))
    signals = {"v": replace(speed, values=3.6 * speed.values), "p": brake}
    rules = [
        ChannelRule(channel="speed", sources=("v",), unit="km/h"),
        ChannelRule(channel="brake_pressure", sources=("p",), unit="MPa"),
    ]
    expected = [heat_at(time, speed, brake) for time in (4.0, 10.0)]
    np.testing.assert_allclose(measure_braking_heat(signals, rules, [4.0, 10.0]), expected, rtol=1e-12)
    both = [rules[0], replace(rules[1], sources=("p", "dead"))]
    dead = replace(brake, values=np.zeros(len(brake.values)))
    np.testing.assert_allclose(measure_braking_heat(signals | {"dead": dead}, both, [10.0]), expected[1:])
    assert expected[0] == 0.0 < expected[1]


def test_runs_begin_with_the_temperature_of_the_models_discs():
    """450 J/kg of a car of mass m warm discs of 12 kJ/K by 450 m / 12,000 K."""
    hot = replace(plain_run(20.0, 2.0, name="hot"), disc_rise=0.0, braking_heat=450.0)
    campaign = Campaign(
        name="x",
        vehicle="paper-reference",
        runs=(hot,),
        tolerances=TOLERANCES,
        content_hash="",
        split_hash="",
    )
    [run] = estimate_disc_temperatures(campaign, VEHICLE.mass).runs
    assert run.disc_rise == pytest.approx(450.0 * VEHICLE.mass / 12_000.0)
    known = replace(campaign, runs=(replace(hot, disc_rise=250.0),))
    assert [run.disc_rise for run in estimate_disc_temperatures(known, VEHICLE.mass).runs] == [250.0]
