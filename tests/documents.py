"""The pages of the documentation, and what stands in their blocks of code."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import typer

from flows.cli import app
from manifests.provenance import SOURCE_ROOT
from studies.__main__ import app as laboratory

DOCS = SOURCE_ROOT / "docs"
DOCUMENTS = sorted([*SOURCE_ROOT.glob("*.md"), *DOCS.rglob("*.md")])
PROGRAMS = "(?:musync|python -m studies) "
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", flags=re.M | re.S)


def list_blocks(document: Path, *languages: str) -> list[str]:
    """Return the contents of the blocks of code of a page that are marked with one of some languages."""
    found = BLOCK.finditer(document.read_text())
    return [content for _, language, content in (m.groups() for m in found) if language in languages]


def list_command_lines(document: Path) -> Iterator[str]:
    """Yield the lines of a page that call a program of the project: of blocks for a terminal, and indented ones."""
    for block in list_blocks(document, "", "sh", "bash", "console"):
        for line in block.replace("\\\n", " ").splitlines():
            if re.match(PROGRAMS, line.lstrip("$ ")):
                yield line.lstrip("$ ")
    text = BLOCK.sub("", document.read_text())
    yield from (line.strip() for line in re.findall(rf"^ {{4}}({PROGRAMS}.*)$", text, flags=re.M))


def parse_line(line: str) -> tuple[typer.Typer, list[str]]:
    """Return the program that a line of a document names, and the words after its name."""
    words = shlex.split(line, comments=True)
    return (laboratory, words[3:]) if words[0] == "python" else (app, words[1:])


def list_named_commands(document: Path) -> Iterator[str]:
    """Yield what a page's prose and tables name in backticks: a command, often with options and without the rest."""
    text = BLOCK.sub("", document.read_text())
    yield from (" ".join(line.split()) for line in re.findall(r"`(musync [^`]*)`", text))
