"""Links, pipes and devices, which no dataset of ours holds: writing through one reaches other people's files."""

import os
from collections.abc import Callable
from pathlib import Path

from catalogs.sentences import cap_problems, shorten
from tasks.errors import InputError

KINDS = {"plan.json": False, "manifest.json": False} | dict.fromkeys(
    ("inputs", "telemetry", "frames.zarr", "previews", ".staging"), True
)
"""Entries of a dataset by name, and whether they are folders."""


def foreign_entries(root: Path, wanted: Callable[[str], bool] = lambda name: True) -> list[str]:
    """Relative paths of the entries of a dataset that are neither folders nor files, or the wrong of the two, in order.

    Parameters
    ----------
    root : folder; it need not exist
    wanted : which files matter, by relative path; folders of frames that hold none are not walked
    """
    found: list[str] = []
    waiting = [""] if root.is_dir() else []
    while waiting:
        folder = waiting.pop()
        with os.scandir(root / folder) as entries:
            for entry in entries:
                name = f"{folder}{entry.name}"
                is_folder = entry.is_dir(follow_symlinks=False)
                if is_folder != KINDS.get(name, is_folder):
                    found.append(name)
                elif not is_folder:
                    found += [] if entry.is_file(follow_symlinks=False) else [name]
                elif entry.name != "c" or not name.startswith("frames.zarr/") or wanted(f"{name}/0"):
                    waiting.append(f"{name}/")
    return sorted(found)


def refuse_foreign_entries(root: Path, wanted: Callable[[str], bool] = lambda name: True) -> None:
    """Refuse a dataset that holds anything but folders and regular files.

    Parameters
    ----------
    root, wanted : as of `foreign_entries`

    Raises
    ------
    InputError
        Naming every such entry.
    """
    if found := foreign_entries(root, wanted):
        raise InputError(cap_problems([_describe_link(root, path) for path in found]))


def _describe_link(root: Path, path: str) -> str:
    target = root / path
    if target.is_symlink():
        kind = "a link"
    elif path in KINDS and (target.is_dir() or target.is_file()):
        kind = "a folder where a file belongs" if target.is_dir() else "a file where a folder belongs"
    else:
        kind = "neither a file nor a folder"
    return (
        f"{shorten(target)}: a dataset must hold nothing but its folders and regular files; this is {kind}:"
        " remove it, or put back what belongs there"
    )


def require_file(path: Path) -> Path:
    """Return the path of a file that a dataset records, as it is.

    Raises
    ------
    InputError
        If it is missing, or lies behind a link.
    """
    if path.resolve() != path or not path.is_file():
        raise InputError(f"{path}: the manifest records this file; it is missing, or behind a link")
    return path
