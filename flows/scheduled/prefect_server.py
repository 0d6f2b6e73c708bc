"""A Prefect server for the length of a schedule, where no other one is named."""

import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

SERVER_START_S = 120.0


@contextmanager
def prefect_api() -> Iterator[None]:
    """A Prefect server for the length of a schedule; the one that ``PREFECT_API_URL`` names where it names one."""
    if "PREFECT_API_URL" in os.environ:
        yield
        return
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    # before Prefect is imported anywhere: it reads its settings then
    os.environ["PREFECT_API_URL"] = f"http://127.0.0.1:{port}/api"
    from flows import prefect_flows  # noqa: F401  (quiets Prefect and puts its home into the project)

    # until the runner takes over, and after it: a process that just ended would leave its server behind
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    command = [sys.executable, "-m", "prefect", "server", "start", "--host", "127.0.0.1", "--port", str(port)]
    server = subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait_until_healthy(server, f"http://127.0.0.1:{port}/api/health")
        print(f"Prefect's pages: http://127.0.0.1:{port}", file=sys.stderr)
        yield
    finally:
        server.terminate()
        try:
            server.wait(30)
        except subprocess.TimeoutExpired:
            server.kill()
        del os.environ["PREFECT_API_URL"]


def _wait_until_healthy(server: "subprocess.Popen[bytes]", address: str) -> None:
    deadline = time.monotonic() + SERVER_START_S
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
    raise RuntimeError(f"the Prefect server did not answer within {SERVER_START_S:g} s")
