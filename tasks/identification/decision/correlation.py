"""Cross-correlation of a model's residual with its input, the brake pressure.

If a model describes all that the input causes, its residual is uncorrelated with the input at every lag (Ljung 1999,
System Identification, section 16.6).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.inference.forward import RunModel, predict_channels
from tasks.identification.inference.noise import whiten_channels
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.vehicle.effects.slots import Slot

CORRELATED = ("longitudinal_acceleration", "pitch")


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Residual of one channel against brake pressure.

    Parameters
    ----------
    lags : float64 [L] time by which the residual follows the pressure [s]
    frozen, after : float64 [L] correlation coefficients [1]
    band : half width of the interval that holds 95 % of the coefficients of independent series [1]
    """

    lags: NDArray[np.float64]
    frozen: NDArray[np.float64]
    after: NDArray[np.float64]
    band: float


def correlate_residual_with_pressure(
    runs: tuple[RunModel, ...],
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    theta: NDArray[np.float64],
    slots: tuple[Slot, ...],
    longest_lag: float,
) -> dict[str, Correlation]:
    """Return the correlations over the held-out runs; the channel's noise whitens residual and pressure.

    Parameters
    ----------
    runs : held-out runs
    sensors : AR(1) coefficient and standard deviation of every channel's sensor, float64 [7] each
    theta, slots : full parameter vector and slots of the grown model
    longest_lag : longest lag [s]
    """
    plain = np.zeros(len(theta))
    residuals = [
        [(run.measured - predict_channels(run, p, slots=s)) for run in runs]
        for p, s in ((plain, ()), (theta, slots))
    ]
    measured = [name for name in CORRELATED if np.isfinite(sensors[1][CHANNELS.index(name)])]
    return {
        name: _correlate_channel(runs, sensors, residuals, CHANNELS.index(name), longest_lag)
        for name in measured or ["speed"]
    }


def _correlate_channel(
    runs: tuple[RunModel, ...],
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    residuals: list[list[NDArray[np.float64]]],
    channel: int,
    longest_lag: float,
) -> Correlation:
    """Return the correlation of one channel's residual with pressure over all runs."""
    interval = runs[0].run.interval
    most = round(longest_lag / interval)
    sums = np.zeros((2, 2 * most + 1))
    powers, pressed, count = np.zeros(2), 0.0, 0
    rho, sigma = (values[channel : channel + 1] for values in sensors)
    for i, run in enumerate(runs):
        u = _whiten_channel(run.pressure[:, None], rho, sigma)
        own = None if run.sampled is None else run.sampled[:, channel : channel + 1]
        pressed += float(u @ u)
        count += len(u)
        for j in range(2):
            e = _whiten_channel(residuals[j][i][:, channel : channel + 1], rho, sigma, own)
            powers[j] += float(e @ e)
            sums[j] += np.correlate(np.pad(e, most), u, mode="valid")
    scale = np.sqrt(np.maximum(powers * pressed, 1e-300))[:, None]
    frozen, after = sums / scale
    return Correlation(
        lags=interval * np.arange(-most, most + 1, dtype=np.float64),
        frozen=frozen,
        after=after,
        band=float(NORMAL_QUANTILE / np.sqrt(max(count, 1))),
    )


def _whiten_channel(
    x: NDArray[np.float64],
    rho: NDArray[np.float64],
    sigma: NDArray[np.float64],
    sampled: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Return one channel of shape [N, 1], whitened and without its mean, float64 [N - 1]."""
    white = whiten_channels(x, rho, sigma, sampled)[1:]
    return np.asarray(white - white.mean(), dtype=np.float64)
