"""Progress for people: a bar with the time left on a terminal, one line a clip elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

Advance = Callable[[str], None]


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Advance]:
    """Yield a function that is told the name of each finished piece of work."""
    console = Console(stderr=True)
    if not sys.stderr.isatty():
        done = 0

        def report(name: str) -> None:
            nonlocal done
            done += 1
            console.print(f"{title} {done}/{total} {name}", highlight=False)

        yield report
        return
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("elapsed"),
        TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(), TextColumn("{task.fields[last]}"),
    )  # fmt: skip
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(title, total=total, last="")
        yield lambda name: bar.update(task, advance=1, last=name)
