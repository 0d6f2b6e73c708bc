"""Progress for people: a bar with the time left on a terminal, one line a clip elsewhere; and for watchers."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from flows.running.terminal import escape_controls, open_console, print_lines

Watcher = Callable[[str, int, int, str, bool], None]
"""Called with the title, the pieces done and all pieces [1], the name of the last one, empty at the beginning, and
whether that one failed."""
_WATCHERS: ContextVar[tuple[Watcher, ...]] = ContextVar("watchers", default=())


class Advance(Protocol):
    """Tells of a finished piece of work."""

    def __call__(self, name: str, *, failed: bool = False) -> None: ...


@contextmanager
def watch_progress(watcher: Watcher) -> Iterator[None]:
    """Tell a watcher of the progress of everything that runs within the block."""
    token = _WATCHERS.set((*_WATCHERS.get(), watcher))
    try:
        yield
    finally:
        _WATCHERS.reset(token)


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Advance]:
    """Yield a function to call with the name of each finished piece of work."""
    done, watchers = 0, _WATCHERS.get()

    def tell(name: str, failed: bool) -> None:
        for watcher in watchers:
            watcher(title, done, total, name, failed)

    with _shown_bar(title, total) as show:

        def advance(name: str, *, failed: bool = False) -> None:
            nonlocal done
            done += 1
            show(describe_piece(name, failed))
            tell(name, failed)

        tell("", False)
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
    with Progress(*columns, console=open_console(error=True)) as bar:
        task = bar.add_task(title, total=total, last="")
        yield lambda name: bar.update(task, advance=1, last=escape_controls(name))
