"""Files that only grow, a line of JSON an entry: a kill at any time loses at most the entry that is being written."""

import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

from flows.store.outputs import refuse_link
from tasks.errors import InputError

CANCELLED = b"\x18"
"""Ends an entry that a killed command has left unfinished."""


def read_lines(path: Path, keys: Collection[str]) -> list[dict[str, Any]]:
    """The entries; one that a killed command has left unfinished is none.

    Parameters
    ----------
    path : the file, which need not exist
    keys : that every entry has

    Raises
    ------
    InputError
        If it is a link or no file, or a line is no such entry.
    """
    if not os.path.lexists(path):
        return []
    refuse_link(path)
    *lines, _ = path.read_bytes().split(b"\n")
    entries: list[dict[str, Any]] = []
    for number, line in enumerate(lines, start=1):
        if line.endswith(CANCELLED):
            continue
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):
            entry = None
        if not isinstance(entry, dict) or not set(keys) <= entry.keys():
            raise InputError(
                f"{path}: line {number} must be a JSON object with {', '.join(sorted(keys))}; correct it, or move the"
                " file away"
            )
        entries.append(entry)
    return entries


def append_line(path: Path, entry: dict[str, Any]) -> None:
    """Add an entry; an unfinished one before it is cancelled, and nothing is removed.

    Parameters
    ----------
    path : a file as `read_lines` takes it
    entry : plain values

    Raises
    ------
    InputError
        If it is a link or no file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    refuse_link(path)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o666)
    with open(descriptor, "r+b", buffering=0) as stream:
        size = os.fstat(descriptor).st_size
        unfinished = size > 0 and os.pread(descriptor, 1, size - 1) != b"\n"
        stream.write((CANCELLED + b"\n" if unfinished else b"") + json.dumps(entry).encode() + b"\n")
        os.fsync(descriptor)
