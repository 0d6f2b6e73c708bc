"""Random sequences of commands on a dataset in a folder, with faults at random steps, against what must always hold.

A reader never sees half a clip; nothing committed is lost; a run that is not disturbed ends with the bytes of a run
that never was. The style is that of the simulation tests of databases: one process, one seed, every fault injected.
"""

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from flows.auditing.repair import repair_dataset
from flows.auditing.verify import collect_garbage, verify_dataset
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan, read_plan
from flows.reading.describe import describe_dataset
from flows.reading.query import query_dataset
from flows.running.failures import ClipsFailed
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout
from flows.store.sealed import read_receipt
from manifests.canonical import sha256_of_file
from studies.store_faults.clips import write_grid
from studies.store_faults.disk import FAULTS, FaultyDisk, Killed
from tasks.errors import InputError

COUNTS: Counter[str] = Counter()
"""Events in the sequences of this process, counted by kind."""
LAST_STEP = 480
"""Faults strike up to here; a run takes some 480 changes of the disk, a repair and a collection fewer."""
Told = (InputError, ClipsFailed, OSError)
"""How a command may end under a fault."""

faults = st.tuples(st.sampled_from((*FAULTS, *FAULTS, None)), st.integers(1, LAST_STEP))


@lru_cache(maxsize=1)
def inputs_folder() -> Path:
    """The folder of the grid, for as long as this process lives."""
    folder = Path(tempfile.mkdtemp(prefix="store-faults-"))
    write_grid(folder)
    return folder


@lru_cache(maxsize=1)
def make_undisturbed() -> dict[str, bytes]:
    """The files of a run that nothing disturbs."""
    folder = inputs_folder() / "undisturbed"
    make_dataset(folder)
    return files_of(folder)


def make_dataset(place: Path | str) -> None:
    """Make the dataset in a folder or at an address, or what is missing of it."""
    generate_dataset(str(inputs_folder() / "grid.yaml"), str(place), runner="threads", workers=1)


