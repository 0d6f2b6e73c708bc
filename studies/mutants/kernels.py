"""Compiled kernels of a tree in which one file changes: the changed ones compiled again, the others kept.

Numba takes a kernel for unchanged while the time and size of its own file are. So every file with a kernel that reaches
the changed file by its imports gets a new time, and what is compiled meanwhile goes into a copy of the cache.
"""

import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_IMPORT = re.compile(r"^\s*from ([\w.]+) import", re.MULTILINE)


def list_stale_kernels(tree: Path, file: Path) -> list[Path]:
    """Return the files with kernels that hold a file or reach it by their imports.

    Parameters
    ----------
    tree : root of the sources
    file : path of the changed file in it
    """
    texts = {
        path.relative_to(tree): path.read_text(encoding="utf-8") for path in (tree / "tasks").rglob("*.py")
    }
    importers: dict[Path, set[Path]] = {path: set() for path in texts}
    for path, text in texts.items():
        for module in _IMPORT.findall(text):
            stem = Path(*module.split("."))
            for imported in (stem.with_suffix(".py"), stem / "__init__.py"):
                importers.get(imported, set()).add(path)
    reached, waiting = set(), [file]
    while waiting:
        path = waiting.pop()
        if path not in reached:
            reached.add(path)
            waiting += importers.get(path, set())
    return sorted(path for path in reached if "njit" in texts.get(path, ""))


@contextmanager
def kernels_of_a_change(tree: Path, file: Path, kept: Path) -> Iterator[Path]:
    """Give the folder for compiled kernels while a file is changed.

    Parameters
    ----------
    tree : root of the sources
    file : path of the changed file in it
    kept : kernels of the sound tree
    """
    stale = list_stale_kernels(tree, file)
    kept.mkdir(exist_ok=True)
    if not stale:
        yield kept
        return
    times = {path: (tree / path).stat() for path in {*stale, file}}
    scratch = kept.with_name("changed-kernels")
    shutil.copytree(kept, scratch, copy_function=os.link)  # Numba replaces files and writes into none
    try:
        now = time.time_ns()
        for path in stale:
            os.utime(tree / path, ns=(now, now))
        yield scratch
    finally:
        for path, was in times.items():
            os.utime(tree / path, ns=(was.st_atime_ns, was.st_mtime_ns))
        shutil.rmtree(scratch)
