"""Figures as SVG: the same figure, the same bytes."""

from io import StringIO

import matplotlib
from matplotlib.figure import Figure


def as_svg(figure: Figure) -> str:
    """The figure's ``<svg>`` element, without a date and with fixed ids."""
    buffer = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "musync", "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    drawing = buffer.getvalue()
    return drawing[drawing.index("<svg") :]
