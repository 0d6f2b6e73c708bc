"""Pages: what they share, and a policy by which they fetch nothing. Nothing is drawn here: its import costs little."""

import base64
import hashlib
from collections.abc import Sequence
from pathlib import Path

DATASET_PAGE = Path(__file__).parent / "reading" / "report_page"
"""Files of a dataset's page; other pages take its style sheet."""


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


def read_plotly() -> str:
    """Return the script of plotly.js."""
    from plotly.offline import get_plotlyjs  # only a page that is written needs it

    source: str = get_plotlyjs()
    return source