def files_of(folder: Path) -> dict[str, bytes]:
    """Relative path to bytes of every file."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


class FolderMachine(RuleBasedStateMachine):
    """One dataset in a folder, from nothing to whatever the commands and faults make of it."""

    def __init__(self) -> None:
        super().__init__()
        self.place = Path(tempfile.mkdtemp(prefix="store-faults-"))
        self.folder = self.place / "data"
        self.layout = Layout(self.folder)
        self.committed: set[str] = set()
        self.damaged: set[str] = set()
        COUNTS["sequences"] += 1

    @initialize()
    def _know_the_undisturbed_run(self) -> None:
        make_undisturbed()

    def teardown(self) -> None:
        """After all the faults, an undisturbed repair and run give the bytes of the undisturbed run."""
        try:
            if self.damaged:
                self._repair()
            make_dataset(self.folder)
            now, wanted = files_of(self.folder), make_undisturbed()
            differing = sorted(name for name in now.keys() | wanted if now.get(name) != wanted.get(name))
            assert not differing, f"not the bytes of the undisturbed run: {differing}"
            COUNTS["finished with equal bytes"] += 1
        finally:
            shutil.rmtree(self.place)

    @rule(fault=faults, seed=st.integers(0, 2**16))
    def generate(self, fault: tuple[str | None, int], seed: int) -> None:
        self._under(fault, seed, lambda: make_dataset(self.folder))

    @precondition(lambda self: self.layout.manifest.is_file())
    @rule(fault=faults, seed=st.integers(0, 2**16))
    def start_over(self, fault: tuple[str | None, int], seed: int) -> None:
        """A new dataset, whose run is disturbed."""
        shutil.rmtree(self.folder)
        self.damaged, self.committed = set(), set()
        self.generate(fault, seed)

    @rule(at=st.integers(1, LAST_STEP), other=st.sampled_from(["generate", "gc", "repair", "verify", "read"]))
    def another_process_meets_a_run(self, at: int, other: str) -> None:
        """A second writer, or a reader, comes in the middle of a run."""

        def come() -> None:
            COUNTS["second processes"] += 1
            self._attempt(getattr(self, f"_{other}"))
            self._look()

        with FaultyDisk(self.place, at=at, meanwhile=come):
            self._attempt(lambda: make_dataset(self.folder))

    @precondition(lambda self: self.layout.manifest.is_file())
    @rule(data=st.data())
    def flip_a_bit(self, data: st.DataObject) -> None:
        names = sorted(
            name for name in make_undisturbed() if name != "manifest.json" and (self.folder / name).is_file()
        )
        name = data.draw(st.sampled_from(names))
        content = bytearray((self.folder / name).read_bytes())
        bit = data.draw(st.integers(0, 8 * len(content) - 1))
        content[bit // 8] ^= 1 << bit % 8
        (self.folder / name).write_bytes(content)
        self.damaged ^= {name} if bytes(content) == make_undisturbed()[name] else set()
        self.damaged |= {name} if bytes(content) != make_undisturbed()[name] else set()
        COUNTS["flipped bits"] += 1

    @precondition(lambda self: self.layout.manifest.is_file())
    @rule(data=st.data())
    def lose_a_file(self, data: st.DataObject) -> None:
        name = data.draw(st.sampled_from(sorted(make_undisturbed().keys() - {"manifest.json"})))
        (self.folder / name).unlink(missing_ok=True)
        self.damaged.add(name)
        COUNTS["lost files"] += 1

    @precondition(lambda self: self.layout.manifest.is_file())
    @rule(fault=faults, seed=st.integers(0, 2**16))
    def repair(self, fault: tuple[str | None, int], seed: int) -> None:
        self._under(fault, seed, self._repair)

    @rule(fault=faults, seed=st.integers(0, 2**16))
    def gc(self, fault: tuple[str | None, int], seed: int) -> None:
        self._under(fault, seed, self._gc)

    @rule()
    def stale_lock(self) -> None:
        """The lock of a process that is no more."""
        if self.layout.staging.is_dir():
            (self.layout.staging / "lock").touch()

    @invariant()
    def nothing_committed_is_lost_and_readers_see_whole_clips(self) -> None:
        self._look()

    def _look(self) -> None:
        COUNTS["looks"] += 1
        if self.layout.manifest.is_file():
            wrong = {name for name, content in make_undisturbed().items() if self._bytes(name) != content}
            assert wrong <= self.damaged, (
                f"{sorted(wrong - self.damaged)} are not those of the undisturbed run"
            )
            named = {row["path"] for row in verify_dataset(str(self.folder))["damaged"]}
            assert wrong <= named, f"verify does not name {sorted(wrong - named)}"
            if not wrong:
                self._read()
            self.committed = set()
            return
        now = self._committed()
        assert self.committed <= now, f"committed clips are lost: {sorted(self.committed - now)}"
        self.committed = now

    def _bytes(self, name: str) -> bytes | None:
        path = self.folder / name
        return path.read_bytes() if path.is_file() else None

    def _committed(self) -> set[str]:
        """Ids of the clips that have a receipt; each is whole."""
        if not self.layout.plan.is_file():
            return set()
        found = set()
        for clip in read_plan(self.folder).clips:
            if self.layout.receipt(clip.clip_id).is_file():
                receipt = read_receipt(self.layout, clip.clip_id)
                tables = [self.layout.staged(clip.clip_id, table) for table in STAGED_TABLES]
                assert all(table.is_file() for table in tables), "a committed clip lacks a table"
                for path, digest in receipt["artifacts"].items():
                    assert sha256_of_file(self.folder / path) == digest, f"half a clip is committed: {path}"
                found.add(clip.clip_id)
        return found

    def _under(self, fault: tuple[str | None, int], seed: int, command: Callable[[], Any]) -> None:
        kind, at = fault
        with FaultyDisk(self.place, kind, at, seed=seed) as disk:
            try:
                command()
            except Killed:
                COUNTS["dead processes"] += 1
            except Told:
                assert disk.struck or self.damaged or not self.layout.manifest.is_file(), (
                    "no fault, and yet an error"
                )
            except BaseException:
                assert disk.struck
                raise
        if disk.struck:
            COUNTS[f"fault: {kind}"] += 1

    def _attempt(self, command: Callable[[], Any]) -> None:
        try:
            command()
        except Told:
            COUNTS["refused"] += 1

    def _generate(self) -> None:
        make_dataset(self.folder)

    def _gc(self) -> None:
        collect_garbage(str(self.folder))

    def _verify(self) -> None:
        verify_dataset(str(self.folder))

    def _repair(self) -> None:
        result = repair_dataset(str(self.folder), runner="threads", workers=1)
        if result["repaired"]:
            self.damaged = set()

    def _read(self) -> None:
        assert len(describe_dataset(str(self.folder))["clips"]) == len(_plan_ids())
        rows = query_dataset(
            str(self.folder), "SELECT clip_id, count(*) AS ticks FROM ticks GROUP BY clip_id"
        )["rows"]
        assert {row["clip_id"] for row in rows} == _plan_ids() and {row["ticks"] for row in rows} == {201}
        assert read_clip(self.layout.frames, 0, "rgb").any()


@lru_cache(maxsize=1)
def _plan_ids() -> frozenset[str]:
    plan, _ = make_plan(str(inputs_folder() / "grid.yaml"), "cpu")
    return frozenset(clip.clip_id for clip in plan.clips)
