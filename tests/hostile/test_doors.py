"""The services of a schedule let in nobody but who started it, and end with it.

One schedule is started for all the tests; the attacks are those of another user, where we may become one. Those on the
cluster of a run stand in tests/flows/running/test_runner.py, which has one.
"""

import json
import os
import re
import signal
import stat
import subprocess
import sys
import time
import urllib.error
import urllib.request
from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
import pytest

from flows.running.prefect_server import set_up_prefect
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError
from tests.hostile.other_user import run_as_other

GRID = "name: tiny\nframes: 2\npictures: false\ncamera: dashcam-480x320\naxes: {weather: {dry: {weather: dry}}}\n"
TRAP = "open({!r}, 'w').write('run')\n"
ADDRESS = re.compile(r"(http://\S+) \(their password is in (.*)\)")
START_S = 600


@dataclass(frozen=True)
class Served:
    """A schedule that is being served.

    Parameters
    ----------
    folder : in which it was started
    process : that serves it
    address : of its server
    password : of its server
    """

    folder: Path
    process: psutil.Process
    address: str
    password: str

    @property
    def home(self) -> Path:
        return self.folder / ".musync" / "prefect"


@pytest.fixture(scope="module")
def served():
    """A schedule that never falls due, in a folder where a stranger has put modules with the names of libraries."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PREFECT")}
    with TemporaryDirectory() as name:  # pytest's own folders are closed to other users
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "grid.yaml").write_text(GRID)
        for module in ("prefect", "multiprocessing", "uvicorn"):
            (folder / f"{module}.py").write_text(TRAP.format(str(folder / "trapped")))
        with (folder / "said").open("w") as said:
            process = subprocess.Popen(
                [Path(sys.executable).with_name("musync"), "schedule", "grid.yaml", "--every", "0 3 1 1 *",
                 "--out", "runs", "--runner", "threads", "--notify", "true served"],
                cwd=folder, stderr=said, umask=0, env=clean | {"PYTHONPATH": str(SOURCE_ROOT)},
            )  # fmt: skip
        try:
            until = time.monotonic() + START_S
            while (told := ADDRESS.search((folder / "said").read_text())) is None:
                assert process.poll() is None and time.monotonic() < until, (folder / "said").read_text()
                time.sleep(0.1)
            password = Path(told[2]).read_text().strip()
            yield Served(folder, psutil.Process(process.pid), told[1], password)
        finally:
            process.kill()
            process.wait()


def ask(
    served: Served, path: str, content: object, password: str | None = None
) -> tuple[int, dict[str, str], str]:
    """Status, headers and body of what the server answers."""
    headers = {"Content-Type": "application/json", "Origin": "https://evil.example"}
    if password is not None:
        headers["Authorization"] = f"Basic {b64encode(password.encode()).decode()}"
    request = urllib.request.Request(f"{served.address}/api/{path}", json.dumps(content).encode(), headers)
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return answer.status, dict(answer.headers), answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, dict(error.headers), error.read().decode()


def wait_for_deployment(served: Served) -> dict:
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        status, headers, body = ask(served, "deployments/filter", {}, served.password)
        assert status == 200 and "access-control-allow-origin" not in {name.lower() for name in headers}
        if found := json.loads(body):
            return found[0]
        time.sleep(0.2)
    raise AssertionError("the schedule is not registered")


def test_another_user_posts_no_run_to_a_schedule(served):
    attack = """
import urllib.request
request = urllib.request.Request(sys.argv[1] + "/api/flow_runs/filter", b"{}", {"Content-Type": "application/json"})
try:
    urllib.request.urlopen(request, timeout=30)
    print("let in")
except urllib.error.HTTPError as error:
    print(error.code)
"""
    assert (
        run_as_other(attack, served.address, imports="import encodings.idna, urllib.error, urllib.request")
        == "401"
    )


def test_without_the_password_or_with_another_nobody_is_let_in_and_no_page_may_ask(served):
    for password in (None, "", "admin:pass", served.password[:-1]):
        assert ask(served, "deployments/filter", {}, password)[0] == 401
    deployment = wait_for_deployment(served)
    assert "notify" not in json.dumps(deployment["parameters"]) and "served" not in json.dumps(deployment)


def test_another_user_reads_neither_home_nor_database_nor_password(served):
    places = [served.home, served.home / "prefect.db", *served.home.glob("password-*")]
    attack = (
        "print(os.listdir(sys.argv[1]) if os.path.isdir(sys.argv[1]) else open(sys.argv[1], 'rb').read(9))"
    )
    assert len(places) == 3
    for place in places:
        assert stat.S_IMODE(place.stat().st_mode) & 0o077 == 0, place
        assert run_as_other(attack, str(place)) == "PermissionError"


def test_the_password_stands_in_no_command_line_and_nothing_of_the_folder_is_run(served):
    family = [served.process, *served.process.children(recursive=True)]
    assert len(family) >= 2
    assert not [line for process in family for line in process.cmdline() if served.password in line]
    assert not (served.folder / "trapped").exists()


def test_the_server_ends_with_a_schedule_that_is_killed_and_leaves_no_password(served):
    family = served.process.children(recursive=True)
    assert any("flows.running.prefect_server" in process.cmdline() for process in family)
    served.process.send_signal(signal.SIGKILL)
    _, alive = psutil.wait_procs(family, timeout=20)
    assert not [process.cmdline() for process in alive]
    assert not [*served.home.glob("password-*")]


def test_a_home_of_somebody_else_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "environ", {"PATH": os.environ["PATH"]})
    (tmp_path / ".musync").mkdir()
    (tmp_path / "theirs").mkdir()
    (tmp_path / ".musync" / "prefect").symlink_to(tmp_path / "theirs")
    with pytest.raises(InputError, match="must be a folder of your own"):
        set_up_prefect()
    assert not any((tmp_path / "theirs").iterdir())
