"""A TorchScript checkpoint is a program: what it may call is looked through before any of it runs.

Loading alone runs it, where a class brings its own ``__setstate__``.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from catalogs.sentences import shorten
from tasks.errors import InputError

REACHES_FILES = {"from_file", "save"}
"""Operators that open files, whose names no checkpoint may hold: ``x.save(name)`` calls them too."""
NAMESPACES = {"aten", "prim", "quantized"}
"""Operators that compute; others talk to other processes, or come with a library."""
CLASSES = re.compile(rb"torch[.\n]classes[.\n](?!(?:quantized|rnn)\.)[\w.]{0,60}")
"""Classes of C++ but for those of quantised networks: some open files, or load libraries."""
DEBUG = ".debug_pkl"


def load_network(path: Path, name: str) -> Any:
    """Return the network of a TorchScript file that reaches no file, library or process.

    Parameters
    ----------
    path : of the file
    name : what messages call it

    Raises
    ------
    InputError
        If it is none, or its code calls what it must not.
    """
    import torch

    try:
        reader = torch._C.PyTorchFileReader(str(path))  # the one that loads it, so that both see the same
        programs = {record: reader.get_record(record) for record in _list_programs(reader.get_all_records())}
        calls = [call for record, content in programs.items() for call in _find_calls(record, content)]
        network = None if calls else torch.jit.load(path, map_location="cpu").eval()
    except (RuntimeError, ValueError, OSError, EOFError) as error:
        raise InputError(f"{name} must be a TorchScript module; {shorten(error)}") from None
    if calls:
        found = ", ".join(dict.fromkeys(calls))
        raise InputError(
            f"{name} must be a network that only computes; its program has {shorten(found)}, with which it can reach"
            " files or other programs: do not use it"
        )
    return network


def _list_programs(records: list[str]) -> list[str]:
    """The records of a file that hold code, and those that name classes; one of an old form is all of it."""
    if "model.json" in records:
        raise ValueError("it has the form of PyTorch before 1.4: save it again")
    return [name for name in records if not name.endswith(DEBUG) and not re.fullmatch(r"\w+/\d+", name)]


def _find_calls(record: str, content: bytes) -> Iterator[str]:
    yield from (found.decode().replace("\n", ".") for found in CLASSES.findall(content))
    if not record.lower().startswith("code/"):
        return
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        yield f"code that cannot be looked through ({shorten(record)})"
        return
    for node in ast.walk(tree):
        words = (getattr(node, name, None) for name in ("id", "attr", "value"))  # a name, x.name or "name"
        yield from (word for word in words if isinstance(word, str) and word in REACHES_FILES)
        if (
            isinstance(node, ast.Attribute)
            and ast.unparse(node.value) == "ops"
            and node.attr not in NAMESPACES
        ):
            yield f"ops.{shorten(node.attr)}"
