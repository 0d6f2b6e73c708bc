"""Road features that a recording's pitch rate gives away, through the half-car."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tasks.surface.road_profile import RoadHazard, road_elevation
from tasks.vehicle.half_car import build_half_car, integrate_half_car
from tasks.vehicle.parameters import Vehicle

STEP = 0.002
LENGTHS = (1.0, 2.0, 3.0, 4.5, 6.0, 8.0)
SPACING = 0.5
"""Lengths and distance of the centres from which the search starts: a wrong wave of the body is a local optimum [m]."""
UNIT_HEIGHT = 0.01
"""Height at which the scan is made; no wheel leaves the road there, so the answer is proportional to it [m]."""
STARTS = 3


@dataclass(frozen=True, kw_only=True)
class Passage:
    """One stretch of a run over a feature.

    Parameters
    ----------
    interval : [s]
    station : distance along the road from the start of the stretch, float64 [N] [m]
    pitch_rate : about its median, float64 [N] [deg/s]
    vertical_acceleration : about its median, float64 [N] [m/s^2]
    """

    interval: float
    station: NDArray[np.float64]
    pitch_rate: NDArray[np.float64]
    vertical_acceleration: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class BumpFit:
    """The feature that explains a passage best, and how well.

    Parameters
    ----------
    feature : a raised cosine [m]
    rate_rmse : of the predicted pitch rate [deg/s]
    rate_rms : of the measured one: the error of a flat road [deg/s]
    rate_correlation, vertical_correlation : of pitch rate and of vertical acceleration [1]
    peak_pitch : largest pitch of the predicted passage, both directions together [deg]
    """

    feature: RoadHazard
    rate_rmse: float
    rate_rms: float
    rate_correlation: float
    vertical_correlation: float
    peak_pitch: float


def passage_of(
    columns: Mapping[str, NDArray[np.float64]], interval: float, start: float, end: float
) -> Passage:
    """Cut a stretch out of a run.

    Parameters
    ----------
    columns : with speed, pitch_rate and vertical_acceleration, each float64 [N]
    interval : [s]
    start, end : of the stretch [s]
    """
    cut = slice(round(start / interval), round(end / interval) + 1)
    speed = columns["speed"][cut]
    station = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * interval)))
    rate, vertical = columns["pitch_rate"][cut], columns["vertical_acceleration"][cut]
    return Passage(
        interval=interval,
        station=station,
        pitch_rate=rate - float(np.median(rate)),
        vertical_acceleration=vertical - float(np.median(vertical)),
    )


def ride_over(
    passage: Passage, feature: RoadHazard, vehicle: Vehicle
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Pitch rate [deg/s], vertical acceleration [m/s^2] and pitch [deg] of the half-car, each float64 [N].

    Parameters
    ----------
    passage : gives the station over time
    feature : of the road
    vehicle : the half-car
    """
    per_sample = round(passage.interval / STEP)
    count = (len(passage.station) - 1) * per_sample + 1
    index = np.arange(len(passage.station), dtype=np.float64)
    station = np.interp(np.arange(count) / per_sample, index, passage.station)
    front = np.asarray(road_elevation(station, feature), dtype=np.float64)
    rear = np.asarray(road_elevation(station - vehicle.wheelbase, feature), dtype=np.float64)
    states = integrate_half_car(front, rear, np.zeros(count), STEP, build_half_car(vehicle))
    vertical = np.gradient(states[:, 4], STEP)
    return (
        np.degrees(states[::per_sample, 5]),
        vertical[::per_sample],
        np.degrees(states[::per_sample, 1]),
    )


def fit_feature(passage: Passage, vehicle: Vehicle) -> BumpFit:
    """The raised cosine that explains the pitch rate best; the vertical acceleration only judges.

    Parameters
    ----------
    passage : measured
    vehicle : whose body answers
    """
    return _fit(passage, vehicle, vary_car=False)[0]


def fit_feature_and_car(passage: Passage, vehicle: Vehicle) -> tuple[BumpFit, Vehicle]:
    """The same with one factor on all springs and one on all dampers set free, and the car they give.

    Parameters
    ----------
    passage : measured
    vehicle : to start from
    """
    return _fit(passage, vehicle, vary_car=True)


def with_factors(vehicle: Vehicle, stiffness: float, damping: float) -> Vehicle:
    """The vehicle with scaled springs and dampers.

    Parameters
    ----------
    vehicle : to start from
    stiffness, damping : factors [1]
    """
    return replace(
        vehicle,
        suspension_stiffness_f=vehicle.suspension_stiffness_f * stiffness,
        suspension_stiffness_r=vehicle.suspension_stiffness_r * stiffness,
        suspension_damping_f=vehicle.suspension_damping_f * damping,
        suspension_damping_r=vehicle.suspension_damping_r * damping,
    )


def _fit(passage: Passage, vehicle: Vehicle, *, vary_car: bool) -> tuple[BumpFit, Vehicle]:
    reach = float(passage.station[-1])
    low, high = [0.0, np.log(0.3), -0.3], [reach, np.log(reach), 0.3]
    if vary_car:
        low, high = [*low, np.log(0.2), np.log(0.2)], [*high, np.log(5.0), np.log(5.0)]

    def meant(x: NDArray[np.float64]) -> tuple[RoadHazard, Vehicle]:
        feature = RoadHazard(center_m=float(x[0]), length_m=float(np.exp(x[1])), height_m=float(x[2]))
        car = with_factors(vehicle, float(np.exp(x[3])), float(np.exp(x[4]))) if vary_car else vehicle
        return feature, car

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return ride_over(passage, *meant(x))[0] - passage.pitch_rate

    fits = [
        least_squares(
            residual,
            [center, np.log(length), height, *([0.0, 0.0] if vary_car else [])],
            bounds=(low, high),
            diff_step=1e-3,
        )
        for center, length, height in _starts(passage, vehicle)
    ]
    feature, car = meant(min(fits, key=lambda fit: float(fit.cost)).x)
    rate, vertical, pitch = ride_over(passage, feature, car)
    result = BumpFit(
        feature=feature,
        rate_rmse=float(np.sqrt(np.mean((rate - passage.pitch_rate) ** 2))),
        rate_rms=float(np.sqrt(np.mean(passage.pitch_rate**2))),
        rate_correlation=float(np.corrcoef(rate, passage.pitch_rate)[0, 1]),
        vertical_correlation=float(np.corrcoef(vertical, passage.vertical_acceleration)[0, 1]),
        peak_pitch=float(np.ptp(pitch)),
    )
    return result, car


def _starts(passage: Passage, vehicle: Vehicle) -> list[tuple[float, float, float]]:
    """The best few of a grid of centres and lengths, each with the height that fits it best."""
    found = []
    for length in LENGTHS:
        for center in np.arange(SPACING, float(passage.station[-1]), SPACING).tolist():
            feature = RoadHazard(center_m=center, length_m=length, height_m=UNIT_HEIGHT)
            answer = ride_over(passage, feature, vehicle)[0]
            power = float(answer @ answer)
            share = float(answer @ passage.pitch_rate) / power if power > 0 else 0.0
            height = float(np.clip(share * UNIT_HEIGHT, -0.29, 0.29))
            error = answer * (height / UNIT_HEIGHT) - passage.pitch_rate
            found.append((float(error @ error), center, length, height))
    return [start[1:] for start in sorted(found)[:STARTS]]
