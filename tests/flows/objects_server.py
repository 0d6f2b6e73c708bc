"""A real S3 server on loopback, as a process of its own, and runs of the command against it."""

import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

START_S = 60.0


@contextmanager
def s3_server(folder: Path) -> Iterator[str]:
    """The server's address, with the bucket ``data``; skips where the packages are missing."""
    for package in ("obstore", "moto", "flask_cors"):
        pytest.importorskip(package, reason=f"{package} is not installed: pip install 'musync-gs[s3,dev]'")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with (folder / "server.log").open("w") as log:
        server = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, start_new_session=True)
    address = f"http://127.0.0.1:{port}"
    try:
        _wait(server, f"{address}/moto-api/")
        ask(f"{address}/data", "PUT")
        yield address
    finally:
        server.terminate()
        server.wait(20)


def ask(address: str, method: str, body: bytes | None = None) -> None:
    request = urllib.request.Request(address, body, {"Content-Type": "text/plain"}, method=method)
    urllib.request.urlopen(request, timeout=10).close()


def environment(server: str, cache: Path) -> dict[str, str]:
    """Of a machine that knows the server and has a cache of its own."""
    return {
        "AWS_ENDPOINT_URL": server,
        "AWS_REGION": "us-east-1",
        "AWS_ACCESS_KEY_ID": "somebody",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "MUSYNC_CACHE": str(cache),
    }


def start(arguments: list[str], variables: dict[str, str]) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "flows.cli", *arguments],
        env=os.environ | variables, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def kill(process: "subprocess.Popen[str]") -> None:
    """The whole group at once, as when the machine goes off."""
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def _wait(server: "subprocess.Popen[bytes]", address: str) -> None:
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline and server.poll() is None:
        try:
            urllib.request.urlopen(address, timeout=2).close()
            return
        except OSError:
            time.sleep(0.2)
    pytest.skip("the S3 server (moto) does not start here")
