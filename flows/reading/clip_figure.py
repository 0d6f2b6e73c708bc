"""A clip's speed, slip, wheel load and pitch over time as a figure to look at in a notebook."""

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from flows.pages.figures import Figure, Line, Panel, Style, as_plotly

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

_FRONT, _REAR = "a", "b"
_PANELS: tuple[tuple[str, float, tuple[tuple[str, str, str], ...]], ...] = (
    ("speed [km/h]", 3.6, (("speed", "speed", _FRONT),)),
    ("braking slip", 1.0, (("braking_slip_f", "front", _FRONT), ("braking_slip_r", "rear", _REAR))),
    # half of the half-car's axle load rests on each wheel
    ("wheel load [kN]", 0.5e-3, (("axle_load_f", "front", _FRONT), ("axle_load_r", "rear", _REAR))),
    ("pitch [deg]", 180 / np.pi, (("pitch", "pitch", _FRONT),)),
)
"""Title, shown value over the column's, and lines: column, name in the key, colour."""
COLUMNS = ("t_ns", "brake_pressure_mpa", *(column for _, _, lines in _PANELS for column, _, _ in lines))
"""Of the view ticks, that the figure shows."""


def draw_clip(label: str, ticks: "pd.DataFrame") -> "go.Figure":
    """Return a Plotly figure of four panels over one time axis; the time from the brake's onset to its end is shaded.

    Parameters
    ----------
    label : of the clip
    ticks : its `COLUMNS`, a row a tick
    """
    import plotly.graph_objects as go  # it takes half a second, which other questions need not pay

    seconds = ticks["t_ns"].to_numpy() * 1e-9
    braking = seconds[np.flatnonzero(ticks["brake_pressure_mpa"].to_numpy() > 0)]
    panels = [
        Panel(
            y=title,
            lines=[
                Line(name=name, x=seconds, y=ticks[column].to_numpy() * factor, style=Style(colour))
                for column, name, colour in lines
            ],
            shaded=[(braking[0], braking[-1])] if braking.size else [],
        )
        for title, factor, lines in _PANELS
    ]
    drawn = as_plotly(Figure(caption=label, panels=panels, linked=True, panel_px=180), digits=None)
    return go.Figure(**drawn).update_layout(title_text=escape(label, quote=False))
