"""Output to a terminal: text of users and datasets stays plain text, never markup, emoji or control sequences."""

import os
import re
import sys
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console

_UNPRINTABLE = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters, marks of writing direction, line separators, and unpaired surrogates."""


def escape_controls(text: str) -> str:
    """One line of text whose control characters are written out: the escape character as ``\\x1b``."""
    return _UNPRINTABLE.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def escape_lines(text: str) -> str:
    """The same for text of several lines."""
    return "\n".join(map(escape_controls, text.split("\n")))


def print_lines(text: str, *, error: bool = False) -> None:
    """Print lines for people; a closed pipe (``| head -1``) is no failure.

    Parameters
    ----------
    text : lines without the last line feed
    error : whether they go to the standard error
    """
    stream = sys.stderr if error else sys.stdout
    try:
        stream.write(escape_lines(text) + "\n")
        stream.flush()
    except BrokenPipeError:
        _silence_stream(stream)


def open_console(*, error: bool = False, **options: Any) -> "Console":
    """A Rich console that takes text as it is; strings for it go through `escape_controls` first.

    Parameters
    ----------
    error : whether it writes to the standard error
    options : further ones of ``rich.console.Console``
    """
    # its import takes longer than many a command
    from rich.console import Console

    class PlainConsole(Console):
        def on_broken_pipe(self) -> None:
            _silence_stream(self.file)  # type: ignore[arg-type]

    return PlainConsole(stderr=error, markup=False, emoji=False, highlight=False, **options)


def _silence_stream(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that further output causes no error."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
