"""The built-in street: generated once, kept in the user's cache, and generated again if it is damaged."""

import hashlib
import os
import re
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy
from filelock import FileLock

import tasks.scene
from catalogs.scenes.folder import ARRAY_FILES, OPTIONAL_FILES, array_damage, read_facts, write_scene
from catalogs.scenes.street import STREET_FILE, load_street_layout
from tasks.errors import InputError
from tasks.kernel_cache import cache_root
from tasks.scene.scene import Scene

STREET = re.compile(r"street-\d+-[0-9a-f]{16}")
HALF_MADE = re.compile(STREET.pattern + r"(\.\d+)?(\.[0-9a-f]{8})?\.partial|" + STREET.pattern + r"\.\d+")
"""Names of what a killed process leaves behind: a folder that is being written."""
MARKER = "musync-cache.sha256"
"""Written last: the SHA-256 of scene.json, which in turn has those of the arrays."""
WRITTEN = ("scene.json", *ARRAY_FILES, *OPTIONAL_FILES, MARKER)
"""Files of a cached street; nothing else is ever deleted."""


BUILT_IN_SEED = 2025
"""Of the streets that have a name of their own."""
KEPT = 100
"""Streets that stay on the disk, 60 MB each; of more, those that were used least recently go [1]."""


def cached_street(*changes: Path, seed: int = BUILT_IN_SEED) -> Path:
    """The folder of a street with this seed; made on first use, when its code changes, and when it is damaged.

    Parameters
    ----------
    changes : files of what it has otherwise than the street's own entry
    seed : of every texture and object

    Raises
    ------
    InputError
        If the cache cannot be written, or holds in the street's place what is no street.
    """
    entries = (STREET_FILE, *changes)
    folder = cache_root() / f"street-{seed}-{_recipe_hash(entries, tuple(map(_stamp_file, entries)))}"
    try:
        if not _is_whole(folder):
            with _only_maker(folder.parent):
                if not _is_whole(folder):
                    _make_street(folder, seed, *changes)
    except OSError as error:
        raise InputError(
            f"{folder.parent}: the cache of generated scenes must be a folder that can be written, with room for 60 MB;"
            f" {error.strerror}: set MUSYNC_CACHE to one that is"
        ) from None
    os.utime(folder)  # its time of use
    return folder


def _make_street(folder: Path, seed: int, *changes: Path) -> None:
    """Write the street beside its place, then rename it; what killed makers left goes first."""
    for path in sorted(folder.parent.iterdir()):
        if HALF_MADE.fullmatch(path.name):
            _remove_street(path)
    if not _remove_street(folder):
        raise InputError(
            f"{folder}: must be the built-in street as muSync made it; it is damaged, and is or holds something else:"
            " move it away, and the street is generated again"
        )
    own = folder.with_name(f"{folder.name}.{os.getpid()}")
    try:
        write_scene(_build_street(seed, *changes), own, {"source": "generated", "licence": "Apache-2.0"})
        (own / MARKER).write_text(_facts_hash(own))
        own.rename(folder)
    finally:
        _remove_street(own)
    _forget_oldest(folder.parent)


def _forget_oldest(root: Path) -> None:
    kept = [(path.stat().st_mtime_ns, path) for path in root.iterdir() if STREET.fullmatch(path.name)]
    for _, path in sorted(kept)[:-KEPT]:
        _remove_street(path)


def _build_street(seed: int, *changes: Path) -> Scene:
    from tasks.scene.street.build import build_street

    return build_street(load_street_layout(STREET_FILE, *changes, seed=seed), seed)


def _is_whole(folder: Path) -> bool:
    """Whether a cached street is there, byte for byte as it was made."""
    if folder.is_symlink() or not (folder / MARKER).is_file():
        return False
    return _has_its_bytes(folder, tuple(_stamp_file(folder / name) for name in WRITTEN))


@lru_cache(maxsize=8)
def _has_its_bytes(folder: Path, _: tuple[tuple[int, ...], ...]) -> bool:
    """Whether the files have the recorded hashes; 60 MB are read again only if the stamp of a file has changed."""
    try:
        sound = (folder / MARKER).read_bytes() == _facts_hash(folder).encode()
        return sound and not array_damage(folder, read_facts(folder))
    except (InputError, OSError):
        return False


def _stamp_file(path: Path) -> tuple[int, ...]:
    """Identity, size and times of a file, of which every write changes one; empty where there is none."""
    try:
        state = path.lstat()
    except OSError:
        return ()
    return state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns


def _facts_hash(folder: Path) -> str:
    return hashlib.sha256((folder / "scene.json").read_bytes()).hexdigest()


def _remove_street(folder: Path) -> bool:
    """Remove a cached street, whole or not; False where anything but one is there, which is left as it is."""
    if not os.path.lexists(folder):
        return True
    if folder.is_symlink() or not folder.is_dir():
        return False
    with os.scandir(folder) as entries:
        if any(entry.name not in WRITTEN or entry.is_dir(follow_symlinks=False) for entry in entries):
            return False
    for name in WRITTEN:
        (folder / name).unlink(missing_ok=True)
    folder.rmdir()
    return True


def _only_maker(root: Path) -> FileLock:
    """Hold the cache for making a street; the lock goes with the process, however it ends."""
    root.mkdir(parents=True, exist_ok=True)
    return FileLock(root / "street.lock", mode=0o644)


@lru_cache(maxsize=8)
def _recipe_hash(entries: tuple[Path, ...], _: tuple[tuple[int, ...], ...]) -> str:
    """Over the entries of a street, the code that makes it and the libraries that it computes with."""
    contents = [path.read_bytes() for path in entries]
    digest = hashlib.sha256(b"".join([f"{np.__version__} {scipy.__version__}".encode(), *contents]))
    package = Path(tasks.scene.__file__).parent
    for path in sorted(package.rglob("*.py")):
        if "stereo" not in path.parts:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
