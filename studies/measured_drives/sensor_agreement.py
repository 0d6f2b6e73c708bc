"""Agreement between the channels of a recording: two sensors of one motion, gravity on a slope."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SMOOTHING_S = 0.5
EDGE_S = 2.0
"""Time left out at both ends, where smoothing lacks samples [s]."""
SHORTEST_S = 2.0
"""Time that must be left between them [s]."""


@dataclass(frozen=True, kw_only=True)
class SensorAgreement:
    """Agreement of channels of one run.

    Parameters
    ----------
    rate_of_pitch_gain : slope of the pitch angle per measured pitch rate; 1 is agreement [1]
    rate_of_pitch_correlation : of the two [1]
    gravity_on_slope : what the accelerometer reads beyond the rate of speed, per sine of nose-up pitch: g where
        the pitch is the road's slope, near 0 where it is the body's own [m/s^2]
    gravity_correlation : of the two [1]
    """

    rate_of_pitch_gain: float
    rate_of_pitch_correlation: float
    gravity_on_slope: float
    gravity_correlation: float


def measure_sensor_agreement(
    columns: Mapping[str, NDArray[np.float64]], interval: float
) -> SensorAgreement | None:
    """Fit each pair of channels over the run by a line, without its ends; None where little more than these is there.

    Parameters
    ----------
    columns : speed, longitudinal_acceleration, pitch and pitch_rate, each float64 [N] in campaign units
    interval : [s]
    """
    if len(columns["speed"]) * interval < 2.0 * EDGE_S + SHORTEST_S:
        return None
    smooth = {name: _compute_moving_mean(columns[name], interval) for name in
              ("speed", "longitudinal_acceleration", "pitch", "pitch_rate")}  # fmt: skip
    inner = slice(round(EDGE_S / interval), -round(EDGE_S / interval))
    rate = np.gradient(smooth["pitch"], interval)[inner]
    gain, correlation = _regress(smooth["pitch_rate"][inner], rate)
    beyond = (smooth["longitudinal_acceleration"] - np.gradient(smooth["speed"], interval))[inner]
    gravity, agreement = _regress(-np.sin(np.radians(smooth["pitch"][inner])), beyond)
    return SensorAgreement(
        rate_of_pitch_gain=gain,
        rate_of_pitch_correlation=correlation,
        gravity_on_slope=gravity,
        gravity_correlation=agreement,
    )


def _regress(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    return float(np.polyfit(x, y, 1)[0]), float(np.corrcoef(x, y)[0, 1])


def _compute_moving_mean(values: NDArray[np.float64], interval: float) -> NDArray[np.float64]:
    width = max(round(SMOOTHING_S / interval), 1)
    return np.convolve(values, np.ones(width) / width, mode="same")
