"""Progress for people: a bar with the time left on a terminal, one line a clip elsewhere; and for watchers."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, Protocol

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar

from flows.running.terminal import escape_controls, open_console, print_lines


@dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a kind of work is, reported at its beginning and after every piece.

    Parameters
    ----------
    title : of the kind of work
    done, total : pieces done, and all pieces [1]
    name : of the last piece; empty at the beginning
    failed : whether that one failed
    facts : of that one, for a table of the pieces
    """

    title: str
    done: int
    total: int
    name: str = ""
    failed: bool = False
    facts: Mapping[str, Any] = field(default_factory=dict)


Watcher = Callable[[Progress], None]
_WATCHERS: ContextVar[tuple[Watcher, ...]] = ContextVar("watchers", default=())


class Advance(Protocol):
    """Tells of a finished piece of work."""

    def __call__(
        self, name: str, *, failed: bool = False, facts: Mapping[str, Any] | None = None
    ) -> None: ...


@contextmanager
def watch_progress(watcher: Watcher) -> Iterator[None]:
    """Report to a watcher the progress of everything that runs within the block."""
    token = _WATCHERS.set((*_WATCHERS.get(), watcher))
    try:
        yield
    finally:
        _WATCHERS.reset(token)


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Advance]:
    """Yield a function to call with the name of each finished piece of work."""
    done, watchers = 0, _WATCHERS.get()

    def report(progress: Progress) -> None:
        for watcher in watchers:
            watcher(progress)

    with _shown_bar(title, total) as show:

        def advance(name: str, *, failed: bool = False, facts: Mapping[str, Any] | None = None) -> None:
            nonlocal done
            done += 1
            show(describe_piece(name, failed))
            report(Progress(title=title, done=done, total=total, name=name, failed=failed, facts=facts or {}))

        report(Progress(title=title, done=done, total=total))
        yield advance


def describe_piece(name: str, failed: bool) -> str:
    """The name of a piece of work in a line for people."""
    return f"{name} failed" if failed else name


@contextmanager
def _shown_bar(title: str, total: int) -> Iterator[Callable[[str], None]]:
    if not sys.stderr.isatty():
        done = 0

        def report(name: str) -> None:
            nonlocal done
            done += 1
            print_lines(f"{title} {done}/{total} {escape_controls(name)}", error=True)

        yield report
        return
    columns = (
        TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TextColumn("elapsed"),
        TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(), TextColumn("{task.fields[last]}", markup=False),
    )  # fmt: skip
    with Bar(*columns, console=open_console(error=True)) as bar:
        task = bar.add_task(title, total=total, last="")
        yield lambda name: bar.update(task, advance=1, last=escape_controls(name))
