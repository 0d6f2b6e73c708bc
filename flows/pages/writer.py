"""Pages of text, tables and figures: one file each, that fetches nothing and runs no script but its own."""

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

from flows.pages.figures import STYLE_SHEET, Figure, as_plotly

FILES = Path(__file__).parent
LETTER = re.compile(r"[^\W\d]")
HASH = re.compile(r"[0-9a-f]{16,}(, [0-9a-f]{16,})*")
DASH = "–"
"""In place of a value that there is not."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """A value of a table that stands out.

    Parameters
    ----------
    value : as in other cells
    tone : ``good``, ``bad`` or ``strong``
    """

    value: Any
    tone: str


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; without rows it is left out, and so is a column in which no row has a value.

    Parameters
    ----------
    title : over it; a section's only table needs none
    rows : plain values or cells by column; the first column names the row. A text is the head of the rows below it.
    note : how to read it
    digits : of its numbers
    """

    title: str = ""
    rows: Sequence[Mapping[str, Any] | str]
    note: str = ""
    digits: int = 4

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        names = dict.fromkeys(name for row in self.rows if not isinstance(row, str) for name in row)
        return [name for name in names if any(value not in (None, "") for value in self._list_values(name))]

    def is_text(self, column: str) -> bool:
        """Whether a column holds words, which are read from the left."""
        return any(isinstance(value, str) and LETTER.search(value) for value in self._list_values(column))

    def _list_values(self, column: str) -> list[Any]:
        values = [row.get(column) for row in self.rows if not isinstance(row, str)]
        return [value.value if isinstance(value, Cell) else value for value in values]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """Pictures under one caption.

    Parameters
    ----------
    caption : what they show
    sources : of `encode_picture`
    """

    caption: str
    sources: Sequence[str]


@dataclass(frozen=True, kw_only=True)
class Command:
    """What to type.

    Parameters
    ----------
    text : one line or more
    """

    text: str


Part = str | Mapping[str, Any] | Table | Figure | Command | Sequence[str] | Sequence[Picture]
"""A paragraph, facts by name, a table, a figure, a command, a list, or pictures beside each other."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page under its own title.

    Parameters
    ----------
    title : over it
    parts : what stands in it
    """

    title: str
    parts: Sequence[Part]


def write_page(
    title: str,
    heading: str,
    sections: Sequence[Section],
    *,
    lead: Sequence[str] = (),
    above: str = "",
    tone: str = "",
) -> str:
    """Return a page in one file.

    Its scripts run by their hashes alone, so that one that got in with a text of a user would not; a page without
    figures has none.

    Parameters
    ----------
    title : of the window
    heading : what the page is about or says
    sections : those without parts are left out
    lead : paragraphs below the heading
    above : sentence above it
    tone : ``good`` or ``bad`` for a heading that is a verdict
    """
    has_figures = any(isinstance(part, Figure) for section in sections for part in section.parts)
    scripts = (read_plotly(), (FILES / "page.js").read_text()) if has_figures else ()
    style = STYLE_SHEET.read_text()
    return fill_template(
        "page.html", title=title, heading=heading, lead=lead, above=above, tone=tone, style=style, scripts=scripts,
        sections=[section for section in sections if section.parts],
        # plotly gives elements styles of their own
        policy=make_policy(scripts=scripts, style=None if has_figures else style),
    )  # fmt: skip


def write_card(title: str, parts: Sequence[Part]) -> str:
    """Return parts of a page for a place that has colours of its own, such as a notebook.

    Parameters
    ----------
    title : over them
    parts : without figures
    """
    return fill_template("card.html", title=title, parts=parts)


def fill_template(name: str, *, folder: Path | None = None, **values: Any) -> str:
    """Return a template with values filled in, each as text.

    Parameters
    ----------
    name : of the template
    folder : of templates that build on those of this package
    values : by the template's names
    """
    pages = Environment(
        loader=FileSystemLoader([FILES, *([folder] if folder else [])]), autoescape=select_autoescape(),
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    pages.filters |= {
        "kind": _name_kind, "look": _name_look, "plotly": as_plotly, "value": format_value,
        "words": lambda name: name.replace("_", " "),
    }  # fmt: skip
    return pages.get_template(name).render(**values)


def format_value(value: Any, digits: int = 4) -> str:
    """Return a value in words: a number to some digits, a dash where there is none.

    Parameters
    ----------
    value : plain
    digits : of a number
    """
    if isinstance(value, Cell):
        return format_value(value.value, digits)
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def encode_picture(picture: Any, width: int | None = None) -> str:
    """Return a picture as JPEG in an address of its own.

    Parameters
    ----------
    picture : uint8 [H, W, 3] RGB
    width : to which it is scaled; None leaves it [px]
    """
    import cv2  # only a page with pictures needs it

    shown = picture[:, :, ::-1]
    if width is not None:
        height = max(1, round(picture.shape[0] * width / picture.shape[1]))
        shown = cv2.resize(shown, (width, height), interpolation=cv2.INTER_AREA)
    content = cv2.imencode(".jpg", shown, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
    return f"data:image/jpeg;base64,{base64.b64encode(content).decode()}"


def make_policy(*, scripts: Sequence[str] = (), style: str | None = None) -> str:
    """Return the content-security policy of a page: these scripts run and no other, nothing is fetched.

    It holds even if a text of a user got into the page unescaped.

    Parameters
    ----------
    scripts : texts of the page's scripts
    style : the page's one style sheet; None where elements have styles of their own
    """
    allowed = "'unsafe-inline'" if style is None else _hash_text(style)
    running = f"script-src {' '.join(map(_hash_text, scripts))}; " if scripts else ""
    return f"default-src 'none'; {running}style-src {allowed}; img-src data:; base-uri 'none'; form-action 'none'"


def read_plotly() -> str:
    """Return the script of plotly.js."""
    from plotly.offline import get_plotlyjs  # only a page that is written needs it

    source: str = get_plotlyjs()
    return source


def _hash_text(text: str) -> str:
    """Return a text as a policy names it."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _name_kind(part: Part) -> str:
    """Return how the template shows a part."""
    match part:
        case str():
            return "text"
        case Mapping():
            return "facts"
        case Table() | Figure() | Command():
            return type(part).__name__.lower()
        case [Picture(), *_]:
            return "pictures"
    return "list"


def _name_look(value: Any) -> str:
    """Return the style sheet's class of a value."""
    if isinstance(value, Cell):
        return value.tone
    return "hash" if isinstance(value, str) and HASH.fullmatch(value) else ""
