"""Road features from pitch rate: a known feature and a known car come back."""

import numpy as np
import pytest

from catalogs.entries import load
from studies.measured_drives.brake_dive import pitch_mode
from studies.measured_drives.road_bump import (
    Passage,
    fit_feature,
    fit_feature_and_car,
    ride_over,
    with_factors,
)
from studies.measured_drives.sensor_agreement import measure_sensor_agreement
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard
from tasks.vehicle.parameters import Vehicle

VEHICLE = load("vehicle", "paper-reference")
INTERVAL = 0.01
HUMP = RoadHazard(center_m=6.0, length_m=3.7, height_m=0.05)


def passage(feature: RoadHazard, car: Vehicle = VEHICLE, speed: float = 10.0) -> Passage:
    station = speed * INTERVAL * np.arange(221)
    blank = Passage(
        interval=INTERVAL, station=station, pitch_rate=np.zeros(221), vertical_acceleration=np.zeros(221)
    )
    rate, vertical, _ = ride_over(blank, feature, car)
    return Passage(interval=INTERVAL, station=station, pitch_rate=rate, vertical_acceleration=vertical)


@pytest.mark.parametrize(
    "feature",
    [
        HUMP,
        RoadHazard(center_m=9.0, length_m=2.5, height_m=-0.03),
        RoadHazard(center_m=3.0, length_m=5.0, height_m=0.02),
    ],
)
def test_a_feature_comes_back_from_its_pitch_rate_alone(feature: RoadHazard) -> None:
    found = fit_feature(passage(feature), VEHICLE)
    assert (found.feature.center_m, found.feature.length_m) == pytest.approx(
        (feature.center_m, feature.length_m), abs=0.02
    )
    assert found.feature.height_m == pytest.approx(feature.height_m, rel=0.02)
    assert found.rate_rmse < 0.01 * found.rate_rms
    assert found.vertical_correlation > 0.99, "the vertical acceleration was not fitted"


def test_another_cars_springs_and_dampers_come_back_with_the_feature() -> None:
    car = with_factors(VEHICLE, 1.8, 1.3)
    found, fitted = fit_feature_and_car(passage(HUMP, car), VEHICLE)
    assert pitch_mode(fitted) == pytest.approx(pitch_mode(car), rel=0.02)
    assert found.feature.height_m == pytest.approx(HUMP.height_m, rel=0.03)
    assert fit_feature(passage(HUMP, car), VEHICLE).rate_rmse > 10 * found.rate_rmse


def test_a_road_of_many_features_is_not_called_one() -> None:
    rough = passage(FLAT_ROAD)
    noise = np.convolve(np.random.default_rng(2).standard_normal(230), np.ones(10), mode="valid")
    found = fit_feature(
        Passage(interval=INTERVAL, station=rough.station, pitch_rate=noise, vertical_acceleration=noise),
        VEHICLE,
    )
    assert found.rate_correlation < 0.7 and found.rate_rmse > 0.6 * found.rate_rms


def slope_run(body_share: float) -> dict[str, np.ndarray]:
    t = np.arange(4000) * INTERVAL
    slope = 3.0 * np.sin(2 * np.pi * t / 12)
    acceleration = 0.5 * np.sin(2 * np.pi * t / 7)
    return {
        "speed": 15.0 + np.cumsum(acceleration) * INTERVAL, "pitch": slope, "pitch_rate": np.gradient(slope, t),
        "longitudinal_acceleration": acceleration - (1 - body_share) * 9.81 * np.sin(np.radians(slope)),
    }  # fmt: skip


def test_gravity_on_a_slope_shows_that_pitch_is_the_roads() -> None:
    road = measure_sensor_agreement(slope_run(0.0), INTERVAL)
    assert road.gravity_on_slope == pytest.approx(9.81, rel=0.02) and road.gravity_correlation > 0.99
    assert abs(measure_sensor_agreement(slope_run(1.0), INTERVAL).gravity_on_slope) < 0.3
