"""A clip's speed, slip, wheel load and pitch over time as a figure to look at in a notebook."""

from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

_FRONT, _REAR = "#0072b2", "#d55e00"
"""Blue and vermilion of Okabe and Ito, which people who see few colours tell apart."""
_PANELS: tuple[tuple[str, float, tuple[tuple[str, str, str], ...]], ...] = (
    ("speed [km/h]", 3.6, (("speed", "", _FRONT),)),
    ("braking slip [1]", 1.0, (("braking_slip_f", "front", _FRONT), ("braking_slip_r", "rear", _REAR))),
    # half of the half-car's axle load rests on each wheel
    ("wheel load [kN]", 0.5e-3, (("axle_load_f", "front", _FRONT), ("axle_load_r", "rear", _REAR))),
    ("pitch [deg]", 180 / np.pi, (("pitch", "", _FRONT),)),
)
"""Title, shown value over the column's, and lines: column, name in the legend, colour."""
COLUMNS = ("t_ns", "brake_pressure_mpa", *(column for _, _, lines in _PANELS for column, _, _ in lines))
"""Of the view ticks, that the figure shows."""


def draw_clip(label: str, ticks: "pd.DataFrame") -> "go.Figure":
    """Return a Plotly figure of four panels over one time axis; a dotted line marks the brake onset.

    Parameters
    ----------
    label : of the clip
    ticks : its `COLUMNS`, a row a tick
    """
    # its import takes half a second, which other questions need not pay
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    seconds = ticks["t_ns"].to_numpy() * 1e-9
    figure = make_subplots(rows=len(_PANELS), shared_xaxes=True, vertical_spacing=0.04)
    for row, (title, factor, lines) in enumerate(_PANELS, start=1):
        for column, name, colour in lines:
            figure.add_trace(
                go.Scatter(
                    x=seconds,
                    y=ticks[column].to_numpy() * factor,
                    name=name or title.split(" [")[0],
                    line={"color": colour, "width": 1.5},
                    legendgroup=name,
                    showlegend=bool(name) and column.startswith("braking_slip"),
                ),
                row=row,
                col=1,
            )
        figure.update_yaxes(title_text=title, row=row, col=1)
    braking = np.flatnonzero(ticks["brake_pressure_mpa"].to_numpy() > 0)
    if braking.size:
        figure.add_vline(x=seconds[braking[0]], line={"dash": "dot", "color": "gray", "width": 1})
    figure.update_xaxes(title_text="time [s]", row=len(_PANELS), col=1)
    # Plotly reads markup in titles
    figure.update_layout(title_text=escape(label, quote=False), height=720, hovermode="x unified")
    return figure
