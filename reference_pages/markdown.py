"""Markdown of tables: cells that hold whatever a catalogue says, numbers as their file writes them."""

import re
from collections.abc import Iterable, Sequence
from urllib.parse import quote

DOI = re.compile(r"doi:(10\.\d+/[^\s,;]*[^\s,;.)])")


def format_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table; a column in which no row has a text is left out.

    Parameters
    ----------
    head : titles of the columns
    rows : cells as text, or as what `format_value` takes
    """
    cells = [[format_cell(cell) for cell in row] for row in rows]
    filled = [number for number in range(len(head)) if any(row[number] for row in cells)]
    lines = [
        [head[number] for number in filled],
        ["---"] * len(filled),
        *([row[number] for number in filled] for row in cells),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def format_cell(cell: object) -> str:
    """Return a cell's text on one line; bars and brackets are text, a DOI leads to its work.

    Parameters
    ----------
    cell : text, or a value of a catalogue
    """
    text = " ".join((cell if isinstance(cell, str) else format_value(cell)).split())
    pieces = DOI.split(text)
    # every other piece is a DOI, whose characters an address may not hold as they are
    pieces[1::2] = [f"[doi:{_escape(doi)}](https://doi.org/{quote(doi, safe='/')})" for doi in pieces[1::2]]
    pieces[::2] = [_escape(piece) for piece in pieces[::2]]
    return "".join(pieces)


def format_value(value: object) -> str:
    """Return a value of a catalogue as text: numbers in their shortest form, lists with commas.

    Parameters
    ----------
    value : number, text, truth value, None or a list of these
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:.15g}"
    if isinstance(value, list | tuple):
        return ", ".join(format_value(part) for part in value)
    return str(value)


def _escape(text: str) -> str:
    """Return a text of which Markdown takes nothing for markup, but for code between backticks."""
    pieces = text.split("`")
    if len(pieces) % 2 == 0:  # a backtick without its other one
        pieces = [text.replace("`", "\\`")]
    pieces[::2] = [
        re.sub(r"([\\*_\[\]])", r"\\\1", p).replace("&", "&amp;").replace("<", "&lt;") for p in pieces[::2]
    ]
    return "`".join(pieces).replace("|", "\\|")
