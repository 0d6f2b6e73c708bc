"""Tell somebody of a run: by a command, by a web address that takes JSON, or by any service that Apprise knows."""

import logging
import os
import shlex
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, unquote, urlsplit

EVENTS = ("failed", "late", "done")
"""Events that a schedule can report."""
WHEN_NONE_IS_NAMED = "failed,late"
TIMEOUT_S = 60.0
FROM_ENVIRONMENT = "env:"
"""Before the name of a variable that holds the address, so that no secret stands in a command line or a database."""


class NoticeFailed(RuntimeError):
    """The service did not take a notification."""


def send_notice(notify: str, event: str, facts: Mapping[str, str], report: Path) -> None:
    """Send the facts of a run.

    Parameters
    ----------
    notify : command, which gets the report's path as its last argument; http(s) address, which gets the facts as JSON;
        Apprise address (mailto://, slack://, ...); or env:NAME for the variable that holds one of these
    event : of `EVENTS`
    facts : lines of the report by their keys, of which ``what`` is the title
    report : file that holds them

    Raises
    ------
    NoticeFailed, OSError, subprocess.SubprocessError
        If it could not be sent.
    """
    target = read_target(notify)
    if "://" not in target.partition(" ")[0]:
        subprocess.run([*shlex.split(target), str(report)], check=True, timeout=TIMEOUT_S)
        return
    import apprise

    kind = apprise.NotifyType.FAILURE if event == "failed" else apprise.NotifyType.INFO
    body = "\n".join(f"{key}: {value}" for key, value in facts.items() if key != "what")
    with apprise.LogCapture(level=logging.WARNING) as log:
        service = _find_service(target, {**facts, "event": event, "report": str(report)})
        taken = service is not None and apprise.Apprise(service).notify(
            body, title=f"muSync: {facts['what']}", notify_type=kind, body_format=apprise.NotifyFormat.TEXT
        )
        if not taken:
            raise NoticeFailed(
                " ".join(log.getvalue().split()) or "no service of Apprise has such an address"
            )


def read_target(notify: str) -> str:
    """The command or address itself; empty for a variable that is not set."""
    name = notify.removeprefix(FROM_ENVIRONMENT)
    return notify if name == notify else os.environ.get(name, "")


def notify_problem(notify: str) -> str | None:
    """The sentence for a notification that can never be sent; None for one that may."""
    target = read_target(notify)
    if not target:
        return f"--notify must name a variable that is set; {notify!r} is empty"
    if "://" in target.partition(" ")[0]:
        found = _find_service(target, {}) is not None
    else:
        try:
            words = shlex.split(target)
        except ValueError:  # a quotation that does not end
            words = []
        found = bool(words) and shutil.which(words[0]) is not None
    if found:
        return None
    return (
        "--notify must be a command that exists, an http(s) address, an address that Apprise knows (mailto://, slack://,"
        f" msteams://, ...), or env:NAME of a variable that holds one; it is {notify!r}"
    )


def _find_service(target: str, facts: Mapping[str, str]) -> Any:
    """The service of an address; None where Apprise knows none. A plain web address gets the facts as JSON."""
    import apprise

    if not target.startswith(("http://", "https://")):
        return apprise.Apprise.instantiate(target)
    parts = urlsplit(target)
    return apprise.Apprise.instantiate(
        {
            "schema": "jsons" if parts.scheme == "https" else "json",
            "host": parts.hostname,
            "port": parts.port,
            "user": None if parts.username is None else unquote(parts.username),
            "password": None if parts.password is None else unquote(parts.password),
            "fullpath": parts.path or "/",
            "params": dict(parse_qsl(parts.query, keep_blank_values=True)),
            "payload": dict(facts),
        }
    )
