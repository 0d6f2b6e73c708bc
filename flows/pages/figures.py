"""Figures: panels of lines with bands, for Plotly on a page, and in `flows.pages.static` for a document."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

STYLE_SHEET = Path(__file__).with_name("page.css")
COLOURS = ("a", "b", "c", "d", "e", "f")
"""Of the style sheet, which has ``ink`` and ``soft`` too."""
DASHES = ("solid", "dash", "dot")
DIGITS = 6
"""Of a number, that a screen can show."""
GAP_PX, STACKED_GAP_PX = 66, 26
"""Between rows of panels, and between those over one horizontal axis [px]."""

Values = NDArray[np.floating[Any]] | Sequence[float] | Sequence[float | None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """A line of a panel.

    Parameters
    ----------
    name : in the key, and of all lines that are shown and hidden with it
    x, y : [N], NaN or None where there is no value
    low, high : [N] edges of a band about it; None for none
    colour : of `COLOURS`, or ``ink`` or ``soft``
    dash : of `DASHES`
    marked : whether each point has a mark; None marks the points and draws no line
    """

    name: str
    x: Values
    y: Values
    low: Values | None = None
    high: Values | None = None
    colour: str = "ink"
    dash: str = "solid"
    marked: bool | None = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """Lines over one pair of axes.

    Parameters
    ----------
    title : over it; may be empty
    x, y : names of the axes with their units
    lines : the last lies on top
    shaded : parts of the horizontal axis to mark, each from and to
    least : half of the least range of the vertical axis about 0, so that noise looks like noise; None for none
    """

    y: str
    lines: Sequence[Line]
    x: str = "time [s]"
    title: str = ""
    shaded: Sequence[tuple[float, float]] = ()
    least: float | None = None

    def find_range(self) -> tuple[float, float] | None:
        """Return the range of the vertical axis; None where it follows from the lines."""
        if self.least is None:
            return None
        values = np.concatenate([np.asarray(line.y, float) for line in self.lines] or [np.zeros(1)])
        known = values[np.isfinite(values)]
        return min(1.1 * known.min(initial=0.0), -self.least), max(1.1 * known.max(initial=0.0), self.least)


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """Panels under one caption.

    Parameters
    ----------
    caption : what it shows
    panels : row by row
    columns : panels beside each other, where there is room
    linked : whether the horizontal axes move together
    description : for readers who do not see it; empty takes the caption
    panel_px : height of a panel [px]
    """

    caption: str
    panels: Sequence[Panel]
    columns: int = 1
    linked: bool = False
    description: str = ""
    panel_px: int = 240

    @property
    def key(self) -> list[Line]:
        """The first line of each name."""
        lines = [line for panel in self.panels for line in panel.lines if line.name]
        return list({line.name: line for line in reversed(lines)}.values())[::-1]


def pick_style(place: int) -> dict[str, str]:
    """Return colour and dash of one of many lines.

    Parameters
    ----------
    place : of the line among those of the figure, from 0
    """
    dash, colour = divmod(place, len(COLOURS))
    return {"colour": COLOURS[colour], "dash": DASHES[dash % len(DASHES)]}


@cache
def read_colours() -> dict[str, str]:
    """Return the light colours of the style sheet by name."""
    light = STYLE_SHEET.read_text().partition("}")[0]
    return dict(re.findall(r"--([\w-]+): (#\w+)", light))


def as_plotly(figure: Figure, digits: int | None = DIGITS) -> dict[str, Any]:
    """Return a figure's ``data`` and ``layout`` for Plotly, and how its panels stand.

    Names are text in it, although Plotly reads markup. Colours are variables of the style sheet, ``var(--a)``.

    Parameters
    ----------
    figure : to draw
    digits : to which numbers are rounded, as JSON can hold them; None leaves arrays as they are
    """
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {"annotations": [], "shapes": []}
    first, stacked = figure.key, figure.linked and figure.columns == 1
    for k, panel in enumerate(figure.panels):
        place = "" if k == 0 else str(k + 1)
        axes = {"xaxis": f"x{place}", "yaxis": f"y{place}"}
        for line in panel.lines:
            *band, drawn = _draw_line(line, digits)
            data += [*(edge | axes for edge in band), drawn | axes | {"showlegend": line in first}]
        axis: dict[str, Any] = {"title": {"text": _as_text(panel.x)}}
        if figure.linked and k:
            axis["matches"] = "x"
        if stacked and k + 1 < len(figure.panels):
            axis |= {"title": {"text": ""}, "showticklabels": False}
        layout[f"xaxis{place}"] = axis
        layout[f"yaxis{place}"] = {"title": {"text": _as_text(panel.y)}}
        if (found := panel.find_range()) is not None:
            layout[f"yaxis{place}"]["range"] = found
        layout["annotations"].append({
            "text": _as_text(panel.title), "xref": f"x{place} domain", "yref": f"y{place} domain", "x": 0, "y": 1,
            "xanchor": "left", "yanchor": "bottom", "showarrow": False,
        })  # fmt: skip
        layout["shapes"] += [
            {"type": "rect", "xref": f"x{place}", "yref": f"y{place} domain", "x0": start, "x1": end, "y0": 0, "y1": 1,
             "fillcolor": "var(--soft)", "opacity": 0.15, "line": {"width": 0}, "layer": "below"}
            for start, end in panel.shaded
        ]  # fmt: skip
    shape = {
        "panels": len(figure.panels), "columns": figure.columns, "panel_px": figure.panel_px,
        "gap_px": STACKED_GAP_PX if stacked else GAP_PX,
    }  # fmt: skip
    return {"data": data, "layout": layout} | shape


def as_notebook(figure: Figure) -> Any:
    """Return a figure as ``plotly.graph_objects.Figure``, in the light colours and in full precision.

    Parameters
    ----------
    figure : of one column
    """
    # its import takes half a second, which other questions need not pay
    import plotly.graph_objects as go

    drawn, rows = as_plotly(figure, digits=None), len(figure.panels)
    shown = go.Figure(_paint({"data": drawn["data"], "layout": drawn["layout"]}))
    grid = {"rows": rows, "columns": 1, "pattern": "independent", "ygap": drawn["gap_px"] / drawn["panel_px"]}
    shown.update_layout(
        grid=grid, height=rows * figure.panel_px, title_text=_as_text(figure.caption), hovermode="x unified"
    )
    return shown


def _paint(value: Any) -> Any:
    """Return a part of a figure with each variable of the style sheet replaced by its light colour."""
    if isinstance(value, list):
        return [_paint(item) for item in value]
    if not isinstance(value, dict):
        return value
    return {
        key: read_colours()[item[6:-1]] if key.endswith("color") else _paint(item)
        for key, item in value.items()
    }


def _draw_line(line: Line, digits: int | None) -> list[dict[str, Any]]:
    colour = f"var(--{line.colour})"
    x, y, low, high = (_plain(values, digits) for values in (line.x, line.y, line.low, line.high))
    base = {"type": "scatter", "x": x, "legendgroup": line.name}
    edge = base | {
        "mode": "lines",
        "line": {"width": 0, "color": colour},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    filled = edge | {"y": high, "fill": "tonexty", "fillcolor": f"var(--{line.colour}-band)"}
    drawn = base | {
        "mode": {None: "markers", False: "lines", True: "lines+markers"}[line.marked], "name": _as_text(line.name),
        "y": y, "hovertemplate": "%{y:.3g}", "line": {"color": colour, "width": 1.6, "dash": line.dash},
        "marker": {"size": 5, "color": colour},
    }  # fmt: skip
    return [drawn] if low is None else [edge | {"y": low}, filled, drawn]


def _as_text(text: str) -> str:
    """Return text in which Plotly finds no markup."""
    return escape(text, quote=False)


def _plain(values: Values | None, digits: int | None) -> Any:
    """Return numbers with some digits; JSON has no infinity."""
    if values is None or digits is None:
        return values
    return [
        float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in np.asarray(values, float)
    ]
