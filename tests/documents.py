"""The pages of the documentation, and what stands in their blocks of code."""

import re
from collections.abc import Iterator
from pathlib import Path

from manifests.provenance import SOURCE_ROOT

DOCS = SOURCE_ROOT / "docs"
DOCUMENTS = sorted([*SOURCE_ROOT.glob("*.md"), *DOCS.rglob("*.md")])
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", flags=re.M | re.S)


def list_blocks(document: Path, *languages: str) -> list[str]:
    """Return the contents of the blocks of code of a page that are marked with one of some languages."""
    found = BLOCK.finditer(document.read_text())
    return [content for _, language, content in (m.groups() for m in found) if language in languages]


def list_command_lines(document: Path) -> Iterator[str]:
    """Yield the lines of a page that call musync: of blocks for a terminal, and indented ones."""
    for block in list_blocks(document, "", "sh", "bash", "console"):
        for line in block.replace("\\\n", " ").splitlines():
            if line.lstrip("$ ").startswith("musync "):
                yield line.lstrip("$ ")
    text = BLOCK.sub("", document.read_text())
    yield from (line.strip() for line in re.findall(r"^ {4}(musync .*)$", text, flags=re.M))


def list_named_commands(document: Path) -> Iterator[str]:
    """Yield what a page's prose and tables name in backticks: a command, often with options and without the rest."""
    text = BLOCK.sub("", document.read_text())
    yield from (" ".join(line.split()) for line in re.findall(r"`(musync [^`]*)`", text))
