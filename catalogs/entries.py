"""Finding a catalogue entry by name or by file: one folder and one form of file for each kind of entry."""

import os
import re
from pathlib import Path

from catalogs.sentences import shorten
from tasks.errors import InputError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
"""A name that is one file name on any system, and never a path."""
CATALOGUE = Path(__file__).parent
FOLDERS = {
    "bump study": "bump_studies",
    "bus": "buses",
    "calibration procedure": "calibration",
    "camera": "cameras",
    "channel map": "channel_maps",
    "grid": "grids",
    "hazard marking": "hazard_markings",
    "protocol": "protocols",
    "stop study": "stop_studies",
    "surface": "surfaces",
    "tyre": "tyres",
    "vehicle": "vehicles",
    "video protocol": "video_protocols",
}
"""Folder of each kind of entry."""
YAML = (".yaml", ".yml")
SUFFIXES = {"tyre": (".tir",)}
"""Suffixes of the files of a kind that is not written in YAML; the first is that of the catalogue."""


def entry_folder(kind: str) -> Path:
    """Return the catalogue's folder of a kind of entry."""
    return CATALOGUE / FOLDERS[kind]


def entry_names(kind: str) -> tuple[str, ...]:
    """Return the names of the entries of a kind in the catalogue, sorted."""
    suffix = SUFFIXES.get(kind, YAML)[0]
    return tuple(sorted(entry.stem for entry in entry_folder(kind).glob(f"*{suffix}")))


def find_entry(kind: str, name_or_path: str | Path) -> Path:
    """Return the file of an entry: a path with its suffix as it is, a name from the catalogue.

    Parameters
    ----------
    kind : of `FOLDERS`
    name_or_path : of the entry

    Raises
    ------
    InputError
        If there is no such entry; the sentence lists those that exist.
    """
    suffixes = SUFFIXES.get(kind, YAML)
    path = Path(name_or_path)
    is_name = path.suffix not in suffixes
    if is_name:
        path = entry_folder(kind) / f"{name_or_path}{suffixes[0]}"
    if (is_name and not NAME.fullmatch(str(name_or_path))) or not os.path.isfile(path):
        form = "YAML" if suffixes == YAML else suffixes[0]
        raise InputError(
            f"{shorten(name_or_path)}: no such {kind}; give a {form} file or one of:"
            f" {', '.join(entry_names(kind))}"
        )
    return path
