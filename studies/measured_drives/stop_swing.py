"""After the wheels have stopped, the body still swings on tyres and axles: a damped oscillator."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

STANDING = 0.05
"""Speed at which the wheels stand, the paper's stopping threshold [m/s]."""
BEFORE_S = 0.05
"""Mean over this time before the stop is the deceleration that the swing starts from."""


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Longitudinal compliance between the body and wheels that stand.

    Parameters
    ----------
    frequency : undamped [Hz]
    damping_ratio : below 1 [1]
    """

    frequency: float
    damping_ratio: float


def swing_acceleration(time: NDArray[np.float64], deceleration: float, swing: Swing) -> NDArray[np.float64]:
    """Acceleration of the body after the stop.

    While braking the compliance is deflected by what decelerates the body; as the wheels stand still, that
    deflection swings out: ``a'' + 2 zeta omega a' + omega^2 a = 0`` with ``a(0) = -d`` and no relative speed.

    Parameters
    ----------
    time : since the stop, float64 [N] [s]
    deceleration : d, just before the stop [m/s^2]
    swing : the compliance

    Returns
    -------
    float64 [N] [m/s^2]
    """
    omega, zeta = 2.0 * pi * swing.frequency, swing.damping_ratio
    root = sqrt(1.0 - zeta * zeta)
    phase = omega * root * time
    decay = np.exp(-zeta * omega * time)
    return deceleration * decay * (zeta / root * np.sin(phase) - np.cos(phase))


def with_swing(
    acceleration: NDArray[np.float64], speed: NDArray[np.float64], interval: float, swing: Swing
) -> NDArray[np.float64]:
    """A stop's acceleration with the swing in the place of standstill; unchanged where it never stops.

    Parameters
    ----------
    acceleration, speed : float64 [N] [m/s^2], [m/s]
    interval : [s]
    swing : the compliance
    """
    start = _standing(speed)
    if start is None:
        return acceleration
    before = max(start - round(BEFORE_S / interval), 0)
    deceleration = -float(np.mean(acceleration[before:start]))
    result = acceleration.copy()
    since = np.arange(len(result) - start, dtype=np.float64) * interval
    result[start:] = swing_acceleration(since.astype(np.float64), deceleration, swing)
    return result


def fit_swing(
    acceleration: NDArray[np.float64], speed: NDArray[np.float64], interval: float, seconds: float
) -> Swing:
    """Frequency and damping of the swing after one measured stop.

    Parameters
    ----------
    acceleration, speed : measured, float64 [N]; the speed reaches standstill [m/s^2], [m/s]
    interval : [s]
    seconds : of the record after the stop that are used [s]
    """
    start = _standing(speed) or 0
    used = slice(start, start + round(seconds / interval))

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        swing = Swing(frequency=float(np.exp(x[0])), damping_ratio=float(x[1]))
        return (with_swing(acceleration, speed, interval, swing) - acceleration)[used]

    found = least_squares(
        residual, (np.log(3.0), 0.2), bounds=((np.log(0.5), 0.01), (np.log(15.0), 0.95)), diff_step=1e-3
    )
    return Swing(frequency=float(np.exp(found.x[0])), damping_ratio=float(found.x[1]))


def _standing(speed: NDArray[np.float64]) -> int | None:
    standing = speed <= STANDING
    start = int(np.argmax(standing))
    return start if standing.any() and start > 0 else None
