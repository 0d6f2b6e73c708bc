"""Report a scheduled run that failed, is late or has ended: in a file, and to whoever asked to be notified."""

import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from flows.running.terminal import escape_controls
from flows.scheduled.notification import WHEN_NONE_IS_NAMED, NoticeFailed, send_notice
from flows.scheduled.run_record import LOCAL
from flows.store.objects import Objects, is_address
from flows.store.outputs import Outputs
from tasks.errors import InputError

REPORTS = "reports"
WHAT = {
    "failed": "a scheduled run failed",
    "late": "a scheduled run is late",
    "done": "a scheduled run has made its dataset",
}


def report_failure(grid: str, root: str, at: datetime, error: BaseException, notify: str | None) -> Path:
    """Write a report of a failed run, and send the notification; return the report's path.

    Parameters
    ----------
    grid, root, at : of the run
    error : what ended it
    notify : as of `flows.scheduled.notification.send_notice`; None notifies nobody
    """
    facts = {
        "error": f"{type(error).__name__}: {error}",
        "next": "committed clips are kept; the next run of the schedule makes what is missing",
    }
    return report_run("failed", grid, root, at, facts, notify)


def report_run(
    event: str, grid: str, root: str, at: datetime, further: Mapping[str, str], notify: str | None
) -> Path:
    """Write a report of a run, and send the notification; return the report's path.

    Under an address in an object store the report is an object too, and the file lies under the working folder.

    Parameters
    ----------
    event : of `flows.scheduled.notification.EVENTS`
    grid, root, at : of the run
    further : facts of the report, by their keys
    notify : as of `flows.scheduled.notification.send_notice`; None notifies nobody. What cannot be sent is noted in the
        report
    """
    name = report_name(at, event)
    report = Outputs((LOCAL if is_address(root) else Path(root)).resolve(), "schedule", name)
    facts = {
        "what": WHAT[event],
        "grid": grid,
        "root": root,
        "scheduled": at.astimezone(UTC).isoformat(),
        **further,
    }
    # what failed may say anything, but a line of its own it does not get
    facts = {key: escape_controls(value) for key, value in facts.items()}
    text = "".join(f"{key}: {value}\n" for key, value in facts.items())
    report.write(name, text)
    path = report.path(name)
    if notify is not None:
        try:
            send_notice(notify, event, facts, path)
        except (NoticeFailed, OSError, subprocess.SubprocessError) as fault:
            text += escape_controls(f"notification {_without_secrets(notify)} failed: {fault}") + "\n"
            report.write(name, text)
    if is_address(root):
        try:
            Objects(root).write(name, text.encode())
        except InputError as fault:  # the store may be what failed
            report.write(name, text + escape_controls(f"the report could not be sent: {fault}") + "\n")
    return path


def wants_notice(event: str, notify_on: str = WHEN_NONE_IS_NAMED) -> bool:
    """Whether a schedule notifies of an event, by the value of ``--notify-on``."""
    return event in (word.strip() for word in notify_on.split(","))


def report_name(at: datetime, event: str = "failed") -> str:
    """Name of a report below the schedule's folder; that of a failure is the run's time alone."""
    return f"{REPORTS}/{format_stamp(at)}{'' if event == 'failed' else f'-{event}'}.txt"


def _without_secrets(notify: str) -> str:
    scheme, found, _ = notify.partition("://")
    return f"by {scheme}://..." if found and " " not in scheme else notify


def format_stamp(at: datetime) -> str:
    """A time as names of datasets and reports carry it: UTC, to the second."""
    return f"{at.astimezone(UTC):%Y%m%dT%H%M%SZ}"
