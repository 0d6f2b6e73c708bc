"""Numbers behind the figures of a joint fit: residuals over time, deceleration by pressure, numbers that are alike."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS
from tasks.identification.joint.fit import JointFit, lead_offsets
from tasks.identification.joint.numbers import SMOOTHED, JointNumber
from tasks.identification.joint.stops import Stop, predict_stop
from tasks.identification.joint.verdict import JointTrace
from tasks.identification.joint.words import SEPARATE

MODELS = ("frozen", "retuned", "after")
"""The models of which residuals are shown, in the order of ``JointTrace.predicted``."""
BINS = 14
"""Parts of the range of pressure over which a curve is drawn."""
FEWEST_SAMPLES = 5
"""Samples from which a part of the range has a median and a band."""
STANDING = 1.0
"""Speed below which a deceleration says nothing of the brake [m/s]."""
ALIKE = 0.9
"""Correlation from which two numbers stand in for each other [1]."""
DIGITS = 5


def residuals_by_run(trace: JointTrace) -> list[dict[str, Any]]:
    """Return measured less model over time for each held-out run, with the brake pressure.

    Parameters
    ----------
    trace : the verdict and what it stands on
    """
    runs = []
    for stop, predicted in zip(trace.held_out, trace.predicted, strict=True):
        count, run = stop.model.samples, stop.model.run
        left = stop.model.measured - predicted
        runs.append(
            {
                "name": run.name,
                "time_s": _plain(np.arange(count) * run.interval),
                "pressure_mpa": _plain(run.pressure[:count]),
                "channels": [
                    {"name": CHANNELS[c], "unit": plain_unit(CHANNEL_UNITS[c])}
                    | {model: _plain(left[k, :, c]) for k, model in enumerate(MODELS)}
                    for c in stop.channels.tolist()
                ],
            }
        )
    return runs


def brake_curve(trace: JointTrace) -> dict[str, list[float | None]]:
    """Return deceleration against brake pressure over the training runs: medians by pressure, and the measured band.

    Speeds of the measurement and of both models are treated alike: their decrease over a short time.

    Parameters
    ----------
    trace : the verdict and what it stands on
    """
    samples = [
        _decelerations(stop, offsets, trace.fitted)
        for stop, offsets in zip(trace.train, trace.fitted.offsets, strict=True)
    ]
    pressure, measured, frozen, fitted = np.concatenate(samples, axis=1)
    edges = np.linspace(0.0, max(float(pressure.max(initial=0.0)), 1e-9), BINS + 1)
    place = np.clip(np.digitize(pressure, edges) - 1, 0, BINS - 1)
    parts = [place == k for k in range(BINS) if np.sum(place == k) >= FEWEST_SAMPLES]
    return {
        "pressure_mpa": [_number(pressure[part].mean()) for part in parts],
        "low": [_number(np.quantile(measured[part], 0.05)) for part in parts],
        "measured": [_number(np.median(measured[part])) for part in parts],
        "high": [_number(np.quantile(measured[part], 0.95)) for part in parts],
        "frozen": [_number(np.median(frozen[part])) for part in parts],
        "fitted": [_number(np.median(fitted[part])) for part in parts],
    }


def _decelerations(stop: Stop, offsets: NDArray[np.float64], fitted: JointFit) -> NDArray[np.float64]:
    """Return pressure [MPa] and deceleration measured, of the frozen and the fitted model [m/s2], float64 [4, M]."""
    speed = CHANNELS.index("speed")
    frozen = predict_stop(stop, {}, lead_offsets(stop, {}, fitted.scales))
    speeds = np.array(
        [y[:, speed] for y in (stop.model.measured, frozen, predict_stop(stop, fitted.by_name, offsets))]
    )
    interval, count = stop.model.run.interval, stop.model.samples
    lag = min(max(round(SMOOTHED / interval), 1), count - 1)
    slower = (speeds[:, :-lag] - speeds[:, lag:]) / (lag * interval)
    pressure = np.convolve(stop.model.run.pressure[:count], np.full(lag + 1, 1.0 / (lag + 1)), "valid")
    return np.vstack((pressure, slower))[:, np.all(speeds[:, lag:] > STANDING, axis=0)]


def alike_numbers(fitted: JointFit) -> list[dict[str, Any]]:
    """Return pairs of fitted numbers that stand in for each other, the most alike first, with what tells them apart.

    Parameters
    ----------
    fitted : the fit
    """
    inverse = np.linalg.inv(fitted.information)
    sigma = np.sqrt(np.diag(inverse))
    correlation = inverse / np.outer(sigma, sigma)
    pairs = [
        {
            "names": (a.name, b.name),
            "correlation": float(correlation[i, j]),
            "separate": separating_run((a, b)),
        }
        for i, a in enumerate(fitted.numbers)
        for j, b in enumerate(fitted.numbers[:i])
        if abs(correlation[i, j]) > ALIKE
    ]
    return sorted(pairs, key=lambda pair: -abs(pair["correlation"]))


def separating_run(numbers: Sequence[JointNumber]) -> str | None:
    """Return the run that tells numbers apart; None where none is known.

    Parameters
    ----------
    numbers : that these runs cannot tell apart
    """
    return next((SEPARATE[number.group] for number in numbers if number.group in SEPARATE), None)


def plain_unit(unit: str) -> str:
    """Return a unit as a reader knows it.

    Parameters
    ----------
    unit : of the tables
    """
    return unit.replace("^2", "²").replace("-1", "⁻¹")


def _plain(values: NDArray[np.floating[Any]]) -> list[float | None]:
    return [_number(value) for value in values]


def _number(value: float) -> float | None:
    """Return a number with the digits that a screen can show; JSON has no infinity."""
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
