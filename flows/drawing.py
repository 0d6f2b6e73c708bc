"""Figures: the same SVG for the same figure, text that is nothing but text."""

from io import StringIO

import matplotlib
from matplotlib.figure import Figure


def escape_formulas(text: str) -> str:
    """Return text of users and datasets for a figure, in which no dollar sign starts a formula."""
    return text.replace("$", r"\$")


def as_svg(figure: Figure) -> str:
    """The figure's ``<svg>`` element, without a date and with fixed ids."""
    buffer = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "musync", "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    drawing = buffer.getvalue()
    return drawing[drawing.index("<svg") :]
