"""Figures of a close-loop report, each a PNG in base64, with which an engineer checks a verdict."""

import base64
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flows.drawing import escape_formulas
from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS
from tasks.identification.decision.forms import (
    ResidualSpline,
    fit_residual_splines,
    make_form_hypotheses,
    sample_form,
)
from tasks.identification.decision.search import SearchState
from tasks.identification.decision.verdict import Trace
from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.forward import RunModel, predict_channels, simulate_run
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.vehicle.effects.ports import PORT_UNITS, VARIABLE_UNITS, format_unit
from tasks.vehicle.effects.table import EFFECT_TABLE

FROZEN, AFTER, MEASURED = "#c0392b", "#1f6fb2", "#222222"
SHOWN = ("speed", "longitudinal_acceleration", "pitch")
MEAN_OVER = 20
"""Samples averaged into one point of the residual force, so that its noise is below the effects in question."""


def render_figure(figure: Figure) -> str:
    """Return a figure as base64 PNG, without a date in it."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=110, bbox_inches="tight", metadata={"Software": None})
    return base64.b64encode(buffer.getvalue()).decode()


def residual_force(trace: Trace) -> str:
    """Draw the residual longitudinal force of the training runs over a state, frozen and after, coloured by run."""
    variable = _state_to_show(trace)
    figure = Figure(figsize=(10, 3.6))
    axes = figure.subplots(1, 2, sharey=True)
    colours = matplotlib.colormaps["turbo"](np.linspace(0.05, 0.95, len(trace.start.evidence.train)))
    for axis, state, title in zip(axes, (trace.start, trace.end), ("frozen", "after"), strict=True):
        grown = state is trace.end and trace.end is not trace.start
        for run, colour in zip(state.evidence.train, colours, strict=True):
            x, force = _force_points(run.model, state, variable, grown)
            axis.plot(x, force, ".", ms=2.5, color=colour, label=escape_formulas(run.model.run.name))
        axis.axhline(0.0, color="#888888", lw=0.8)
        axis.set_title(title)
        axis.set_xlabel(f"{variable} [{format_unit(VARIABLE_UNITS[variable])}]")
    axes[0].set_ylabel("measured - model [N]")
    axes[1].legend(fontsize=6, ncol=2, loc="center left", bbox_to_anchor=(1.0, 0.5), markerscale=3)
    return render_figure(figure)


def _state_to_show(trace: Trace) -> str:
    known = ("speed", "pressure", "disc_temperature", "deceleration")
    named = [e.variable for e in trace.verdict.effects if e.variable in known]
    return named[0] if named else "speed"


def _force_points(
    model: RunModel, state: SearchState, variable: str, grown: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    theta, slots = (
        compose_parameters(state.base.parts, state.base.values, state.base.session)
        if grown
        else (np.zeros(len(EFFECT_TABLE)), ())
    )
    channel = CHANNELS.index("longitudinal_acceleration")
    y = predict_channels(model, theta, slots=slots)
    left = (model.measured - y)[:, channel]
    if not model.measured[:, channel].any():  # no accelerometer
        left = np.gradient((model.measured - y)[:, CHANNELS.index("speed")], model.run.interval)
    force = model.vehicle.mass * left
    x = {
        "speed": y[:, 0],
        "pressure": model.run.pressure[: model.samples],
        "disc_temperature": simulate_run(model, theta, slots=slots).column("disc_rise_f"),
        "deceleration": -y[:, channel],
    }[variable]
    count = model.samples // MEAN_OVER
    return tuple(v[: count * MEAN_OVER].reshape(count, MEAN_OVER).mean(axis=1) for v in (x, force))


def draw_residual_spline(trace: Trace) -> str:
    """Draw the spline of the frozen model's residual at the port of the named effect, with its band and best form."""
    found = fit_residual_splines(trace.start.evidence, trace.start.base)
    ports = [effect.port for effect in trace.verdict.effects]
    left = next((x for x in found if x.port in ports), found[0])
    figure = Figure(figsize=(5.2, 3.4))
    axis = figure.subplots()
    band = 1.96 * np.sqrt(np.maximum(np.diag(left.covariance), 0.0))
    axis.fill_between(left.grid, left.values - band, left.values + band, color="#c9dff2", label="95 % band")
    axis.plot(left.grid, left.values, "o-", color=AFTER, label="spline")
    form = make_form_hypotheses(left, trace.start.evidence.samples, count=1)[0]
    x, y = sample_form(form)
    axis.plot(x, y, "--", color=FROZEN, label=form.name.partition(", x")[0])
    axis.axhline(0.0, color="#888888", lw=0.8)
    axis.set_xlabel(f"{left.variable} [{format_unit(VARIABLE_UNITS[left.variable])}]")
    axis.set_ylabel(f"{left.port} [{PORT_UNITS[left.port]}]")
    axis.legend(fontsize=7)
    return render_figure(figure)


