"""Figures for documents: the same SVG for the same figure, text that is nothing but text."""

from io import StringIO

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from flows.pages.figures import Figure, Panel, read_colours

WIDTH, HEIGHT = (11.0, 5.4), 2.6
"""Of a figure of several panels a row and of one, and of a row [in]."""


def as_svg(figure: Figure) -> str:
    """Return the figure's ``<svg>`` element in the light colours, without a date and with fixed ids.

    Parameters
    ----------
    figure : to draw
    """
    columns = min(figure.columns, len(figure.panels))
    rows = -(-len(figure.panels) // columns)
    drawing = Drawing(figsize=(WIDTH[columns == 1], HEIGHT * rows + 0.4), layout="constrained")
    axes = drawing.subplots(rows, columns, squeeze=False, sharex=figure.linked).ravel()
    colours = read_colours()
    for axis, panel in zip(axes, figure.panels, strict=False):
        _draw_panel(axis, panel, colours)
    for axis in axes[len(figure.panels) :]:
        axis.set_axis_off()
    shown = {
        label: line for axis in axes for line, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    names = {_as_text(line.name): None for line in figure.key}
    if len(names) > 1:
        lines = [shown[name] for name in names]
        drawing.legend(lines, list(names), fontsize=8, ncols=5, loc="outside lower center", frameon=False)
    buffer = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "musync", "svg.fonttype": "none"}):
        drawing.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def _draw_panel(axis: Axes, panel: Panel, colours: dict[str, str]) -> None:
    for start, end in panel.shaded:
        axis.axvspan(start, end, color=colours["soft"], alpha=0.15, lw=0)
    for line in panel.lines:
        colour = colours[line.style.colour]
        x = np.asarray(line.x, float)
        if line.low is not None and line.high is not None:
            low, high = (np.asarray(edge, float) for edge in (line.low, line.high))
            axis.fill_between(x, low, high, color=colour, alpha=0.2, lw=0)
        axis.plot(
            x, np.asarray(line.y, float), color=colour, lw=1.3, label=_as_text(line.name) or "_",
            ls="" if line.marked is None else line.style.dash,
            marker="" if line.marked is False else ("x" if line.marked is None else "o"), ms=4,
        )  # fmt: skip
    axis.set_title(_as_text(panel.title), fontsize=9, loc="left")
    axis.set_xlabel(_as_text(panel.x), fontsize=8)
    axis.set_ylabel(_as_text(panel.y), fontsize=8)
    axis.tick_params(labelsize=8)
    axis.spines[["top", "right"]].set_visible(False)
    if (found := panel.find_range()) is not None:
        axis.set_ylim(*found)


def _as_text(text: str) -> str:
    """Return text in which no dollar sign starts a formula."""
    return text.replace("$", r"\$")
