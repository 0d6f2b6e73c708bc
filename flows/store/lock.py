"""One writer at a time on a dataset."""

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

from flows.store.layout import Layout
from flows.store.lease import hold_lease
from flows.store.links import refuse_foreign_entries
from flows.store.objects import Objects
from tasks.errors import InputError


@contextmanager
def sole_writer(layout: Layout) -> Iterator[None]:
    """Hold the dataset for writing; the lock goes with the process, however it ends, or in a store soon after it.

    Everything that writes to a dataset or deletes from it passes here, so this is where links in it are refused.

    Raises
    ------
    InputError
        If another process is writing the same dataset, or the dataset holds links.
    """
    refuse_foreign_entries(layout.root)
    lock = _locked_file(layout)
    try:
        with nullcontext() if layout.origin is None else hold_lease(Objects(layout.origin)):
            yield
    finally:
        os.close(lock)


def _locked_file(layout: Layout) -> int:
    """The lock file, open and locked; a run that ends takes the file away, and then the next one is made."""
    while True:
        lock = _open_lock(layout.staging / "lock")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise InputError(
                f"{layout}: another run is writing this dataset; wait for it or give another folder"
            ) from None
        if _is_at(lock, layout.staging / "lock"):
            return lock
        os.close(lock)


def _is_at(lock: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(lock), os.lstat(path))
    except FileNotFoundError:
        return False


def _open_lock(path: Path) -> int:
    """Open the lock file, and create it where it is missing; an existing file is not followed, truncated or written."""
    with suppress(FileExistsError):
        path.parent.mkdir(parents=True)
    with suppress(IsADirectoryError, NotADirectoryError):
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK, 0o644)
        facts = os.fstat(lock)
        if stat.S_ISREG(facts.st_mode) and facts.st_nlink <= 1 and facts.st_size == 0:
            return lock
        os.close(lock)
    raise InputError(f"{path}: the lock must be an empty file with one name; it is something else: remove it")
