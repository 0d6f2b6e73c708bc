"""Numbers behind the figures of a verdict: residuals, deceleration by pressure, splines."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.measured.residuals import MODELS, RunPrediction
from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.forms import KNOTS, find_scanned_ranges
from tasks.identification.decision.odds import Explanation, weigh_explanation
from tasks.identification.decision.verdict import Outcome
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.identification.inference.tyre_limit import SMOOTHED
from tasks.vehicle.effects.ports import PORT_UNITS, VARIABLE_UNITS, format_unit

BINS = 14
"""Parts of the range of pressure over which a curve is drawn."""
FEWEST_SAMPLES = 5
"""Samples from which a part of the range has a median and a band."""
STANDING = 1.0
"""Speed below which a deceleration says nothing of the brake [m/s]."""
DIGITS = 5
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LEAST_GAIN = 0.1
"""Gain of a spline that is drawn, where the axis is logarithmic [1]."""


def make_residual_figures(runs: Sequence[RunPrediction]) -> list[dict[str, Any]]:
    """Return measured less model over time for each run, with the brake pressure.

    Parameters
    ----------
    runs : measured runs with their predictions
    """
    return [
        {
            "name": run.model.run.name,
            "time_s": _plain(np.arange(run.model.samples) * run.model.run.interval),
            "pressure_mpa": _plain(run.model.pressure),
            "models": [name for name in MODELS if name in run.predicted],
            "channels": [
                {"name": CHANNELS[c], "unit": format_plain_unit(CHANNEL_UNITS[c])}
                | {name: _plain((run.model.measured - y)[:, c]) for name, y in run.predicted.items()}
                for c in run.channels
            ],
        }
        for run in runs
    ]


def make_brake_curve(runs: Sequence[RunPrediction]) -> dict[str, list[float | None]]:
    """Return deceleration against brake pressure over runs: medians by pressure, and the measured band.

    Speeds of the measurement and of both models are treated alike: their decrease over a short time.

    Parameters
    ----------
    runs : training runs with their predictions
    """
    pressure, measured, frozen, fitted = np.concatenate([_compute_decelerations(run) for run in runs], axis=1)
    edges = np.linspace(0.0, max(float(pressure.max(initial=0.0)), 1e-9), BINS + 1)
    place = np.clip(np.digitize(pressure, edges) - 1, 0, BINS - 1)
    parts = [place == k for k in range(BINS) if np.sum(place == k) >= FEWEST_SAMPLES]
    return {
        "pressure_mpa": [_shorten(pressure[part].mean()) for part in parts],
        "low": [_shorten(np.quantile(measured[part], 0.05)) for part in parts],
        "measured": [_shorten(np.median(measured[part])) for part in parts],
        "high": [_shorten(np.quantile(measured[part], 0.95)) for part in parts],
        "frozen": [_shorten(np.median(frozen[part])) for part in parts],
        "fitted": [_shorten(np.median(fitted[part])) for part in parts],
    }


def _compute_decelerations(run: RunPrediction) -> NDArray[np.float64]:
    """Return pressure [MPa] and deceleration measured, of the frozen and the fitted model [m/s2], float64 [4, M]."""
    speed, model = CHANNELS.index("speed"), run.model
    readings = (model.measured, run.predicted["frozen"], run.predicted["after"])
    speeds = np.array([y[:, speed] for y in readings])
    interval, count = model.run.interval, model.samples
    lag = min(max(round(SMOOTHED / interval), 1), count - 1)
    slower = (speeds[:, :-lag] - speeds[:, lag:]) / (lag * interval)
    pressure = np.convolve(model.run.pressure[:count], np.full(lag + 1, 1.0 / (lag + 1)), "valid")
    return np.vstack((pressure, slower))[:, np.all(speeds[:, lag:] > STANDING, axis=0)]


def make_spline_figures(outcome: Outcome) -> dict[str, Any]:
    """Return where the residual of the training runs lies: gains of splines, and the spline at the named port.

    Parameters
    ----------
    outcome : the verdict and what it stands on
    """
    grams, told = outcome.finding.grams, outcome.opened[0].told
    grids = find_scanned_ranges(outcome.finding.evidence.train)
    rows = []
    for form in (c for c in grams.columns.candidates if c.effect is None):
        rest = [m for m in told if m.effect is not None]
        alone, named, both = (
            weigh_explanation(grams, m, spread=False) for m in ([form], rest, [*rest, form])
        )
        if alone is not None and named is not None and both is not None:
            rows.append((form, alone, both, both.gain - named.gain))
    rows.sort(key=lambda row: -row[1].gain)
    ports = [effect.port for effect in outcome.verdict.effects]
    form, alone, both, _ = next((row for row in rows if row[0].port in ports), rows[0])
    return {
        "gains": [
            {
                "name": f"{f.port} over {f.variable}".replace("_", " "),
                "frozen": _shorten(max(before.gain, LEAST_GAIN)),
                "after": _shorten(max(left, LEAST_GAIN)),
            }
            for f, before, _, left in rows
        ],
        "spline": {
            "x_name": f"{form.variable} [{format_unit(VARIABLE_UNITS[form.variable])}]".replace("_", " "),
            "y_name": f"{form.port} [{PORT_UNITS[form.port]}]".replace("_", " "),
            "x": _plain(np.linspace(*grids[form.variable], KNOTS)),
            "frozen": _make_band(alone, form),
            "after": _make_band(both, form),
        },
    }


def _make_band(explanation: Explanation, form: Candidate) -> dict[str, list[float | None]]:
    places = explanation.find_places(form)
    values, reach = explanation.values[places], NORMAL_QUANTILE * explanation.errors[places]
    return {"values": _plain(values), "low": _plain(values - reach), "high": _plain(values + reach)}


def format_plain_unit(unit: str) -> str:
    """Return a unit as a reader knows it.

    Parameters
    ----------
    unit : of the tables
    """
    return re.sub(r"(?<=[A-Za-z)])\^?(-?[0-9])", lambda found: found[1].translate(RAISED), unit)


def _plain(values: NDArray[np.floating[Any]]) -> list[float | None]:
    return [_shorten(value) for value in values]


def _shorten(value: float) -> float | None:
    """Return a number with the digits that a screen can show; JSON has no infinity."""
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
