"""One writer at a time on a dataset in an object store: a lock object that its owner keeps renewing.

Nobody's clock is trusted: a lock is dead when it has not changed for `LEASE_S` while somebody watched it. Where two
writers do meet, because one was asleep for longer, they write the same bytes.
"""

import json
import os
import platform
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from threading import Event, Thread
from typing import Any

from catalogs.documents import parse_json
from flows.store.objects import Objects
from tasks.errors import InputError

LEASE_S, RENEW_S, WATCH_S = 30.0, 5.0, 0.5
LOCK = ".staging/lock"


@contextmanager
def hold_lease(objects: Objects) -> Iterator[None]:
    """Hold the lease of the dataset at an address for writing.

    Raises
    ------
    InputError
        If another run holds it.
    """
    tag = objects.write(LOCK, _make_claim(), expected="") or _taken_over(objects)
    held, ended = [tag], Event()
    renewer = Thread(target=_renew_lease, args=(objects, held, ended), daemon=True)
    renewer.start()
    try:
        yield
    finally:
        ended.set()
        renewer.join()
        if held and objects.tag(LOCK) == held[0]:
            objects.remove([LOCK])


def _renew_lease(objects: Objects, held: list[str], ended: Event) -> None:
    """Renew the lock until the run ends, or another run has taken it."""
    while not ended.wait(RENEW_S):
        try:
            tag = objects.write(LOCK, _make_claim(), expected=held[0])
        except InputError:  # no answer now: the next time
            continue
        if tag is None:
            held.clear()
            return
        held[0] = tag


def _taken_over(objects: Objects) -> str:
    """The tag of the lock, once its owner is known to be dead."""
    seen, content = objects.tag(LOCK), objects.read(LOCK)
    owner = _owner_of(content)
    busy = InputError(
        f"{objects.address}: another run is writing this dataset (on {owner['host']}, process {owner['pid']});"
        " wait for it or give another address"
    )
    until = time.monotonic() + LEASE_S
    while not _died_here(owner) and time.monotonic() < until:
        if objects.tag(LOCK) != seen:
            raise busy
        time.sleep(WATCH_S)
    tag = objects.write(LOCK, _make_claim(), expected=seen or "")
    if tag is None:
        raise busy
    return tag


def _owner_of(content: bytes | None) -> dict[str, Any]:
    """Host and process that a lock names; of a lock that names none, an unknown owner."""
    unknown = {"host": "an unknown machine", "pid": 0}
    try:
        owner = parse_json(content or b"{}", LOCK, "lock")
    except InputError:
        return unknown
    known = (
        isinstance(owner, dict) and isinstance(owner.get("host"), str) and isinstance(owner.get("pid"), int)
    )
    return owner if known else unknown


def _make_claim() -> bytes:
    claim = {"host": platform.node(), "pid": os.getpid(), "renewal": uuid.uuid4().hex}
    return json.dumps(claim, sort_keys=True).encode()


def _died_here(owner: Mapping[str, Any]) -> bool:
    if owner["host"] != platform.node():
        return False
    try:
        os.kill(owner["pid"], 0)
    except ProcessLookupError:
        return True
    except (PermissionError, OverflowError):
        pass
    return False
