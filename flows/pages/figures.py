"""Figures: panels of lines with bands, for Plotly on a page, and in `flows.pages.static` for a document."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

STYLE_SHEET = Path(__file__).with_name("page.css")
COLOURS = ("a", "b", "c", "d", "e", "f")
"""Of the style sheet, which has ``ink`` and ``soft`` too."""
DASHES = {"solid": "solid", "dashed": "dash", "dotted": "dot"}
"""Dashes of a line by name, as Plotly calls them."""
BAND = "30"
"""Opacity of a band, as the end of its colour."""
DIGITS = 6
"""Of a number, that a screen can show."""
GAP_PX, STACKED_GAP_PX = 66, 26
"""Between rows of panels, and between those over one horizontal axis [px]."""

Values = NDArray[np.floating[Any]] | Sequence[float] | Sequence[float | None]


class Style(NamedTuple):
    """Colour of the style sheet, and dash, of a line."""

    colour: str = "ink"
    dash: str = "solid"


INK = Style()


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """A line of a panel.

    Parameters
    ----------
    name : in the key, and of all lines that are shown and hidden with it
    x, y : [N], NaN or None where there is no value
    low, high : [N] edges of a band about it; None for none
    style : with a colour of `COLOURS`, ``ink`` or ``soft``, and a dash of `DASHES`
    marked : whether each point has a mark; None marks the points and draws no line
    """

    name: str
    x: Values
    y: Values
    low: Values | None = None
    high: Values | None = None
    style: Style = INK
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
        shown = (
            values for line in self.lines for values in (line.y, line.low, line.high) if values is not None
        )
        values = np.concatenate([np.asarray(each, float) for each in shown])
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
        first: dict[str, Line] = {}
        for line in (line for panel in self.panels for line in panel.lines if line.name):
            first.setdefault(line.name, line)
        return list(first.values())


def pick_style(index: int) -> Style:
    """Return colour and dash of one of many lines.

    Parameters
    ----------
    index : of the line among those of the figure, from 0
    """
    dash, colour = divmod(index, len(COLOURS))
    return Style(COLOURS[colour], [*DASHES][dash % len(DASHES)])


@cache
def read_colours() -> dict[str, str]:
    """Return the light colours of the style sheet by name."""
    light = STYLE_SHEET.read_text().partition("}")[0]
    return dict(re.findall(r"--([\w-]+): (#\w+)", light))


def as_plotly(figure: Figure, digits: int | None = DIGITS) -> dict[str, Any]:
    """Return a figure's ``data`` and ``layout`` for Plotly, in the light colours; names are text, not markup.

    Parameters
    ----------
    figure : to draw
    digits : to which numbers are rounded, as JSON can hold them; None leaves arrays as they are
    """
    first, stacked = figure.key, figure.linked and figure.columns == 1
    data: list[dict[str, Any]] = []
    columns = min(figure.columns, len(figure.panels))
    rows = -(-len(figure.panels) // columns)
    gap = (STACKED_GAP_PX if stacked else GAP_PX) / figure.panel_px
    layout: dict[str, Any] = {
        "annotations": [], "shapes": [], "height": rows * figure.panel_px, "hovermode": "x unified",
        "grid": {"rows": rows, "columns": columns, "pattern": "independent", "ygap": gap},
    }  # fmt: skip
    for k, panel in enumerate(figure.panels):
        axis = "" if k == 0 else str(k + 1)
        axes = {"xaxis": f"x{axis}", "yaxis": f"y{axis}"}
        for line in panel.lines:
            *band, drawn = _draw_line(line, digits)
            data += [*(edge | axes for edge in band), drawn | axes | {"showlegend": line in first}]
        is_last = k + 1 == len(figure.panels)
        layout[f"xaxis{axis}"] = {"title": {"text": "" if stacked and not is_last else _as_text(panel.x)}}
        layout[f"xaxis{axis}"] |= {"matches": "x"} if figure.linked and k else {}
        layout[f"xaxis{axis}"] |= {"showticklabels": False} if stacked and not is_last else {}
        layout[f"yaxis{axis}"] = {"title": {"text": _as_text(panel.y)}}
        if (found := panel.find_range()) is not None:
            layout[f"yaxis{axis}"]["range"] = found
        layout["annotations"].append({
            "text": _as_text(panel.title), "xref": f"x{axis} domain", "yref": f"y{axis} domain", "x": 0, "y": 1,
            "xanchor": "left", "yanchor": "bottom", "showarrow": False,
        })  # fmt: skip
        layout["shapes"] += [
            {"type": "rect", "xref": f"x{axis}", "yref": f"y{axis} domain", "x0": start, "x1": end, "y0": 0, "y1": 1,
             "fillcolor": read_colours()["soft"] + BAND, "line": {"width": 0}, "layer": "below"}
            for start, end in panel.shaded
        ]  # fmt: skip
    return {"data": data, "layout": layout}


def _draw_line(line: Line, digits: int | None) -> list[dict[str, Any]]:
    """Return the edges of a line's band, and the line."""
    colour = read_colours()[line.style.colour]
    x, y, low, high = (_plain(values, digits) for values in (line.x, line.y, line.low, line.high))
    base = {"type": "scatter", "x": x, "legendgroup": line.name}
    edge = base | {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "showlegend": False}
    drawn = base | {
        "mode": {None: "markers", False: "lines", True: "lines+markers"}[line.marked], "name": _as_text(line.name),
        "y": y, "hovertemplate": "%{y:.3g}", "line": {"color": colour, "width": 1.6, "dash": DASHES[line.style.dash]},
        "marker": {"size": 5, "color": colour},
    }  # fmt: skip
    if low is None:
        return [drawn]
    return [edge | {"y": low}, edge | {"y": high, "fill": "tonexty", "fillcolor": colour + BAND}, drawn]


def _as_text(text: str) -> str:
    """Return text in which Plotly finds no markup."""
    return escape(text, quote=False)


def _plain(values: Values | None, digits: int | None) -> Any:
    """Return numbers with some digits; JSON has no infinity."""
    if values is None or digits is None:
        return values
    # numbers of Python, written in one go: those of NumPy take three times as long, and one by one they take twice
    known = np.asarray(values, float).tolist()
    rounded = map(float, (f"%.{digits}g " * len(known) % tuple(known)).split())
    return [x if isfinite(x) else None for x in rounded]
