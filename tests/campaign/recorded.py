"""A braking car as a logger would write it, whole or with one thing wrong."""

import numpy as np
from numpy.typing import NDArray

RATE = 100.0


def braking_columns(seconds: float = 4.0, rate: float = RATE) -> dict[str, NDArray[np.float64]]:
    """Channels in campaign units: rolling, braked at 1.5 s to 3 m/s^2, with a little sensor noise."""
    rng = np.random.default_rng(7)
    t = np.arange(round(seconds * rate) + 1) / rate
    pressure = 2.0 * np.clip((t - 1.5) / 0.3, 0.0, 1.0)
    acceleration = -1.5 * pressure
    speed = 20.0 + np.cumsum(acceleration) / rate
    pitch = 0.5 * np.convolve(np.pad(pressure, (20, 0), mode="edge"), np.ones(21) / 21, mode="valid")
    clean = {
        "brake_pressure": pressure, "speed": speed, "longitudinal_acceleration": acceleration,
        "wheel_speed_front": speed / 0.32, "wheel_speed_rear": speed / 0.32, "pitch": pitch,
        "pitch_rate": np.gradient(pitch, t), "vertical_acceleration": np.zeros(len(t)),
    }  # fmt: skip
    noisy = {name: values + 0.01 * rng.standard_normal(len(t)) for name, values in clean.items()}
    return {"time": t, **noisy}


MAP = """
campaign: toy
vehicle: paper-reference
source: made up
sample_rate_hz: 100
time: {source: t_ms, unit: ms}
channels:
  brake_pressure: {source: p_bar, unit: bar}
  speed: {source: v_kmh, unit: km/h}
  longitudinal_acceleration: {source: ax_g, unit: g}
  wheel_speed_front: {source: [w_fl, w_fr], unit: rpm}
  wheel_speed_rear: {source: w_r, unit: rad/s}
  pitch: {source: pitch_up, unit: rad, sign: -1}
  pitch_rate: {source: pitch_rate_up, unit: rad/s, sign: -1, delay_s: 0.05}
  vertical_acceleration: {source: az, unit: m/s^2, offset: -9.81}
tolerances_1sigma:
  pressure_gain: 0.02
  mass: 0.01
  pitch_gain: 0.02
  wheel_radius: 0.005
  suspension_damping: 0.04
  suspension_stiffness: 0.02
  grade: 0.0015
  run: {initial_speed_m_s: 0.05, friction: 0.03, acceleration_bias_m_s2: 0.03, pitch_offset_deg: 0.03}
"""


def log_signal(columns: dict[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """The same motion in the units, directions and names of the map's logger."""
    late = np.interp(columns["time"] - 0.05, columns["time"], columns["pitch_rate"])
    front = columns["wheel_speed_front"] * 30 / np.pi
    return {
        "t_ms": columns["time"] * 1e3, "p_bar": columns["brake_pressure"] * 10, "v_kmh": columns["speed"] * 3.6,
        "ax_g": columns["longitudinal_acceleration"] / 9.80665, "w_fl": front - 3.0, "w_fr": front + 3.0,
        "w_r": columns["wheel_speed_rear"], "pitch_up": -np.radians(columns["pitch"]),
        "pitch_rate_up": -np.radians(late), "az": columns["vertical_acceleration"] + 9.81,
    }  # fmt: skip


def write_digits(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """The time since midnight as HHMMSS.ss."""
    seconds = np.round(seconds, 2) % 86400.0
    return np.round(seconds // 3600 * 1e4 + seconds // 60 % 60 * 1e2 + seconds % 60, 2)
