"""Ports where a form can enter the equations of motion, and variables that it can depend on, with their units."""

PORTS = ("longitudinal_force", "brake_torque", "friction", "pitch_moment", "suspension_force")
PORT_UNITS = ("N", "1", "1", "N m", "N")
VARIABLES = (
    "time", "speed", "pressure", "disc_temperature", "pressure_rate", "load_ratio",
    "suspension_travel", "suspension_speed", "deceleration",
)  # fmt: skip
VARIABLE_UNITS = ("s", "m/s", "MPa", "K", "MPa/s", "1", "m", "m/s", "m/s^2")
