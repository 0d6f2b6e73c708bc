"""Calibration on some drives, prediction of another: the truth is known, so it must come back."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from studies.measured_drives.brake_dive import (
    DiveModel,
    dive_of_deceleration,
    pitch_mode,
    predict_event,
    with_model,
)
from studies.measured_drives.bus_drive import drive_motion
from studies.measured_drives.events import Event, RecordedRun
from studies.measured_drives.leave_one_out import leave_one_drive_out, macro_mean
from studies.measured_drives.plans import load_plan
from studies.measured_drives.selection import select_events

VEHICLE, SURFACE, BUS = (
    load("vehicle", "paper-reference"),
    load("surface", "dense-asphalt"),
    load_plan("bus", "a2d2-like"),
)
STRAIGHT = replace(
    BUS, style=replace(BUS.style, curve_share=0.0, rough_share=0.0, dragging_share=0.0, lift_share=0.0, slope=0.0,
                       start_speed=(8.0, 15.0), peak_pressure=(0.4, 1.6))
)  # fmt: skip


@pytest.fixture(scope="module")
def events() -> tuple[Event, ...]:
    drives = []
    for number in (1, 2):
        motion = drive_motion(VEHICLE, 0.82, STRAIGHT, events=4, seed=1, drive=number)
        columns = {name: values[::10] for name, values in motion.items()}
        drives.append(RecordedRun(name=f"d{number}", drive=f"d{number}", interval=0.01, columns=columns))
    retained = select_events(drives, load_plan("protocol", "brake-dive")).retained
    assert len(retained) >= 6
    return retained


def test_rough_roads_shake_and_bends_turn_a_braking_car_by_the_stated_amounts() -> None:
    def drive(**shares: float) -> dict[str, np.ndarray]:
        bus = replace(STRAIGHT, style=replace(STRAIGHT.style, **shares))
        return drive_motion(VEHICLE, 0.82, bus, events=1, seed=1, drive=1)

    level, rough, curved = drive(), drive(rough_share=1.0), drive(curve_share=1.0)
    # standard deviations of 1.0 instead of 0.15 m/s^2 and 0.6 instead of 0.15 deg/s, less at both ends of the event
    for name, more in (("vertical_acceleration", 0.85), ("roll_rate", 0.45)):
        shaken = (rough[name] - level[name])[rough[name] != level[name]]
        assert 0.75 * more < shaken.std() < 1.05 * more, name
    assert np.abs(curved["steering_angle"]).max() == pytest.approx(40.0, rel=0.01)
    assert np.abs(curved["yaw_rate"]).max() == pytest.approx(8.0, rel=0.01)


def test_the_pitch_mode_is_that_of_the_rigid_tyre_half_car() -> None:
    # sqrt((27000 * 1.2^2 + 27000 * 1.5^2) / 1800) / 2 pi, and 3920 * 3.69 / (2 * 1800 * 7.4397)
    assert pitch_mode(VEHICLE) == pytest.approx((1.18407, 0.54007), rel=1e-4)


def test_a_steady_deceleration_gives_the_static_dive() -> None:
    model = DiveModel(brake_gain=1.0, pitch_gain=1.2, stiffness=1.0, damping_ratio=0.7)
    dive, rate = dive_of_deceleration(VEHICLE, model, np.full(500, 2.0), 0.01)
    # moment over pitch stiffness of springs in series with the tyres, k k_t / (k + k_t) each
    series = 27000 * 193268.620855 / (27000 + 193268.620855)
    moment = 1.2 * 1200 * 0.55 * 2.0
    k11, k12, k22 = 2 * series, series * (1.5 - 1.2), series * (1.2**2 + 1.5**2)
    static = moment / (k22 - k12**2 / k11)
    assert dive[-1] == pytest.approx(np.degrees(static), rel=1e-3)
    assert abs(rate[-1]) < 1e-3


def test_the_stiffest_and_most_damped_car_is_integrated_as_by_a_finer_step() -> None:
    model = DiveModel(brake_gain=1.0, pitch_gain=1.0, stiffness=8.0, damping_ratio=1.5)
    t = np.arange(301) * 0.01
    coarse, _ = dive_of_deceleration(VEHICLE, model, np.clip(t, 0.0, 1.0), 0.01)
    fine, _ = dive_of_deceleration(VEHICLE, model, np.clip(np.arange(3001) * 0.001, 0.0, 1.0), 0.001)
    np.testing.assert_allclose(coarse, fine[::10], atol=1e-5)


def test_the_cars_true_brake_and_pitch_mode_come_back(events: tuple[Event, ...]) -> None:
    folds = leave_one_drive_out(events, VEHICLE, SURFACE)
    assert [(fold.variant, fold.drive) for fold in folds] == [
        ("pitch_only", "d1"), ("joint", "d1"), ("pitch_only", "d2"), ("joint", "d2"),
    ]  # fmt: skip
    for fold in folds:
        assert fold.model.brake_gain == pytest.approx(1600, rel=0.01)
        if fold.variant == "pitch_only":
            assert fold.model.damping_ratio == 0.70
        else:
            assert fold.model.damping_ratio == pytest.approx(0.35, abs=0.03)
            frequency, _ = pitch_mode(with_model(VEHICLE, fold.model))
            assert frequency == pytest.approx(1.18407 * 1.4**0.5, rel=0.02)
    joint, pitch_only = macro_mean(folds, "joint"), macro_mean(folds, "pitch_only")
    assert joint.pitch_rmse < 0.03 * joint.no_dive_rmse
    assert joint.rate_rmse < pitch_only.rate_rmse


def test_each_fold_learns_nothing_from_the_drive_it_leaves_out(events: tuple[Event, ...]) -> None:
    def damaged(event: Event) -> Event:
        return replace(event, columns={**event.columns, "pitch": 3.0 * event.columns["pitch"]})

    spoilt = [damaged(event) if event.drive == "d1" else event for event in events]
    clean, dirty = (
        leave_one_drive_out(events, VEHICLE, SURFACE),
        leave_one_drive_out(spoilt, VEHICLE, SURFACE),
    )
    for before, after in zip(clean, dirty, strict=True):
        assert (before.model == after.model) == (before.drive == "d1")
        if before.drive == "d1":  # the prediction stays, and what was measured is three times as much
            assert after.peak_ratio == pytest.approx(before.peak_ratio / 3, rel=1e-6)


def test_a_prediction_uses_pressure_and_start_speed_alone(events: tuple[Event, ...]) -> None:
    event = events[0]
    model = DiveModel(brake_gain=1600.0, pitch_gain=1.1, stiffness=1.4, damping_ratio=0.35)
    shuffled = {
        name: values if name in ("brake_pressure", "speed") else values[::-1].copy()
        for name, values in event.columns.items()
    }
    a = predict_event(event, VEHICLE, model, SURFACE)
    b = predict_event(replace(event, columns=shuffled), VEHICLE, model, SURFACE)
    np.testing.assert_array_equal(a.predicted_dive, b.predicted_dive)
    np.testing.assert_array_equal(a.predicted_rate, b.predicted_rate)


def test_without_pitch_rate_only_the_angle_is_calibrated_and_scored(events: tuple[Event, ...]) -> None:
    bare = [
        replace(event, columns={n: v for n, v in event.columns.items() if n != "pitch_rate"})
        for event in events
    ]
    folds = leave_one_drive_out(bare, VEHICLE, SURFACE)
    assert {fold.variant for fold in folds} == {"pitch_only"}
    assert np.isnan(macro_mean(folds, "pitch_only").rate_rmse)
