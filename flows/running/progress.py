"""Progress for people: a bar with the time left on a terminal, one line a clip elsewhere; and for watchers."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from flows.running.terminal import escape_controls, open_console, print_lines

Advance = Callable[[str], None]
Watcher = Callable[[str, int, int, str], None]
"""Called with the title, the pieces done and all pieces [1], and the name of the last one, empty at the beginning."""
FAILED = " failed"
"""End of the name of a piece of work that failed."""
_WATCHERS: ContextVar[tuple[Watcher, ...]] = ContextVar("watchers", default=())


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

    def tell(name: str) -> None:
        for watcher in watchers:
            watcher(title, done, total, name)

    with _shown_bar(title, total) as show:

        def advance(name: str) -> None:
            nonlocal done
            done += 1
            show(name)
            tell(name)

        tell("")
        yield advance


@contextmanager
def _shown_bar(title: str, total: int) -> Iterator[Advance]:
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
