"""One stop predicted from another: the added effects come back where they are, and what is left is named."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from studies.measured_drives.events import RecordedRun
from studies.measured_drives.stop import Stop, stop_of, stopping_distance
from studies.measured_drives.stop_findings import slip_cycles
from studies.measured_drives.stop_ladder import Rung, _model, compute_uncalibrated_errors, fit_ladder
from studies.measured_drives.stop_swing import Swing, fit_swing, swing_acceleration, with_swing
from tasks.campaign.campaign import CHANNELS
from tasks.identification.inference.forward import predict_channels
from tasks.vehicle.effects.table import build_parameter_vector

VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
INTERVAL = 0.01
TRUTH = {"pressure_gain": 0.2, "lag": 0.08, "wheel_radius": -0.02, "wheel_speed_delay": 0.06}


def made_stop(peak: float, speed: float, truth: dict[str, float], name: str) -> Stop:
    """A stop of the model itself with effects in it, and the columns of a bus around it."""
    t = np.arange(700) * INTERVAL
    pressure = np.clip((t - 0.4) / 0.3, 0.0, 1.0) * peak
    columns = {name: np.zeros(700) for name in CHANNELS} | {
        "brake_pressure": pressure, "brake_torque": 1000.0 * pressure, "engine_torque": np.where(t < 3.0, -300.0, 0.0),
        "speed": np.full(700, speed),
    }  # fmt: skip
    blank = Stop(name=name, interval=INTERVAL, columns=columns, onset=40)
    # the wheels of a standing car chatter at the slip's floor: the measured car is taken to stand from 2 m/s on
    values = predict_channels(
        _model(blank, VEHICLE, SURFACE, engine_torque=True), build_parameter_vector(truth)
    )
    made = dict(zip(CHANNELS, values.T, strict=True))
    slow = int(np.argmax(made["speed"] < 2.0))
    rest = made["speed"][slow] + made["longitudinal_acceleration"][slow - 1] * INTERVAL * np.arange(
        700 - slow
    )
    made["speed"][slow:] = np.maximum(rest, 0.0)
    made["longitudinal_acceleration"][slow:] = np.where(
        rest > 0, made["longitudinal_acceleration"][slow - 1], 0.0
    )
    return replace(blank, columns=columns | made)


@pytest.fixture(scope="module")
def stops() -> tuple[Stop, Stop]:
    return made_stop(1.5, 18.0, TRUTH, "gentle"), made_stop(2.2, 16.0, TRUTH, "firm")


def rung(name: str, engine: bool, *longitudinal: str, swing: bool = False) -> Rung:
    return Rung(name=name, adds="", engine_torque=engine, fixed={}, longitudinal=longitudinal, swing=swing)


def test_effects_that_are_there_are_found_on_one_stop_and_predict_the_other(stops: tuple[Stop, Stop]) -> None:
    plain, full = fit_ladder(
        *stops,
        [rung("plain", False, "pressure_gain"), rung("full", True, "pressure_gain", "lag")],
        VEHICLE,
        SURFACE,
    )
    for name, value in TRUTH.items():
        assert full.parameters[name] == pytest.approx(value, abs=0.005), name
    assert full.held_out.speed_rmse < 0.02 < 5 * full.held_out.speed_rmse < plain.held_out.speed_rmse
    assert abs(full.held_out.distance_error) < 0.05 < abs(plain.held_out.distance_error)


def test_the_held_out_stop_is_never_looked_at_while_fitting(stops: tuple[Stop, Stop]) -> None:
    train, held_out = stops
    ladder = [rung("full", True, "pressure_gain", "lag", swing=True)]
    spoilt = replace(held_out, columns={**held_out.columns, "pitch": held_out.columns["pitch"] + 3.0,
                                        "speed": np.maximum(held_out.columns["speed"] - 1.0, 0.0)})  # fmt: skip
    (clean,), (dirty,) = (fit_ladder(train, other, ladder, VEHICLE, SURFACE) for other in (held_out, spoilt))
    assert (clean.parameters, clean.dive, clean.swing) == (dirty.parameters, dirty.dive, dirty.swing)


def test_calibrating_beats_the_data_sheet(stops: tuple[Stop, Stop]) -> None:
    train, held_out = stops
    (found,) = fit_ladder(train, held_out, [rung("plain", False, "pressure_gain")], VEHICLE, SURFACE)
    assert found.held_out.speed_rmse < compute_uncalibrated_errors(held_out, VEHICLE, SURFACE).speed_rmse


def test_the_stopping_distance_is_that_of_uniform_deceleration() -> None:
    t = np.arange(600) * INTERVAL
    speed = np.clip(20.0 - 5.0 * (t - 1.0), 0.0, 20.0)
    stop = Stop(name="x", interval=INTERVAL, columns={"speed": speed}, onset=100)
    # from 20 m/s at 5 m/s^2 down to .5 m/s
    assert stopping_distance(stop, speed) == pytest.approx((20**2 - 0.5**2) / 10, abs=0.02)
    assert np.isnan(stopping_distance(stop, speed + 1.0))


def test_the_longest_application_that_ends_at_rest_is_the_stop() -> None:
    t = np.arange(1200) * INTERVAL
    pressure = np.where((t > 2) & (t < 2.5), 1.0, 0.0) + np.where(t > 6, 1.0, 0.0)
    speed = np.clip(20.0 - 6.0 * np.clip(t - 6.0, 0.0, None), 0.0, 20.0)
    columns = {"brake_pressure": pressure, "speed": speed, "pitch": np.full(1200, 0.7)}
    drive = RecordedRun(name="d", drive="d", interval=INTERVAL, columns=columns)
    stop = stop_of(drive, 0.4)
    assert stop is not None and stop.onset == 40
    assert len(stop.columns["speed"]) == pytest.approx(1200 - 600 + 40, abs=2)
    assert stop.columns["speed"][stop.onset] == pytest.approx(20.0, abs=0.1)
    assert np.all(stop.columns["pitch"] == 0.0)
    assert stop_of(replace(drive, columns=columns | {"speed": speed + 5.0}), 0.4) is None


def test_the_swing_starts_from_the_deceleration_and_solves_its_equation() -> None:
    swing = Swing(frequency=3.0, damping_ratio=0.22)
    t = np.arange(4000) * 1e-4
    a = swing_acceleration(t, 6.0, swing)
    rate, curve = np.gradient(a, 1e-4), np.gradient(np.gradient(a, 1e-4), 1e-4)
    omega = 2 * np.pi * 3.0
    assert a[0] == -6.0 and rate[1] == pytest.approx(2 * 0.22 * omega * 6.0, rel=0.02)
    residual = curve + 2 * 0.22 * omega * rate + omega**2 * a
    assert np.max(np.abs(residual[5:-5])) < 1e-3 * omega**2 * 6.0
    assert a.max() > 0, "the body swings back"


def test_a_swing_in_a_measured_stop_is_found() -> None:
    t = np.arange(500) * INTERVAL
    speed = np.maximum(15.0 - 5.0 * t, 0.0)
    truth = Swing(frequency=3.4, damping_ratio=0.25)
    measured = with_swing(np.where(speed > 0, -5.0, 0.0), speed, INTERVAL, truth)
    found = fit_swing(measured, speed, INTERVAL, 0.8)
    assert (found.frequency, found.damping_ratio) == pytest.approx((3.4, 0.25), abs=1e-3)


def test_slip_cycles_are_counted_and_a_steady_slip_has_none() -> None:
    t = np.arange(200) * INTERVAL
    speed = np.full(200, 10.0)
    speed[-1] = 1.0

    def counted(slip: np.ndarray) -> float:
        columns = {"speed": speed, "wheel_speed_front": speed * (1 - slip) / VEHICLE.wheel_radius}
        stop = Stop(name="x", interval=INTERVAL, columns=columns, onset=0)
        return slip_cycles(stop, columns, VEHICLE, {}).cycles_per_s

    assert counted(0.08 + 0.05 * np.sin(2 * np.pi * 4.0 * t)) == pytest.approx(4.0, abs=0.6)
    assert counted(np.full(200, 0.1)) == 0.0
    assert counted(0.1 + 0.005 * np.sin(2 * np.pi * 4.0 * t)) == 0.0