def draw_spline_gains(trace: Trace) -> str:
    """Draw the gain of a spline at every scanned port and variable, before and after."""
    before = fit_residual_splines(trace.start.evidence, trace.start.base)
    after = fit_residual_splines(trace.end.evidence, trace.end.base)
    keys = [(x.port, x.variable) for x in sorted(before, key=lambda x: (x.port, x.variable))]

    def gains(found: list[ResidualSpline]) -> list[float]:
        known = {(x.port, x.variable): max(x.gain, 0.1) for x in found}
        return [known[key] for key in keys]

    figure = Figure(figsize=(5.2, 3.8))
    axis = figure.subplots()
    y = np.arange(len(keys))
    axis.barh(y - 0.2, gains(before), 0.4, color=FROZEN, label="frozen")
    axis.barh(y + 0.2, gains(after), 0.4, color=AFTER, label="after")
    axis.set_yticks(y, [f"{port} ~ {variable}" for port, variable in keys], fontsize=7)
    axis.invert_yaxis()
    axis.set_xscale("log")
    axis.set_xlabel("gain of a spline / inflation")
    axis.legend(fontsize=7)
    return render_figure(figure)


def draw_correlations(trace: Trace) -> str:
    """Draw the correlation of residual and brake pressure on the held-out runs, with the band of independence."""
    items = trace.verdict.correlation
    figure = Figure(figsize=(10, 2.8))
    axes = figure.subplots(1, len(items), sharey=True)
    for axis, (channel, c) in zip(axes, items.items(), strict=True):
        axis.axhspan(-c.band, c.band, color="#dddddd", label="95 % band")
        axis.plot(c.lags, c.frozen, color=FROZEN, lw=1.0, label="frozen")
        axis.plot(c.lags, c.after, color=AFTER, lw=1.0, label="after")
        axis.set_title(channel.replace("_", " "))
        axis.set_xlabel("lag [s]")
    axes[0].set_ylabel("correlation [1]")
    axes[0].legend(fontsize=7)
    return render_figure(figure)


def draw_session_pulls(trace: Trace) -> str:
    """Draw the pulls of the session's nuisances, before and after."""
    items = trace.verdict.session_pulls
    figure = Figure(figsize=(5.2, 2.6))
    axis = figure.subplots()
    y = np.arange(len(items))
    axis.barh(y - 0.2, [before for before, _ in items.values()], 0.4, color=FROZEN, label="before")
    axis.barh(y + 0.2, [after for _, after in items.values()], 0.4, color=AFTER, label="after")
    axis.set_yticks(y, list(items), fontsize=8)
    axis.invert_yaxis()
    for limit in (-4.0, 4.0):
        axis.axvline(limit, color="#888888", lw=0.8, ls=":")
    axis.set_xlabel("pull [prior sigma]; beyond 4 a number of the vehicle is wrong")
    axis.legend(fontsize=7)
    return render_figure(figure)


def draw_traces(trace: Trace) -> str:
    """Draw measured channels, frozen and after, of the held-out runs with the largest and the smallest improvement."""
    runs = trace.start.evidence.held_out
    theta, slots = compose_parameters(trace.end.base.parts, trace.end.base.values, trace.end.base.session)
    plain = np.zeros(len(EFFECT_TABLE))

    def gain(run: RunEvidence) -> float:
        sigma = run.sigma
        frozen, after = (
            np.mean(((run.model.measured - y) / sigma) ** 2)
            for y in (predict_channels(run.model, plain), predict_channels(run.model, theta, slots=slots))
        )
        return float(np.log(frozen / after))

    ranked = sorted(runs, key=gain)
    shown = [channel for channel in SHOWN if np.isfinite(runs[0].sigma[CHANNELS.index(channel)])]
    figure = Figure(figsize=(11, 6.4), layout="constrained")
    axes = figure.subplots(len(shown), 2, sharex="col", squeeze=False)
    for column, (run, title) in enumerate(((ranked[-1], "gained most"), (ranked[0], "gained least"))):
        frozen, after = predict_channels(run.model, plain), predict_channels(run.model, theta, slots=slots)
        time = np.arange(run.model.samples, dtype=np.float64) * run.model.run.interval
        for row, channel in enumerate(shown):
            c = CHANNELS.index(channel)
            _trace(axes[row, column], time, run.model.measured[:, c], frozen[:, c], after[:, c])
            axes[row, column].set_ylabel(f"{channel.replace('_', ' ')}\n[{CHANNEL_UNITS[c]}]", fontsize=8)
        axes[0, column].set_title(escape_formulas(f"{title}: {run.model.run.name} ({run.model.run.weather})"))
        axes[-1, column].set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=7)
    return render_figure(figure)


def _trace(
    axis: Axes,
    time: NDArray[np.float64],
    measured: NDArray[np.float64],
    frozen: NDArray[np.float64],
    after: NDArray[np.float64],
) -> None:
    axis.plot(time, measured, color=MEASURED, lw=0.7, alpha=0.7, label="measured")
    axis.plot(time, frozen, color=FROZEN, lw=1.1, label="frozen")
    axis.plot(time, after, color=AFTER, lw=1.1, ls="--", label="after")
