"""A disk that fails at a chosen step: full, broken, cut off in the middle of a write, or without what was not flushed.

While a `FaultyDisk` is entered, everything in this process that changes files below its root passes through it. Each
change is a step. A process that is killed changes nothing any more, so after a kill every further change fails, those
of clean-up code too, until the disk is left.
"""

import errno
import io
import os
import random
import shutil
import stat
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any
from unittest import mock

FULL, BROKEN, KILLED, TORN, POWER_CUT = "full", "broken", "killed", "torn", "power cut"
FAULTS = (FULL, BROKEN, KILLED, TORN, POWER_CUT)
_ERRORS = {FULL: errno.ENOSPC, BROKEN: errno.EIO}
_GROWING = {"mkdir", "open", "write", "fsync"}
"""Steps for which a full disk has no room."""


class Killed(BaseException):
    """The process is dead; no handler of ordinary errors sees this."""


class FaultyDisk:
    """Faults below one folder.

    Parameters
    ----------
    root : folder; elsewhere nothing happens
    fault : of `FAULTS`, or None
    at : step at which it strikes, from 1 [1]
    meanwhile : called once, before that step, in place of the fault where there is none: another process
    seed : of what a power cut takes with it
    """

    def __init__(
        self,
        root: Path,
        fault: str | None = None,
        at: int = 0,
        meanwhile: Callable[[], None] | None = None,
        seed: int = 0,
    ):
        self.root, self.fault, self.at, self.meanwhile = str(root), fault, at, meanwhile
        self.steps, self.dead, self.struck = 0, False, False
        self._suspended = False
        self._draw = random.Random(seed)
        self._unflushed_files: dict[str, None] = {}
        self._names = count()
        self._unflushed_entries: list[tuple[str, Callable[[], None]]] = []

    def __enter__(self) -> "FaultyDisk":
        self._stack = ExitStack()
        self._real = {
            name: getattr(os, name)
            for name in ("mkdir", "rmdir", "unlink", "remove", "replace", "rename", "open", "fsync")
        }
        self._real_open = io.open
        for name in self._real:
            self._stack.enter_context(mock.patch.object(os, name, getattr(self, f"_{name}")))
        self._stack.enter_context(mock.patch.object(io, "open", self._io_open))
        # the same sequence has to go the same way: no names at random
        names = (f"{number:08d}" for number in self._names)
        self._stack.enter_context(mock.patch.object(tempfile, "_get_candidate_names", lambda: names))
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _is_below(self, path: Any, dir_fd: int | None = None) -> bool:
        if self._suspended or isinstance(path, int):
            return False
        return dir_fd is not None or os.path.abspath(os.fspath(path)).startswith(self.root)

    def _step(self, kind: str, path: Any) -> None:
        """Count a change, and fail where it is its turn."""
        if self.dead:
            raise Killed
        self.steps += 1
        if self.struck and self.fault == FULL and kind in _GROWING:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        if self.steps != self.at:
            return
        if self.fault in _ERRORS:
            self.struck = True
            code = _ERRORS[self.fault]
            raise OSError(code, os.strerror(code), str(path))
        if self.fault in {KILLED, POWER_CUT} or (self.fault == TORN and kind != "write"):
            self._die()
        if self.meanwhile is not None:
            self._suspended = True
            try:
                self.meanwhile()
            finally:
                self._suspended = False

    def _die(self) -> None:
        self.struck = self.dead = True
        if self.fault == POWER_CUT:
            self._suspended = True
            self._lose_what_was_not_flushed()
            self._suspended = False
        raise Killed

    def _lose_what_was_not_flushed(self) -> None:
        for path in list(self._unflushed_files):
            if self._draw.random() < 0.5 and os.path.isfile(path):
                with self._real_open(path, "r+b") as stream:
                    stream.truncate(self._draw.randrange(os.path.getsize(path) + 1))
        for _, undo in reversed(self._unflushed_entries):
            if self._draw.random() < 0.5:
                undo()

    def _remember(self, path: Any, undo: Callable[[], None]) -> None:
        self._unflushed_entries.append((os.path.dirname(os.path.abspath(os.fspath(path))), undo))

    def _content(self, path: Any) -> bytes | None:
        try:
            with self._real_open(path, "rb") as stream:
                return stream.read()
        except OSError:
            return None

    def _restore(self, path: str, content: bytes | None) -> Callable[[], None]:
        def undo() -> None:
            if content is None:
                if os.path.isfile(path):
                    self._real["unlink"](path)
            elif os.path.isdir(os.path.dirname(path)):
                with self._real_open(path, "wb") as stream:
                    stream.write(content)

        return undo

    def _mkdir(self, path: Any, mode: int = 0o777, *, dir_fd: int | None = None) -> None:
        if self._is_below(path, dir_fd):
            self._step("mkdir", path)
        self._real["mkdir"](path, mode, dir_fd=dir_fd)
        if self._is_below(path, dir_fd):
            self._remember(path, lambda: shutil.rmtree(path, ignore_errors=True))

    def _rmdir(self, path: Any, *, dir_fd: int | None = None) -> None:
        if self._is_below(path, dir_fd):
            self._step("rmdir", path)
        self._real["rmdir"](path, dir_fd=dir_fd)

    def _unlink(self, path: Any, *, dir_fd: int | None = None) -> None:
        below = self._is_below(path, dir_fd)
        if below:
            self._step("unlink", path)
        content = self._content(path) if below and dir_fd is None else None
        self._real["unlink"](path, dir_fd=dir_fd)
        if content is not None:
            self._remember(path, self._restore(os.path.abspath(os.fspath(path)), content))

    _remove = _unlink

    def _replace(self, source: Any, target: Any, **kwargs: Any) -> None:
        below = self._is_below(target)
        if below:
            self._step("replace", target)
        before = self._content(target) if below else None
        self._real["replace"](source, target, **kwargs)
        if below:
            place, origin = os.path.abspath(os.fspath(target)), os.path.abspath(os.fspath(source))
            if origin in self._unflushed_files:
                del self._unflushed_files[origin]
                self._unflushed_files[place] = None
            self._remember(target, self._restore(place, before))

    _rename = _replace

    def _open(self, path: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        if flags & os.O_CREAT and self._is_below(path, dir_fd) and not os.path.lexists(path):
            self._step("open", path)
        descriptor: int = self._real["open"](path, flags, mode, dir_fd=dir_fd)
        return descriptor

    def _fsync(self, descriptor: int) -> None:
        path = os.readlink(f"/proc/self/fd/{descriptor}")
        if not self._is_below(path):
            return
        self._step("fsync", path)
        # nothing is flushed in truth: it costs time, and the faults are ours
        self._unflushed_files.pop(path, None)
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            self._unflushed_entries = [entry for entry in self._unflushed_entries if entry[0] != path]

    def _io_open(self, path: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
        writes = set(mode) & set("wxa+")
        if not (writes and self._is_below(path)):
            return self._real_open(path, mode, *args, **kwargs)
        self._step("open", path)
        stream = self._real_open(path, mode, *args, **kwargs)
        self._unflushed_files[os.path.abspath(os.fspath(path))] = None
        real_write = stream.write

        def write(content: Any) -> int:
            try:
                self._step("write", path)
            except OSError:
                real_write(content[: len(content) // 2])
                raise
            if self.fault == TORN and self.steps == self.at:
                real_write(content[: self._draw.randrange(len(content) + 1)])
                stream.flush()
                self._die()
            return int(real_write(content))

        return _Stream(stream, write)


class _Stream:
    """A stream whose writes are steps."""

    def __init__(self, stream: Any, write: Callable[[Any], int]):
        self._stream, self.write = stream, write

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __enter__(self) -> "_Stream":
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()
