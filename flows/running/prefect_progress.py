"""Progress of a flow run on Prefect's pages: rows in its log, a progress artifact, a table of the pieces of work."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast
from uuid import UUID

import httpx
from prefect.artifacts import create_progress_artifact, create_table_artifact, update_progress_artifact
from prefect.exceptions import PrefectException
from prefect.logging import get_run_logger

from flows.running.progress import Progress, describe_piece, watch_progress
from flows.running.terminal import escape_controls

EVERY_S = 5.0
"""Between two rows of a log; the first, the last and those of failures come at once."""
PROGRESS, PIECES = "musync-progress", "musync-{}"
"""Keys of the artifacts; the second with the title of the work, such as musync-clips."""
MOST_ROWS = 1000
"""Of a table of pieces: the last ones [1]. Prefect's pages show all rows at once."""


@contextmanager
def show_progress() -> Iterator[None]:
    """Show the progress of everything that runs within the block on the pages of the flow run."""
    progress = RunProgress()
    try:
        with watch_progress(progress):
            yield
    finally:
        progress.show_pieces()


class RunProgress:
    """A watcher for `flows.running.progress.watch_progress` within a flow run."""

    def __init__(self) -> None:
        self._artifact: UUID | None = None
        self._reported = 0.0
        self._title = ""
        self._pieces: deque[dict[str, Any]] = deque(maxlen=MOST_ROWS)

    def __call__(self, progress: Progress) -> None:
        """Tell Prefect of a finished piece of work, if the last word is `EVERY_S` ago.

        Parameters
        ----------
        progress : of the work
        """
        done, total, failed = progress.done, progress.total, progress.failed
        if done == 0:
            self.show_pieces()
            self._title, self._artifact = progress.title, None
        elif progress.facts or failed:
            outcome = "failed" if failed else "done"
            self._pieces.append(
                {"name": escape_controls(progress.name), "outcome": outcome, **progress.facts}
            )
        edge = done in (0, total)
        if not (failed or edge) and time.monotonic() - self._reported < EVERY_S:
            return
        line = escape_controls(
            f"{progress.title} {done}/{total} {describe_piece(progress.name, failed)}".rstrip()
        )
        (get_run_logger().warning if failed else get_run_logger().info)(line)
        # of ten thousand failures each gets its row, and not a call of the server too
        if failed and not edge:
            return
        self._reported = time.monotonic()
        with _go_on_without_artifact():
            self._show(100.0 * done / total if total else 100.0, line)

    def show_pieces(self) -> None:
        """Write the table of the pieces of work, the last of them, that no table shows yet."""
        if self._pieces:
            with _go_on_without_artifact():
                key = PIECES.format("".join(c if c.isalnum() else "-" for c in self._title.lower()))
                create_table_artifact(list(self._pieces), key=key, description=self._title)
            self._pieces.clear()

    def _show(self, percent: float, line: str) -> None:
        if self._artifact is None:
            # without an event loop Prefect answers with the id itself
            self._artifact = cast(UUID, create_progress_artifact(percent, key=PROGRESS, description=line))
        else:
            update_progress_artifact(self._artifact, percent, description=line)


@contextmanager
def _go_on_without_artifact() -> Iterator[None]:
    """Go on where Prefect takes no artifact: the run is worth more than its picture."""
    try:
        yield
    except (httpx.HTTPError, PrefectException) as error:
        get_run_logger().warning("an artifact could not be written: %s", error)
