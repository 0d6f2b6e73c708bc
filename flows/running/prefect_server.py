"""Prefect on this machine: quiet, in a home that only its user can read, with a server that wants a password.

Whoever may talk to the server starts runs, and with them code. The server ends with the process that started it,
however that ends.
"""

import os
import secrets
import signal
import socket
import stat
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

from tasks.errors import InputError

API, HOME = "PREFECT_API_URL", "PREFECT_HOME"
PASSWORDS = ("PREFECT_SERVER_API_AUTH_STRING", "PREFECT_API_AUTH_STRING")
"""What the server asks for, and what its clients give."""
QUIET_AND_LOCAL = {
    "DO_NOT_TRACK": "1",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    # rows of a run's log on the server; on the terminal the command says in a sentence why a run ended
    "PREFECT_LOGGING_LEVEL": "INFO",
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",
    "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
    # the server's own pages are of its origin; this one is nobody's
    "PREFECT_SERVER_CORS_ALLOWED_ORIGINS": "https://musync.invalid",
}
START_S, STOP_S = 300.0, 30.0


def set_up_prefect() -> None:
    """Set what Prefect reads when it is imported, where the user has not, and make its home private.

    Without ``PREFECT_API_URL`` any server of this process and its children is one of this machine: it gets a password
    that they alone know, unless the user has given one.

    Raises
    ------
    InputError
        If the home is somebody else's, or no folder.
    """
    for name, value in QUIET_AND_LOCAL.items():
        os.environ.setdefault(name, value)
    named = HOME in os.environ
    home = Path(os.environ.setdefault(HOME, str(Path.cwd() / ".musync" / "prefect")))
    _make_private(home, shared=named)
    if API not in os.environ:
        given = next((os.environ[name] for name in PASSWORDS if os.environ.get(name)), None)
        os.environ |= dict.fromkeys(PASSWORDS, given or secrets.token_urlsafe(32))
        # before Prefect makes it for all to read; what it puts beside it gets the same mode
        with _open_private(home / "prefect.db"):
            pass


def _make_private(home: Path, shared: bool) -> None:
    """Make Prefect's home; one that the user has named keeps its mode."""
    if not os.path.lexists(home):
        home.parent.mkdir(parents=True, exist_ok=True)
        home.mkdir(mode=0o700)
    facts = home.lstat()
    if not shared and (not stat.S_ISDIR(facts.st_mode) or facts.st_uid != os.geteuid()):
        raise InputError(
            f"{home}: must be a folder of your own, because Prefect keeps there what runs have said; it is another"
            f" user's, a link or a file: remove it, work in a folder of your own, or name another home with {HOME}"
        )
    if not shared:
        home.chmod(0o700)


@contextmanager
def _open_private(path: Path) -> Iterator[int]:
    """Open a file that only its owner can read, and create it where it is missing; no link is followed."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
    try:
        os.fchmod(descriptor, 0o600)
        yield descriptor
    finally:
        os.close(descriptor)


@contextmanager
def prefect_api(*, pages: bool) -> Iterator[None]:
    """A Prefect server for the length of the block; the one that ``PREFECT_API_URL`` names where it names one.

    Parameters
    ----------
    pages : whether it shows its pages and starts what is due; False only keeps what runs report to it
    """
    set_up_prefect()  # before Prefect is imported anywhere: it reads its settings then
    if API in os.environ:
        yield
        return
    # bound here and handed on: no other process can come between and ask the clients for their password
    with socket.create_server(("127.0.0.1", 0), backlog=2048) as door:
        address = f"http://127.0.0.1:{door.getsockname()[1]}"
        password = _name_password_file(door)
        # the pipe ends with this process; without -P a prefect.py in the working folder would be run
        server = subprocess.Popen(
            [sys.executable, "-P", "-m", "flows.running.prefect_server", str(door.fileno()), str(int(pages))],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[door.fileno()],
            start_new_session=True,
        )
    os.environ[API] = f"{address}/api"
    try:
        _wait_until_healthy(server, f"{address}/api/health")
        if pages:
            with _open_private(password) as descriptor:
                os.write(descriptor, f"{os.environ[PASSWORDS[1]]}\n".encode())
            print(f"Prefect's pages: {address} (their password is in {password})", file=sys.stderr)
        yield
    finally:
        server.terminate()
        try:
            server.wait(STOP_S)
        except subprocess.TimeoutExpired:
            server.kill()
        password.unlink(missing_ok=True)
        del os.environ[API]


def _name_password_file(door: socket.socket) -> Path:
    """Where the password of the server at a socket lies for its user."""
    return Path(os.environ[HOME]) / f"password-{door.getsockname()[1]}"


def _wait_until_healthy(server: "subprocess.Popen[bytes]", address: str) -> None:
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline:
        if server.poll() is not None:
            raise RuntimeError(
                f"the Prefect server ended with exit code {server.returncode} before it answered"
            )
        try:
            urllib.request.urlopen(address, timeout=2).close()  # noqa: S310  (our own server on loopback)
            return
        except OSError:
            time.sleep(0.3)
    raise RuntimeError(f"the Prefect server did not answer within {START_S:g} s")


def serve(door: int, pages: bool) -> None:
    """Be the server: answer at a socket that is bound already, until the process that holds our input ends.

    Parameters
    ----------
    door : descriptor of the socket
    pages : as of `prefect_api`
    """

    listener = socket.socket(fileno=door)

    def wait() -> None:
        sys.stdin.buffer.read()
        _name_password_file(listener).unlink(missing_ok=True)  # whoever wrote it may have been killed
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(STOP_S)
        os._exit(1)

    Thread(target=wait, daemon=True).start()
    import uvicorn
    from prefect.server.api.server import create_app

    app = create_app(ephemeral=not pages, final=True)
    uvicorn.Server(uvicorn.Config(app, log_level="error")).run([listener])


if __name__ == "__main__":
    serve(int(sys.argv[1]), bool(int(sys.argv[2])))
