"""The vehicle on its surface as the kernels of coupled mode take it."""

from typing import NamedTuple

from tasks.vehicle.effects.chassis import ChassisEffects
from tasks.vehicle.effects.numbers import effect_numbers
from tasks.vehicle.half_car import HalfCar, half_car
from tasks.vehicle.paper.wheels import Wheels, wheels_of
from tasks.vehicle.parameters import SurfaceResponse, Vehicle


class Chassis(NamedTuple):
    """The whole vehicle on its surface, save the tyre's curve.

    Parameters
    ----------
    body : the half-car
    wheels : wheels, brakes and longitudinal values
    lever : height of the body's centre of gravity above the wheel centres [m]
    lock_speed : wheel speed below which brake friction is proportional to it [rad/s]
    transfer : height of the centre of gravity over the wheelbase [1]
    theta : the library's effects in the order of `PARAMETERS`; a tuple, for arrays are counted at every call
    effects : those of coupled mode alone
    wet : 1 on a wet road, else 0 [1]
    snow_depth_mm : of the snow on it [mm]
    """

    body: HalfCar
    wheels: Wheels
    lever: float
    lock_speed: float
    transfer: float
    theta: tuple[float, ...]
    effects: ChassisEffects
    wet: float
    snow_depth_mm: float


def chassis_of(vehicle: Vehicle, response: SurfaceResponse, snow_depth_mm: float) -> Chassis:
    """The coupled model's values of a vehicle on a surface.

    ``cg_height`` is that of the whole vehicle; the axles' centres of gravity are at wheel height.

    Parameters
    ----------
    vehicle : the vehicle
    response : its tyres on the surface
    snow_depth_mm : of the snow on the road [mm]
    """
    axles = vehicle.unsprung_mass_f + vehicle.unsprung_mass_r
    body_height = (vehicle.mass * vehicle.cg_height - axles * vehicle.wheel_radius) / vehicle.sprung_mass
    theta, effects = effect_numbers(vehicle.effects)
    return Chassis(
        body=half_car(vehicle),
        wheels=wheels_of(vehicle),
        lever=body_height - vehicle.wheel_radius,
        lock_speed=vehicle.lock_speed,
        transfer=vehicle.cg_height / vehicle.wheelbase,
        theta=tuple(theta.tolist()),
        effects=effects,
        wet=float(response.wet),
        snow_depth_mm=snow_depth_mm,
    )
