"""Where on this machine a user's own scenes and catalogue files lie: datasets record them by name and hash alone."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from catalogs.scenes import is_built_in, scene_identity
from flows.store.layout import read_json, write_json
from tasks.errors import InputError
from tasks.kernel_cache import cache_root

SCENE_FOLDERS = "MUSYNC_SCENES"
"""Environment variable: folders that hold scenes, for datasets whose scene was never used on this machine."""


def note_location(sha256: str, location: str | Path) -> None:
    """Note in the user's cache where something of a hash lies, for whoever makes or judges clips with it later.

    Parameters
    ----------
    sha256 : of a file's bytes, or that identifies a scene
    location : file or folder
    """
    note, absolute = _find_note(sha256), str(Path(location).resolve())
    if noted_location(sha256) != Path(absolute):
        write_json(note, absolute)


def noted_location(sha256: str) -> Path | None:
    """Where something of a hash lay when it was last used; None if nothing is noted, or the note is damaged."""
    try:
        location = read_json(_find_note(sha256))
    except InputError:
        return None
    return Path(location) if isinstance(location, str) else None


def find_scene(scene: Mapping[str, Any]) -> str:
    """The folder of a recorded scene on this machine, or its built-in name; its content may have changed since.

    Parameters
    ----------
    scene : ``name`` and ``sha256``, of a plan or manifest

    Raises
    ------
    InputError
        If no folder is known that holds it.
    """
    if is_built_in(scene["name"]):
        return str(scene["name"])
    folders = [Path(folder) for folder in os.environ.get(SCENE_FOLDERS, "").split(os.pathsep) if folder]
    locations = [
        noted_location(scene["sha256"]),
        Path(scene["name"]),
        *(folder / scene["name"] for folder in folders),
    ]
    found = {
        str(location): content
        for location in locations
        if location is not None and (content := _identity_at(location)) is not None
    }
    # a scene that was changed where it lies is better than none: audits compare it and say so
    for location in sorted(found, key=lambda location: found[location] != scene["sha256"]):
        return location
    raise InputError(
        f"scene {scene['name']}: no folder is known here that holds it (SHA-256 {scene['sha256'][:12]}...):"
        f" set {SCENE_FOLDERS} to the folder in which it lies as {Path(scene['name']).name}"
    )


def refuse_changed_scene(scene: Mapping[str, Any]) -> None:
    """Hold a user's scene against its recorded hash; the built-in street is of the code, which an audit compares.

    Parameters
    ----------
    scene : ``name`` and ``sha256``, of a plan or manifest

    Raises
    ------
    InputError
        If no folder is known that holds it, or it is another one now.
    """
    location = find_scene(scene)
    if not is_built_in(scene["name"]) and _identity_at(Path(location)) != scene["sha256"]:
        raise InputError(
            f"scene {scene['name']}: must be the recorded one (SHA-256 {scene['sha256'][:12]}...); {location} holds"
            f" another now: put the recorded one back, or set {SCENE_FOLDERS} to the folder in which it lies"
        )


def _identity_at(location: Path) -> str | None:
    try:
        return scene_identity(str(location))
    except (InputError, OSError):
        return None


def _find_note(sha256: str) -> Path:
    return cache_root() / "places" / f"{sha256}.json"
