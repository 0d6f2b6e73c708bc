"""Compiled kernels are kept by the source of all of them.

Numba keeps a compiled kernel as long as the kernel's own file is unchanged. A kernel that calls one from another
file would then go on running the other's old code after an update, in silence. So every state of the kernels'
sources has a folder of its own.
"""

import hashlib
import os
import re
import shutil
import sys
from contextlib import suppress
from pathlib import Path

from tasks.errors import InputError

_IMPORT = re.compile(r"^\s*from (tasks[\w.]*) import", re.MULTILINE)
_STATE = re.compile("[0-9a-f]{16}")

KEPT = 4
"""States of the sources whose kernels stay on disk."""


def place_kernel_cache() -> None:
    """Point Numba at the folder of the present sources, unless the user has chosen one (NUMBA_CACHE_DIR)."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    try:
        folder = cache_root() / "kernels" / sources_hash()
    except InputError:  # without a home, Numba keeps kernels beside their sources
        return
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        from numba.core import config

        config.CACHE_DIR = str(folder)
    if not os.path.isdir(folder):
        _forget_old(folder.parent)
    _make_private(folder)


def cache_root() -> Path:
    """Folder of what can be had again: MUSYNC_CACHE, or one in the user's cache.

    Raises
    ------
    InputError
        If neither is set and the user has no home folder.
    """
    if "MUSYNC_CACHE" in os.environ:
        return Path(os.environ["MUSYNC_CACHE"])
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "musync"
    except RuntimeError:
        raise InputError(
            "the user has no home folder for muSync's cache: set MUSYNC_CACHE to a folder that can be written"
        ) from None


def sources_hash(package: Path = Path(__file__).parent) -> str:
    """SHA-256, shortened, over every file with a kernel and all that these import: called kernels and constants."""
    waiting = [
        path for path in package.rglob("*.py") if b"njit" in path.read_bytes() and path != Path(__file__)
    ]
    sources: dict[str, bytes] = {}
    while waiting:
        path = waiting.pop()
        name = path.relative_to(package).as_posix()
        if name in sources:
            continue
        sources[name] = path.read_bytes()
        for module in _IMPORT.findall(sources[name].decode()):
            stem = package.parent.joinpath(*module.split("."))
            waiting += [file for file in (stem.with_suffix(".py"), stem / "__init__.py") if file.is_file()]
    digest = hashlib.sha256()
    for name in sorted(sources):
        digest.update(f"{name} {len(sources[name])}\n".encode() + sources[name])
    return digest.hexdigest()[:16]


def _make_private(folder: Path) -> None:
    """Make the folder of a state so that nobody else writes there, whatever the umask: what lies in it is run."""
    with suppress(OSError):
        folder.parent.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        for place in (folder.parent, folder):
            place.mkdir(mode=0o700, exist_ok=True)
            place.chmod(0o700)


def _forget_old(folder: Path) -> None:
    """Remove all but the latest states; one that another process still writes to comes back by itself.

    Only folders that are named as states are: what else lies there, and links, stay. A cache that cannot be read stays
    as it is, and Numba keeps kernels beside their sources.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        states = [e for e in entries if _STATE.fullmatch(e.name) and e.is_dir(follow_symlinks=False)]
        for state in sorted(states, key=lambda entry: entry.stat().st_mtime)[: -KEPT + 1]:
            shutil.rmtree(state.path, ignore_errors=True)
