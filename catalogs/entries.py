"""Finding a catalogue entry by name or by file."""

import os
import re
from pathlib import Path

from catalogs.sentences import shorten
from tasks.errors import InputError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
"""A name that is one file name on any system, and never a path."""


def find_entry(folder: Path, name_or_path: str | Path, kind: str) -> Path:
    """The YAML file of an entry: a path ending in .yaml is taken as it is, a name is looked up in ``folder``.

    Raises
    ------
    InputError
        If there is no such entry; the sentence lists those that exist.
    """
    path = Path(name_or_path)
    named = path.suffix not in {".yaml", ".yml"}
    if named:
        path = folder / f"{name_or_path}.yaml"
    if (named and not NAME.fullmatch(str(name_or_path))) or not os.path.isfile(path):
        known = ", ".join(sorted(entry.stem for entry in folder.glob("*.yaml")))
        raise InputError(f"{shorten(name_or_path)}: no such {kind}; give a YAML file or one of: {known}")
    return path
