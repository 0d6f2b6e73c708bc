"""How far a road feature moves a vehicle's struts: the half-car at one speed, without a brake."""

from functools import lru_cache

import numpy as np

from tasks.surface.road_profile import RoadHazard, road_elevation
from tasks.vehicle.half_car import HalfCar, build_half_car, integrate_half_car
from tasks.vehicle.parameters import Vehicle

LONGEST_STEP_S = 0.001
STEPS_IN_FEATURE = 60
"""Least number of steps on a feature [1]."""
SLOWEST_PASSAGE_S = 10.0
"""A feature that takes longer hardly moves a strut: 1 m of height moves a body of 1 Hz by 5 mm on its springs [s]."""
AFTERWARDS_S = 0.5
"""How long the struts are followed beyond the feature, half a period of the body [s]."""


def compute_strut_travel(vehicle: Vehicle, hazard: RoadHazard, speed: float) -> float:
    """Return the largest travel of a strut from rest, either way, on a road feature [m].

    Parameters
    ----------
    vehicle : the vehicle
    hazard : road feature
    speed : before the feature; into a depression the car gains what its depth gives [m/s]
    """
    speed = float(np.sqrt(speed**2 + 2 * vehicle.gravity * max(-hazard.height_m, 0.0)))
    if hazard.height_m == 0 or hazard.length_m / speed > SLOWEST_PASSAGE_S:
        return 0.0
    return _travel(build_half_car(vehicle), hazard.length_m, hazard.height_m, speed)


@lru_cache(maxsize=4096)
def _travel(car: HalfCar, length: float, height: float, speed: float) -> float:
    wheelbase = car.to_front + car.to_rear
    step = min(LONGEST_STEP_S, length / speed / STEPS_IN_FEATURE)
    count = int(((length + wheelbase) / speed + AFTERWARDS_S) / step) + 1
    station = speed * step * np.arange(count)
    feature = RoadHazard(center_m=length / 2, length_m=length, height_m=height)
    front, rear = road_elevation(station, feature), road_elevation(station - wheelbase, feature)
    x = integrate_half_car(front, rear, np.zeros(count), step, car).T
    travel_f, travel_r = x[0] - x[2] - car.to_front * x[1], x[0] - x[3] + car.to_rear * x[1]
    return float(max(np.abs(travel_f).max(), np.abs(travel_r).max()))
