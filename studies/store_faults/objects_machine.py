"""The same in an object store: requests that are refused, unanswered or never sent, dead owners, jumping clocks."""

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import obstore
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from obstore.store import MemoryStore

import flows.store.lease
from flows.auditing.repair import repair_dataset
from flows.auditing.verify import collect_garbage, verify_dataset
from flows.reading.describe import describe_dataset
from flows.store.lease import LOCK
from flows.store.objects import Objects
from studies.store_faults.disk import Killed
from studies.store_faults.folder_machine import COUNTS, Told, make_dataset, make_undisturbed

ADDRESS = "s3://simulated/data"
REFUSED, UNANSWERED, KILLED_BEFORE, KILLED_AFTER = "refused", "unanswered", "killed before", "killed after"
REQUEST_FAULTS = (REFUSED, UNANSWERED, KILLED_BEFORE, KILLED_AFTER)
LAST_REQUEST = 60
"""Faults strike up to here; a run sends some 60 requests that change something."""
LEASE_S, RENEW_S, WATCH_S = 0.05, 60.0, 0.005
"""The lock of a dead owner is given up in no time; no renewal comes between, so that sequences can be repeated [s]."""

faults = st.tuples(st.sampled_from((*REQUEST_FAULTS, None)), st.integers(1, LAST_REQUEST))


