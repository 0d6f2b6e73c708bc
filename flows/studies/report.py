"""A study as one HTML page that needs no other file: tables with the paper's figures in them, and drawings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from flows.pages import DATASET_PAGE, make_policy

PAGE = Path(__file__).parent / "report_page"


@dataclass(frozen=True, kw_only=True)
class StudyTable:
    """A table of a study; without rows it is left out.

    Parameters
    ----------
    title : over it
    rows : plain values by column, the same columns in each
    note : how to read it
    """

    title: str
    rows: Sequence[Mapping[str, Any]]
    note: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns in which any row has a value."""
        names = dict.fromkeys(name for row in self.rows for name in row)
        return tuple(name for name in names if any(row.get(name) not in (None, "") for row in self.rows))

    def is_text(self, column: str) -> bool:
        """Whether a column holds words, which are read from the left."""
        return any(isinstance(row.get(column), str) for row in self.rows)


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A figure of a study.

    Parameters
    ----------
    caption : what it shows; readers who do not see it get this
    svg : of `flows.drawing.as_svg`
    """

    caption: str
    svg: str


def write_study_page(
    title: str, lead: str, tables: Sequence[StudyTable], drawings: Sequence[Drawing] = ()
) -> str:
    """Return the page. It runs no script and fetches nothing.

    Parameters
    ----------
    title : of the study
    lead : what it asks, and how to read it
    tables, drawings : in their order
    """
    pages = Environment(loader=FileSystemLoader(PAGE), autoescape=True, undefined=StrictUndefined)
    pages.filters |= {"digits": _format_digits, "words": lambda name: name.replace("_", " ")}
    style = "\n".join(sheet.read_text() for sheet in (DATASET_PAGE / "report.css", PAGE / "page.css"))
    return pages.get_template("page.html").render(
        title=title, lead=lead, tables=tables, drawings=drawings, style=style, policy=make_policy()
    )


def _format_digits(value: Any) -> str:
    """Return a cell: a number to four digits, a dash where there is none."""
    if value is None or value == "":
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
