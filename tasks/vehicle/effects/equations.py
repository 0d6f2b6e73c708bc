"""Equations of the effects, one per port; with all values 0 each returns exactly the plain model's value."""

from math import exp

from numba.extending import register_jitable

from tasks.surface.wet_friction import WetGrip, compute_wet_share
from tasks.vehicle.effects.table import EffectValues

register_jitable(cache=True, error_model="numpy", forceinline=True)(compute_wet_share)

AIR_DENSITY = 1.2
"""Air at 20 degrees and sea level [kg/m^3]."""
COULOMB_SPEED = 0.01
"""Suspension speed over which dry friction changes sign [m/s]."""
LOWEST_GEAR = 12.0
"""Wheel speed up to which a car stays in its lowest gear: some 4 m/s [rad/s]."""


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_resistance(effects: EffectValues, speed: float, direction: float, snow_depth_mm: float) -> float:
    """Return the force on the body against the motion [N]: air and snow ploughing.

    Parameters
    ----------
    effects : numbers of the vehicle's effects
    speed : speed of the vehicle [m/s]
    direction : +1 along the route, -1 against it; the wind blows along the route [1]
    snow_depth_mm : depth of the snow on the road [mm]
    """
    force = 0.0
    if speed > 0.0:
        if effects.drag_area != 0.0:
            air = speed + direction * effects.wind_speed
            force += 0.5 * AIR_DENSITY * effects.drag_area * air * abs(air)
        force += effects.ploughing * snow_depth_mm
    return force


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_rolling_resistance(effects: EffectValues, speed: float) -> float:
    """Return the rolling resistance of a wheel over its load (Gillespie 1992) [1].

    Parameters
    ----------
    effects : numbers of the vehicle's effects
    speed : speed of the vehicle [m/s]
    """
    return effects.rolling_coefficient + effects.rolling_speed * speed


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_engine_torque(effects: EffectValues, omega: float, radius: float) -> float:
    """Return the torque of the engine on the driven wheels, against their rotation [N m]: drag, less the idle creep.

    Through its gears an engine turns about equally fast at any road speed, and drags with about the same power; below
    the speed of the lowest gear its torque falls with its own speed.

    Parameters
    ----------
    effects : numbers of the vehicle's effects
    omega : speed of the driven wheels [rad/s]
    radius : radius of the wheels [m]
    """
    torque = effects.engine_torque + effects.engine_viscous * omega
    if effects.engine_power != 0.0:
        torque += 1e3 * effects.engine_power * omega / (omega * omega + LOWEST_GEAR * LOWEST_GEAR)
    rim_speed = radius * omega
    if effects.creep_force != 0.0 and rim_speed < effects.creep_speed:
        torque -= effects.creep_force * radius * (1.0 - rim_speed / effects.creep_speed)
    return torque


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_brake_factor(effects: EffectValues, pressure: float, speed: float, disc_rise: float) -> float:
    """Return the factor of pad friction and hydraulics on the linear law from pressure to torque [1].

    Parameters
    ----------
    effects : numbers of the vehicle's effects
    pressure : pressure at the pads [MPa]
    speed : speed of the vehicle [m/s]
    disc_rise : temperature of the discs above ambient [K]
    """
    factor = 1.0 + effects.pressure_curve * pressure
    factor *= 1.0 - effects.fade * disc_rise / 100.0
    factor *= 1.0 - effects.pad_speed * (speed - effects.pad_speed_reference)
    return max(factor, 0.0)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_friction_factor(
    effects: EffectValues, speed: float, load_ratio: float, slip_energy: float, wet: float, grip: WetGrip
) -> float:
    """Return the factor of load, heat of sliding, water film and speed on the tyre's friction [1].

    Parameters
    ----------
    effects : numbers of the vehicle's effects
    speed : speed of the vehicle [m/s]
    load_ratio : contact load over that at rest [1]
    slip_energy : energy of sliding since the start [J]
    wet : 1 on a wet road, else 0 [1]
    grip : of the film on it
    """
    factor = 1.0 - effects.load_sensitivity * (load_ratio - 1.0)
    factor *= 1.0 - effects.tyre_heating * slip_energy / 1e5
    if wet > 0.0:
        factor *= 1.0 - effects.wet_speed * max(speed - effects.wet_threshold, 0.0)
        if grip.decay > 0.0:
            factor *= compute_wet_share(speed, grip) / grip.reference
    factor *= 1.0 - effects.friction_speed * speed
    return max(factor, 0.0)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_strut_force(
    effects: EffectValues, stiffness: float, damping: float, travel: float, rate: float
) -> float:
    """Return the spring and damper force of one axle, positive in extension [N].

    Parameters
    ----------
    effects : numbers of the vehicle's effects
    stiffness, damping : spring and damper constants of the axle [N/m, N s/m]
    travel, rate : extension of the strut and its rate, rebound positive [m, m/s]
    """
    asymmetry = effects.damper_asymmetry
    c = damping * (1.0 + asymmetry) if rate > 0.0 else damping * (1.0 - asymmetry)
    force = stiffness * travel + c * rate
    if effects.coulomb_friction != 0.0:
        u = rate / COULOMB_SPEED
        force += effects.coulomb_friction * (1.0 - 2.0 / (exp(2.0 * min(max(u, -20.0), 20.0)) + 1.0))
    force += effects.progressive_rate * travel * travel * travel
    if effects.stop_stiffness != 0.0 and -travel > effects.stop_clearance:
        force += effects.stop_stiffness * (travel + effects.stop_clearance)
    return force
