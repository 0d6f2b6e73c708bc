"""Finding a catalogue entry by name or by file."""

import os
import re
from pathlib import Path

from catalogs.sentences import shorten
from tasks.errors import InputError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
"""A name that is one file name on any system, and never a path."""


def find_entry(
    folder: Path, name_or_path: str | Path, kind: str, *, suffixes: tuple[str, ...] = (".yaml", ".yml")
) -> Path:
    """The file of an entry: a path with its suffix is taken as it is, a name is looked up in ``folder``.

    Parameters
    ----------
    folder : of the catalogue
    name_or_path : of the entry
    kind : what it is called in the sentence
    suffixes : of such files, first that of the catalogue

    Raises
    ------
    InputError
        If there is no such entry; the sentence lists those that exist.
    """
    path = Path(name_or_path)
    named = path.suffix not in suffixes
    if named:
        path = folder / f"{name_or_path}{suffixes[0]}"
    if (named and not NAME.fullmatch(str(name_or_path))) or not os.path.isfile(path):
        known = ", ".join(sorted(entry.stem for entry in folder.glob(f"*{suffixes[0]}")))
        form = "YAML" if suffixes[0] == ".yaml" else suffixes[0]
        raise InputError(f"{shorten(name_or_path)}: no such {kind}; give a {form} file or one of: {known}")
    return path
