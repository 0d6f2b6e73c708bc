"""One writer at a time on a dataset."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

from flows.store.layout import Layout
from flows.store.lease import leased
from flows.store.objects import Objects
from tasks.errors import InputError


@contextmanager
def sole_writer(layout: Layout) -> Iterator[None]:
    """Hold the dataset for writing; the lock goes with the process, however it ends, or in a store soon after it.

    Raises
    ------
    InputError
        If another process is writing the same dataset.
    """
    layout.staging.mkdir(parents=True, exist_ok=True)
    with (layout.staging / "lock").open("w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"{layout}: another run is writing this dataset; wait for it or give another folder"
            ) from None
        with nullcontext() if layout.origin is None else leased(Objects(layout.origin)):
            yield
