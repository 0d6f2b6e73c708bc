"""Links, pipes and devices, which no dataset of ours holds: writing through one reaches other people's files."""

import os
from collections.abc import Callable
from pathlib import Path

from catalogs.sentences import cap_problems, shorten
from tasks.errors import InputError


def foreign_entries(root: Path, wanted: Callable[[str], bool] = lambda name: True) -> list[str]:
    """Relative paths of all entries below a folder that are neither folders nor regular files, in order.

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
                if not entry.is_dir(follow_symlinks=False):
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
        raise InputError(cap_problems([_sentence(root, path) for path in found]))


def _sentence(root: Path, path: str) -> str:
    kind = "a link" if (root / path).is_symlink() else "neither a file nor a folder"
    return (
        f"{shorten(root / path)}: a dataset must hold nothing but folders and regular files; this is {kind}:"
        " remove it, or put the file itself there"
    )
