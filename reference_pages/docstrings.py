"""Docstrings of the project as mkdocstrings reads them: ``name : meaning [unit]`` names no type, the code does."""

import re
from typing import Any

import griffe

PARAMETER = re.compile(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*) : (.*)$")
SECTION = re.compile(r"^(Parameters|Returns|Yields|Raises)\n-+\n", flags=re.M)


class ProjectDocstrings(griffe.Extension):
    """Gives griffe's NumPy parser each docstring in the form that it expects."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of a module, class, function or attribute.

        Parameters
        ----------
        obj : as griffe has just read it
        """
        if obj.docstring is not None:
            obj.docstring.value = rewrite_docstring(obj.docstring.value)


def rewrite_docstring(text: str) -> str:
    """Return a docstring whose parameters have their meaning on a line below, and whose results name no type.

    Parameters
    ----------
    text : a docstring without its indentation
    """
    pieces = SECTION.split(text)
    rewritten = [pieces[0]]
    for section, body in zip(pieces[1::2], pieces[2::2], strict=True):
        head = f"{section}\n{'-' * len(section)}\n"
        if section == "Parameters":
            lines = (PARAMETER.sub(r"\1\n    \2", line) for line in body.strip("\n").splitlines())
            body = "\n".join(lines) + "\n\n"
        elif section in {"Returns", "Yields"} and not re.match(r"\S+\n+\s", body) and " " in body.strip():
            # a sentence: the type stands in the signature
            head, body = f"**{section}**\n\n", f"{body.strip()}\n\n"
        rewritten += [head, body]
    return _escape_brackets("".join(rewritten)).rstrip() + "\n"


def _escape_brackets(text: str) -> str:
    """Return a text of whose units, such as ``[m]``, Markdown makes no links; code between backticks stays."""
    pieces = text.split("`")
    pieces[::2] = [piece.replace("[", "\\[") for piece in pieces[::2]]
    return "`".join(pieces)
