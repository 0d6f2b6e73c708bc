"""Figures and pages: the same SVG for the same figure, text that is nothing but text, pages that fetch nothing."""

import base64
import hashlib
from collections.abc import Sequence
from io import StringIO

import matplotlib
from matplotlib.figure import Figure


def make_policy(*, scripts: Sequence[str] = (), style: str | None = None) -> str:
    """Return the content-security policy of a page: these scripts run and no other, nothing is fetched.

    It holds even if a text of a user got into the page unescaped.

    Parameters
    ----------
    scripts : texts of the page's scripts
    style : the page's one style sheet; None where elements have styles of their own, as plotly's have
    """
    allowed = "'unsafe-inline'" if style is None else _hash_text(style)
    running = f"script-src {' '.join(map(_hash_text, scripts))}; " if scripts else ""
    images = "data: blob:" if scripts else "data:"
    return f"default-src 'none'; {running}style-src {allowed}; img-src {images}; base-uri 'none'; form-action 'none'"


def _hash_text(text: str) -> str:
    """Return a text as a policy names it."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


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
