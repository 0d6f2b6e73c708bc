"""Residuals of every run and channel, frozen and after: as RMSE and over time."""

from collections.abc import Iterator

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flows.drawing import escape_formulas
from flows.measured.closing_figures import render_figure
from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS
from tasks.identification.decision.verdict import Trace
from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.vehicle.effects.table import EFFECT_TABLE

TITLES = ("frozen", "after")


def compute_run_residuals(
    trace: Trace, runs: tuple[RunEvidence, ...]
) -> Iterator[tuple[RunEvidence, tuple[NDArray[np.float64], ...]]]:
    """Measured less model of each run, frozen and after; each float64 [samples, 7] [unit of the channel].

    Parameters
    ----------
    trace : the verdict and what it stands on
    runs : of its evidence
    """
    models = (
        (np.zeros(len(EFFECT_TABLE)), ()),
        compose_parameters(trace.end.base.parts, trace.end.base.values, trace.end.base.session),
    )
    for run in runs:
        yield (
            run,
            tuple(
                run.model.measured - predict_channels(run.model, theta, slots=slots)
                for theta, slots in models
            ),
        )


def residual_rmse(trace: Trace) -> dict[str, dict[str, dict[str, float]]]:
    """RMSE by run, channel and state of the model (`TITLES`) [unit of the channel].

    Parameters
    ----------
    trace : the verdict and what it stands on
    """
    evidence = trace.start.evidence
    return {
        run.model.run.name: {
            channel: {
                title: float(np.sqrt(np.mean(left[:, c] ** 2)))
                for title, left in zip(TITLES, both, strict=True)
            }
            for c, channel in enumerate(CHANNELS)
            if np.isfinite(run.sigma[c])
        }
        for run, both in compute_run_residuals(trace, (*evidence.train, *evidence.held_out))
    }


def residuals_over_time(trace: Trace) -> str:
    """Residual of every channel over time, frozen and after, coloured by training run; base64 PNG.

    Parameters
    ----------
    trace : the verdict and what it stands on
    """
    runs = trace.start.evidence.train
    colours = colormaps["turbo"](np.linspace(0.05, 0.95, len(runs)))
    figure = Figure(figsize=(11, 11), layout="constrained")
    seen = np.flatnonzero(np.isfinite(runs[0].sigma))
    axes = figure.subplots(len(seen), 2, sharex=True, sharey="row", squeeze=False)
    for (run, both), colour in zip(compute_run_residuals(trace, runs), colours, strict=True):
        time = np.arange(run.model.samples) * run.model.run.interval
        for column, left in enumerate(both):
            for row, c in enumerate(seen):
                axes[row, column].plot(
                    time, left[:, c], lw=0.6, color=colour, label=escape_formulas(run.model.run.name)
                )
    for row, c in enumerate(seen):
        axes[row, 0].set_ylabel(f"{CHANNELS[c].replace('_', ' ')}\n[{CHANNEL_UNITS[c]}]", fontsize=7)
        for axis in axes[row]:
            axis.axhline(0.0, color="#888888", lw=0.8)
    for axis, title in zip(axes[0], TITLES, strict=True):
        axis.set_title(title)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.legend(*axes[0, 1].get_legend_handles_labels(), fontsize=6, loc="outside right upper")
    return render_figure(figure)
