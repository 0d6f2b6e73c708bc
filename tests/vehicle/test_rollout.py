"""Rules that every rollout keeps, in both modes."""

from math import isnan

import numpy as np
import pytest

from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard
from tasks.surface.state import SurfaceState
from tasks.vehicle.rollout import MODES, Controls, simulate_scenario
from tests.vehicle.conftest import HUMP, command

BOTH = pytest.mark.parametrize("mode", MODES)


@BOTH
def test_columns_are_the_tick_channels_at_one_kilohertz(drive, mode):
    ride = drive(mode=mode, duration=2.5)
    assert list(ride.columns) == [channel.name for channel in TICK_CHANNELS]
    assert {len(column) for column in ride.columns.values()} == {2501}
    assert ride.columns["t_ns"].dtype == np.int64
    np.testing.assert_array_equal(ride.columns["t_ns"], np.arange(2501) * 1_000_000)
    assert ride.columns["contact_f"].dtype == bool
    assert all(np.isfinite(column).all() for column in ride.columns.values())


@BOTH
@pytest.mark.parametrize("surface", [("dry", 0.82), ("snow", 0.24)])
def test_after_the_stop_everything_rests_and_the_body_comes_to_rest(drive, mode, surface):
    ride = drive(*surface, mode=mode, duration=14.0)
    after = np.arange(14001) * 1e-3 >= ride.stop_time - 1e-9
    for name in (
        "speed",
        "wheel_speed_f",
        "wheel_speed_r",
        "braking_slip_f",
        "braking_slip_r",
        "longitudinal_acceleration",
    ):
        assert not ride.columns[name][after].any(), name
    assert np.ptp(ride.columns["station"][after]) == 0
    assert ride.columns["speed"][~after].min() > 0
    assert ride.columns["abs_scale_f"][-1] == 1
    for name in ("pitch", "heave", "pitch_rate", "heave_rate"):
        assert abs(ride.columns[name][-1]) < 1e-7, name


@BOTH
def test_same_input_gives_the_same_bytes(drive, mode):
    first, again = (drive(speed_km_h=40, hazard=HUMP, mode=mode) for _ in range(2))
    assert all(first.columns[name].tobytes() == again.columns[name].tobytes() for name in first.columns)


@BOTH
def test_station_is_the_integral_of_speed(drive, mode):
    columns = drive(mode=mode).columns
    speed = columns["speed"]
    travelled = np.concatenate([[0], np.cumsum(5e-4 * (speed[1:] + speed[:-1]))])
    np.testing.assert_allclose(columns["station"], travelled, atol=2e-4)


@BOTH
def test_stopping_distance_runs_from_a_position_trigger(drive, mode):
    ride = drive(brake=command(onset=None, onset_station_m=12.0), mode=mode)
    assert ride.brake_onset_time == pytest.approx(12 / (60 / 3.6), rel=1e-3)
    assert ride.stopping_distance == pytest.approx(ride.columns["station"][-1] - 12, abs=1e-6)
    by_time = drive(mode=mode)
    assert ride.stopping_distance == pytest.approx(by_time.stopping_distance, abs=0.02)


@BOTH
def test_speed_is_held_until_the_brake_when_asked(drive, mode):
    held = drive(mode=mode, hold=True).columns["speed"]
    coasting = drive(mode=mode).columns["speed"]
    assert np.ptp(held[:1000]) == 0 < np.ptp(coasting[:1000])
    assert coasting[999] == pytest.approx(60 / 3.6 - 0.004 * 0.999, abs=1e-3)


@BOTH
def test_without_a_brake_there_is_no_stop(drive, mode):
    ride = drive(brake=command(0.0, onset=None), mode=mode, duration=3.0)
    assert isnan(ride.brake_onset_time) and isnan(ride.stop_time) and isnan(ride.stopping_distance)
    assert not ride.columns["brake_pressure_mpa"].any()


@BOTH
def test_a_brake_after_the_clip_and_a_stop_after_the_clip_do_not_count(drive, mode):
    late = drive(brake=command(onset=5.0), mode=mode, duration=3.0)
    assert isnan(late.brake_onset_time)
    cut = drive(mode=mode, duration=4.0)
    assert isnan(cut.stop_time) and isnan(cut.stopping_distance) and cut.columns["speed"][-1] > 0


@BOTH
def test_a_released_brake_lets_the_car_roll_on(drive, mode):
    ride = drive(brake=command(hold_s=0.5, release_s=0.2), mode=mode, duration=6.0)
    assert isnan(ride.stop_time)
    assert np.ptp(ride.columns["speed"][3000:]) == pytest.approx(0.004 * 3, rel=0.2)
    assert not ride.columns["brake_torque_f"][2300:].any()


@BOTH
def test_braking_pitches_nose_down_and_a_hump_first_nose_up(drive, mode):
    assert drive(mode=mode).columns["pitch"][2000:4000].min() > np.radians(2)
    hump = drive(speed_km_h=40, hazard=HUMP, brake=command(0.0, onset=None), mode=mode).columns
    entering = (hump["station"] > 18.5) & (hump["station"] < 20)
    assert hump["pitch"][entering].min() < -0.01
    assert hump["heave"].max() > 0.02


@BOTH
def test_a_short_high_feature_opens_the_contact_and_says_so(drive, mode):
    kerb = RoadHazard(center_m=20, length_m=0.6, height_m=0.10)
    columns = drive(
        speed_km_h=40, hazard=kerb, brake=command(0.0, onset=None), mode=mode, duration=4.0
    ).columns
    assert not columns["contact_f"].all() and not columns["contact_r"].all()
    assert columns["axle_load_f"].min() == 0
    np.testing.assert_array_equal(columns["contact_f"], columns["axle_load_f"] > 0)


def test_what_the_tables_gave_is_reported(drive):
    ride = drive("rain", 0.347126, duration=1.0)
    assert ride.tyre_peak == pytest.approx(0.9278 * 0.347126) and ride.slip_stiffness == 1.0
    assert ride.target_slip == pytest.approx(0.1309, abs=1e-4)
    assert np.degrees(ride.static_pitch) == pytest.approx(0.154150)
    assert not ride.calibration_extrapolated and drive("dry", 0.7, duration=1.0).calibration_extrapolated


def test_all_wrong_arguments_are_named_at_once(vehicle):
    controls = Controls(initial_speed=10.0, brake=command(), hold_speed_until_brake=False)
    with pytest.raises(InputError) as error:
        simulate_scenario(vehicle, SurfaceState(kind="hail", friction=-0.1), controls, FLAT_ROAD, mode="fast",
                duration_s=1.0005, step_s=0.0003)  # fmt: skip
    said = error.value.problems
    assert len(said) == 5
    assert "mode must be one of paper, coupled; it is fast" in said
    assert any(sentence.startswith("weather must be dry, rain") and "'hail'" in sentence for sentence in said)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_car_must_move_at_first(speed):
    with pytest.raises(InputError, match="initial_speed must be a positive number"):
        Controls(initial_speed=speed, brake=command(), hold_speed_until_brake=False)