class FaultyRequests:
    """obstore's functions, of which one call that changes the store goes wrong.

    Parameters
    ----------
    fault : of `REQUEST_FAULTS`, or None
    at : which call, from 1 [1]
    """

    def __init__(self, fault: str | None, at: int):
        self.fault, self.at = fault, at
        self.calls, self.dead, self.struck = 0, False, False
        self.exceptions = obstore.exceptions

    def put(self, *args: Any, **kwargs: Any) -> Any:
        return self._changed(obstore.put, *args, **kwargs)

    def delete(self, *args: Any, **kwargs: Any) -> Any:
        return self._changed(obstore.delete, *args, **kwargs)

    def __getattr__(self, name: str) -> Any:
        function = getattr(obstore, name)

        def ask(*args: Any, **kwargs: Any) -> Any:
            if self.dead:
                raise Killed
            return function(*args, **kwargs)

        return ask

    def _changed(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        if self.dead:
            raise Killed
        self.calls += 1
        strikes = self.calls == self.at and self.fault is not None
        if not strikes:
            return function(*args, **kwargs)
        self.struck = True
        if self.fault in {UNANSWERED, KILLED_AFTER}:
            function(*args, **kwargs)
        if self.fault in {KILLED_BEFORE, KILLED_AFTER}:
            self.dead = True
            raise Killed
        raise obstore.exceptions.GenericError("Generic S3 error: HTTP error: the connection was closed")


class ObjectsMachine(RuleBasedStateMachine):
    """One dataset at one address, worked on by this machine and by others."""

    def __init__(self) -> None:
        super().__init__()
        self.place = Path(tempfile.mkdtemp(prefix="store-faults-"))
        self.store = MemoryStore()
        self.committed: set[str] = set()
        self.clock = 0.0
        self.machine = 0
        COUNTS["sequences"] += 1

    @initialize()
    def _know_the_undisturbed_run(self) -> None:
        make_undisturbed()

    def teardown(self) -> None:
        """After all the faults, an undisturbed repair and run give the objects of the undisturbed run."""
        try:
            with self._simulated(FaultyRequests(None, 0)):
                if "manifest.json" in self._names() and self._differing():
                    repair_dataset(ADDRESS, runner="threads", workers=1)
                make_dataset(ADDRESS)
                collect_garbage(ADDRESS)
            assert not self._differing() and self._names() == make_undisturbed().keys()
            COUNTS["finished with equal bytes"] += 1
        finally:
            shutil.rmtree(self.place)

    @rule(fault=faults, elsewhere=st.booleans())
    def generate(self, fault: tuple[str | None, int], elsewhere: bool) -> None:
        self._under(fault, elsewhere, lambda: make_dataset(ADDRESS))

    @rule(fault=faults, elsewhere=st.booleans())
    def gc(self, fault: tuple[str | None, int], elsewhere: bool) -> None:
        self._under(fault, elsewhere, lambda: collect_garbage(ADDRESS))

    @rule(fault=faults, elsewhere=st.booleans())
    def repair(self, fault: tuple[str | None, int], elsewhere: bool) -> None:
        self._under(fault, elsewhere, lambda: repair_dataset(ADDRESS, runner="threads", workers=1))

    @rule()
    def lock_of_an_owner_that_is_gone(self) -> None:
        obstore.put(self.store, LOCK, b'{"host": "another machine", "pid": 1, "renewal": "0"}')
        COUNTS["stale locks"] += 1

    @rule()
    def lock_that_is_no_lock(self) -> None:
        obstore.put(self.store, LOCK, b"[1, 2")
        COUNTS["stale locks"] += 1

    @rule(seconds=st.sampled_from([3600.0, 1e9]))
    def clock_jumps(self, seconds: float) -> None:
        self.clock += seconds
        COUNTS["clock jumps"] += 1

    @rule(data=st.data())
    def lose_an_object(self, data: st.DataObject) -> None:
        if "manifest.json" in self._names():
            obstore.delete(
                self.store, data.draw(st.sampled_from(sorted(make_undisturbed().keys() - {"manifest.json"})))
            )
            COUNTS["lost files"] += 1

    @invariant()
    def nothing_committed_is_lost_and_readers_see_whole_clips(self) -> None:
        COUNTS["looks"] += 1
        names = self._names()
        if "manifest.json" in names:
            self.committed = set()
            with self._simulated(FaultyRequests(None, 0)):
                if not self._differing():
                    assert len(describe_dataset(ADDRESS)["clips"]) == 4
                else:
                    named = {row["path"] for row in verify_dataset(ADDRESS)["damaged"]}
                    assert self._differing() <= named
            return
        now = {name for name in names if name.startswith(".staging/") and name.endswith(".json")}
        assert self.committed <= now, f"committed clips are lost: {sorted(self.committed - now)}"
        for receipt in now:
            clip_id = receipt.removeprefix(".staging/").removesuffix(".json")
            for table in ("ticks", "frames"):
                assert f".staging/{clip_id}.{table}.parquet" in names, "a committed clip lacks a table"
        self.committed = now

    def _names(self) -> set[str]:
        return {entry["path"] for chunk in obstore.list(self.store) for entry in chunk}

    def _differing(self) -> set[str]:
        names = self._names()
        return {
            name
            for name, content in make_undisturbed().items()
            if name not in names or bytes(obstore.get(self.store, name).bytes()) != content
        }

    def _under(self, fault: tuple[str | None, int], elsewhere: bool, command: Callable[[], Any]) -> None:
        self.machine += elsewhere
        requests = FaultyRequests(*fault)
        with self._simulated(requests):
            try:
                command()
            except Killed:
                COUNTS["dead processes"] += 1
            except Told:
                COUNTS["refused"] += 1
        if requests.struck:
            COUNTS[f"fault: request {fault[0]}"] += 1

    @contextmanager
    def _simulated(self, requests: FaultyRequests) -> Iterator[None]:
        """This process as a machine with its own cache, the store, and the clock as it stands."""

        def connect(objects: Objects, address: str) -> None:
            objects.address, objects._api = address, requests
            prefix = address.removeprefix(ADDRESS).strip("/")
            objects._store = obstore.store.PrefixStore(self.store, prefix) if prefix else self.store

        clock = SimpleNamespace(monotonic=lambda: time.monotonic() + self.clock, sleep=time.sleep)
        cache = self.place / f"machine-{self.machine}"
        with (
            mock.patch.object(Objects, "__init__", connect),
            mock.patch.multiple(
                flows.store.lease, LEASE_S=LEASE_S, RENEW_S=RENEW_S, WATCH_S=WATCH_S, time=clock
            ),
            mock.patch("flows.store.address.cache_root", lambda: cache),
        ):
            yield
