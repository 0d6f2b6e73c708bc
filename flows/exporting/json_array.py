"""A JSON array that is written entry by entry, so that a table of any length needs little memory."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO


class JsonArray:
    """Entries of an array in a file of text; `open_array` ends it."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._before = "[\n"

    def append(self, entry: Any) -> None:
        """Write one more entry."""
        self._stream.write(self._before + json.dumps(entry, allow_nan=False))
        self._before = ",\n"

    def end(self) -> None:
        """Close the bracket."""
        self._stream.write("[]" if self._before == "[\n" else "\n]")


@contextmanager
def open_array(stream: TextIO) -> Iterator[JsonArray]:
    """Yield an array to append to, in an open file."""
    array = JsonArray(stream)
    yield array
    array.end()
