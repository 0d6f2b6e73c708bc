"""Progress of a flow run on Prefect's pages: rows in its log, and a progress artifact."""

import time
from typing import cast
from uuid import UUID

import httpx
from prefect.artifacts import create_progress_artifact, update_progress_artifact
from prefect.exceptions import PrefectException
from prefect.logging import get_run_logger

from flows.running.progress import describe_piece
from flows.running.terminal import escape_controls

EVERY_S = 5.0
"""Between two rows of a log; the first, the last and those of failures come at once."""
KEY = "musync-progress"


class RunProgress:
    """A watcher for `flows.running.progress.watch_progress` within a flow run."""

    def __init__(self) -> None:
        self._artifact: UUID | None = None
        self._told = 0.0

    def __call__(self, title: str, done: int, total: int, name: str, failed: bool) -> None:
        """Tell Prefect of a finished piece of work, if the last word is `EVERY_S` ago.

        Parameters
        ----------
        title, done, total, name, failed : as of `flows.running.progress.Watcher`
        """
        edge = done in (0, total)
        if not (failed or edge) and time.monotonic() - self._told < EVERY_S:
            return
        line = escape_controls(f"{title} {done}/{total} {describe_piece(name, failed)}".rstrip())
        (get_run_logger().warning if failed else get_run_logger().info)(line)
        # of ten thousand failures each gets its row, and not a call of the server too
        if failed and not edge:
            return
        self._told = time.monotonic()
        if done == 0:
            self._artifact = None
        try:
            self._show(100.0 * done / total if total else 100.0, line)
        except (httpx.HTTPError, PrefectException) as error:  # the run is worth more than its picture
            get_run_logger().warning("the progress artifact could not be written: %s", error)

    def _show(self, percent: float, line: str) -> None:
        if self._artifact is None:
            # without an event loop Prefect answers with the id itself
            self._artifact = cast(UUID, create_progress_artifact(percent, key=KEY, description=line))
        else:
            update_progress_artifact(self._artifact, percent, description=line)
