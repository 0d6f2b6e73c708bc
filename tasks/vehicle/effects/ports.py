"""Ports where a form can enter the equations of motion, and variables that it can depend on, with their units."""

PORT_UNITS = {
    "longitudinal_force": "N",
    "brake_torque": "1",
    "friction": "1",
    "pitch_moment": "N m",
    "suspension_force": "N",
}
"""Unit of each port."""
PORTS = tuple(PORT_UNITS)
VARIABLE_UNITS = {
    "time": "s",
    "speed": "m s-1",
    "pressure": "MPa",
    "disc_temperature": "K",
    "pressure_rate": "MPa s-1",
    "load_ratio": "1",
    "suspension_travel": "m",
    "suspension_speed": "m s-1",
    "deceleration": "m s-2",
}
"""Unit of each variable, as catalogue files write it."""
VARIABLES = tuple(VARIABLE_UNITS)
AXLE_VARIABLES = ("disc_temperature", "load_ratio", "suspension_travel", "suspension_speed")
"""Variables of which each axle has its own value; all others are the vehicle's."""


def format_unit(unit: str) -> str:
    """Return a unit of these tables with a slash: m s-2 becomes m/s^2.

    Parameters
    ----------
    unit : unit, as catalogue files write it
    """
    return unit.replace(" s-1", "/s").replace(" s-2", "/s^2")
