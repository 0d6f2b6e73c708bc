"""Report a scheduled run that failed: in a file, and to a command or a webhook."""

import json
import shlex
import subprocess
import urllib.request
from datetime import UTC, datetime
from pathlib import Path

from flows.running.terminal import escape_controls
from flows.store.objects import Objects, is_address
from flows.store.outputs import Outputs
from tasks.errors import InputError

NOTIFY_TIMEOUT_S = 60.0
REPORTS = "reports"
LOCAL = Path(".musync")
"""Under the working folder: where reports lie of a schedule that writes to an object store."""


def report_failure(grid: str, root: str, at: datetime, error: BaseException, notify: str | None) -> Path:
    """Write a report of a failed run, and call the notification hook; return the report's path.

    Under an address in an object store the report is an object too, and the file lies under the working folder.

    Parameters
    ----------
    grid, root, at : of the run
    error : what ended it
    notify : shell-like command, which gets the report's path as its last argument, or an http(s) address, which
        gets JSON; a hook that fails is noted in the report
    """
    name = f"{REPORTS}/{format_stamp(at)}.txt"
    place = Outputs((LOCAL if is_address(root) else Path(root)).resolve(), "schedule", name)
    facts = {
        "what": "a scheduled muSync run failed",
        "grid": grid,
        "root": root,
        "scheduled": at.astimezone(UTC).isoformat(),
        "error": f"{type(error).__name__}: {error}",
        "next": "committed clips are kept; the next run of the schedule makes what is missing",
    }
    # what failed may say anything, but a line of its own it does not get
    text = "".join(f"{key}: {escape_controls(value)}\n" for key, value in facts.items())
    place.write(name, text)
    path = place.path(name)
    if notify is not None:
        try:
            _call_hook(notify, path, facts)
        except (OSError, subprocess.SubprocessError) as fault:
            text += escape_controls(f"notification {notify} failed: {fault}") + "\n"
            place.write(name, text)
    if is_address(root):
        try:
            Objects(root).write(name, text.encode())
        except InputError as fault:  # the store may be what failed
            place.write(name, text + escape_controls(f"the report could not be sent: {fault}") + "\n")
    return path


def _call_hook(notify: str, report: Path, facts: dict[str, str]) -> None:
    if is_webhook(notify):
        body = json.dumps(facts | {"report": str(report)}).encode()
        # S310: is_webhook lets http and https alone through
        request = urllib.request.Request(notify, body, {"Content-Type": "application/json"})  # noqa: S310
        urllib.request.urlopen(request, timeout=NOTIFY_TIMEOUT_S).close()  # noqa: S310
    else:
        subprocess.run([*shlex.split(notify), str(report)], check=True, timeout=NOTIFY_TIMEOUT_S)


def is_webhook(notify: str) -> bool:
    """Whether a hook is an address that is posted to, and not a command."""
    return notify.startswith(("http://", "https://"))


def format_stamp(at: datetime) -> str:
    """A time as names of datasets and reports carry it: UTC, to the second."""
    return f"{at.astimezone(UTC):%Y%m%dT%H%M%SZ}"
