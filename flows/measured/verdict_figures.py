"""The figures of a verdict: curves over time, deceleration by pressure, splines, correlations."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.measured.residuals import RunPrediction
from flows.pages.figures import Figure, Line, Panel, Style, Values
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
POINTS = 1000
"""Points of a curve that a figure of a run can show."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
STYLES = {"frozen": Style("b", "dotted"), "after": Style("a")}
"""Of the vehicle file's model, and of the one with what was found."""


def draw_run(run: RunPrediction, noise: Mapping[str, Any], left: Mapping[str, Any]) -> Figure:
    """Draw what was measured and predicted over time, beside it what is left, and the brake pressure.

    Parameters
    ----------
    run : measured run with its predictions
    noise : of each channel ``sigma`` [unit of the channel]
    left : RMSE of each channel, ``frozen`` and ``after`` [unit of the channel]
    """
    thin = slice(None, None, max(run.model.samples // POINTS, 1))
    time = (np.arange(run.model.samples) * run.model.run.interval)[thin]
    panels, summary = [], []
    for c in run.channels:
        name, unit = CHANNELS[c], format_plain_unit(CHANNEL_UNITS[c])
        reach = NORMAL_QUANTILE * noise[name]["sigma"]
        measured = run.model.measured[thin, c]
        predicted = {model: values[thin, c] for model, values in run.predicted.items()}
        after = predicted["after"]
        summary.append(
            f"{_as_words(name)} {left[name]['frozen']:.3g} → {left[name]['after']:.3g} {unit}".rstrip()
        )
        panels.append(Panel(title=_as_words(name), y=unit, lines=[
            Line(name="noise, 95 %", x=time, y=np.full(len(time), np.nan), low=after - reach, high=after + reach,
                 style=Style("soft")),
            *(Line(name=model, x=time, y=values, style=STYLES[model]) for model, values in predicted.items()),
            Line(name="measured", x=time, y=measured),
        ]))  # fmt: skip
        panels.append(Panel(title=f"{_as_words(name)}, measured less model", y=unit, lines=[
            _draw_limits("noise, 95 %", time[[0, -1]], reach),
            *(Line(name=model, x=time, y=measured - y, style=STYLES[model]) for model, y in predicted.items()),
        ]))  # fmt: skip
    panels.append(
        Panel(title="brake pressure", y="MPa", lines=[Line(name="", x=time, y=run.model.pressure[thin])])
    )
    return Figure(
        caption=f"{run.model.run.name}: error frozen → after: {'; '.join(summary)}",
        description=f"Measured, frozen and after over time of {run.model.run.name}, and what each leaves:"
        f" {'; '.join(summary)}; below them the brake pressure",
        panels=panels,
        columns=2,
        linked=True,
        panel_px=210,
    )  # fmt: skip


def draw_brake_curve(runs: Sequence[RunPrediction]) -> Figure:
    """Draw deceleration against brake pressure.

    Parameters
    ----------
    runs : training runs with their predictions
    """
    curve = make_brake_curve(runs)
    x = curve["pressure_mpa"]
    lines = [
        Line(name="measured", x=x, y=curve["measured"], low=curve["low"], high=curve["high"], marked=True),
        Line(name="frozen", x=x, y=curve["frozen"], marked=True, style=STYLES["frozen"]),
        Line(name="after", x=x, y=curve["fitted"], marked=True, style=STYLES["after"]),
    ]
    at = (
        f": at {x[-1]:.3g} MPa measured {curve['measured'][-1]:.3g}, frozen {curve['frozen'][-1]:.3g}, after"
        f" {curve['fitted'][-1]:.3g} m/s²"
        if len(x)
        else ""
    )
    return Figure(
        caption=f"Deceleration and brake pressure, each over {SMOOTHED:g} s",
        description=f"Deceleration against brake pressure{at}",
        panels=[Panel(x="brake pressure [MPa]", y="deceleration [m/s²]", lines=lines)],
        panel_px=340,
    )


def make_brake_curve(runs: Sequence[RunPrediction]) -> dict[str, NDArray[np.float64]]:
    """Return deceleration against brake pressure over runs: medians by pressure, and the measured band.

    Speeds of the measurement and of both models are treated alike: their decrease over a short time.

    Parameters
    ----------
    runs : training runs with their predictions
    """
    pressure, measured, frozen, fitted = np.concatenate([_compute_decelerations(run) for run in runs], axis=1)
    edges = np.linspace(0.0, max(float(pressure.max(initial=0.0)), 1e-9), BINS + 1)
    bins = np.clip(np.digitize(pressure, edges) - 1, 0, BINS - 1)
    parts = [bins == k for k in range(BINS) if np.sum(bins == k) >= FEWEST_SAMPLES]
    return {
        name: np.array([statistic(values[part]) for part in parts])
        for name, values, statistic in (
            ("pressure_mpa", pressure, np.mean),
            ("low", measured, lambda y: np.quantile(y, 0.05)),
            ("measured", measured, np.median),
            ("high", measured, lambda y: np.quantile(y, 0.95)),
            ("frozen", frozen, np.median),
            ("fitted", fitted, np.median),
        )
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


def draw_splines(outcome: Outcome) -> tuple[list[dict[str, Any]], Figure]:
    """Return where the residual of the training runs lies: a row of gains for each spline, and one spline drawn.

    Parameters
    ----------
    outcome : the verdict and what it stands on
    """
    grams, named_members = outcome.finding.grams, outcome.opened[0].named
    grids = find_scanned_ranges(outcome.finding.evidence.train)
    rows = []
    for form in (c for c in grams.columns.candidates if c.effect is None):
        rest = [m for m in named_members if m.effect is not None]
        alone, named, both = (
            weigh_explanation(grams, m, spread=False) for m in ([form], rest, [*rest, form])
        )
        if alone is not None and named is not None and both is not None:
            rows.append((form, alone, both, both.gain - named.gain))
    rows.sort(key=lambda row: -row[1].gain)
    ports = [effect.port for effect in outcome.verdict.effects]
    form, alone, both, _ = next((row for row in rows if row[0].port in ports), rows[0])
    gains = [
        {"spline": _as_words(f"{f.port} over {f.variable}"), "gain, frozen": float(before.gain),
         "gain, after": float(left)}
        for f, before, _, left in rows
    ]  # fmt: skip
    x = np.linspace(*grids[form.variable], KNOTS)
    lines = [_draw_band(name, x, fit, form) for name, fit in (("frozen", alone), ("after", both))]
    port = _label(form.port, PORT_UNITS[form.port])
    panel = Panel(
        x=_label(form.variable, format_unit(VARIABLE_UNITS[form.variable])), y=_as_words(port), lines=lines
    )
    at = ", ".join(f"{line.name} {np.asarray(line.y)[-1]:.3g}" for line in lines)
    figure = Figure(
        caption="The spline at the named port, else the one that gains most, with the band that holds 95 %",
        description=f"Spline of the residual: {panel.y} over {panel.x}, at {x[-1]:.3g} {at}",
        panels=[panel],
        panel_px=300,
    )
    return gains, figure


def draw_correlation(correlation: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw the correlation of the held-out residual with the brake pressure over the delay.

    Parameters
    ----------
    correlation : by channel, as of a verdict's ``residual_input_correlation``
    """
    panels, summary = [], []
    for channel, c in correlation.items():
        ends = [c["lag_s"][0], c["lag_s"][-1]]
        panels.append(Panel(title=_as_words(channel), x="residual after pressure [s]", y="correlation", lines=[
            _draw_limits("independent, 95 %", ends, c["band"]),
            *(Line(name=model, x=c["lag_s"], y=c[model], style=style) for model, style in STYLES.items()),
        ]))  # fmt: skip
        most = ", ".join(f"{max(map(abs, c[model])):.3g} {model}" for model in STYLES)
        summary.append(f"{_as_words(channel)} at most {most}, band {c['band']:.3g}")
    return Figure(
        caption="Correlation over the delay of the residual",
        description=f"Correlation with brake pressure: {'; '.join(summary)}",
        panels=panels,
        columns=2,
    )


def _draw_limits(name: str, ends: Values, reach: float) -> Line:
    """Return a band about 0."""
    return Line(name=name, x=ends, y=[None] * 2, low=[-reach] * 2, high=[reach] * 2, style=Style("soft"))


def _draw_band(name: str, x: NDArray[np.float64], explanation: Explanation, form: Candidate) -> Line:
    numbers = explanation.find_numbers(form)
    values, reach = explanation.values[numbers], NORMAL_QUANTILE * explanation.errors[numbers]
    return Line(
        name=name, x=x, y=values, low=values - reach, high=values + reach, marked=True, style=STYLES[name]
    )


def format_plain_unit(unit: str) -> str:
    """Return a unit as a reader knows it; a share has none.

    Parameters
    ----------
    unit : of the tables
    """
    if unit == "1":
        return ""
    return re.sub(r"(?<=[A-Za-z)])\^?(-?[0-9])", lambda found: found[1].translate(RAISED), unit)


def _label(name: str, unit: str) -> str:
    return _as_words(f"{name} [{unit}]" if unit not in ("", "1") else name)


def _as_words(name: str) -> str:
    return name.replace("_", " ")
