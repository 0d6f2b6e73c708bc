"""A Python that has imported the libraries once and runs each group of tests in a copy of itself.

To import NumPy, SciPy, Numba and PyTorch takes longer than most groups of tests. The copy (a fork) imports nothing of
the project from its parent, so that it sees the changed sources.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

LIBRARIES = (
    "numpy", "scipy.optimize", "scipy.signal", "scipy.spatial.transform", "scipy.stats", "scipy.ndimage", "numba",
    "torch", "cv2", "pyarrow.parquet", "pandas", "pydantic", "yaml", "typer", "zarr", "duckdb", "matplotlib.pyplot",
    "av", "dask", "hypothesis", "pytest",
)  # fmt: skip
"""Modules that are imported before the tests of any change."""
POLL_S = 0.05
"""Time between two looks at whether the tests have ended [s]."""


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a group of tests ended.

    Parameters
    ----------
    code : exit code of pytest; None where the time was up, -SIGXCPU where the work was spent
    output : what it printed
    cpu_s : work of its processes [s]
    """

    code: int | None
    output: str
    cpu_s: float


class WarmPython:
    """A process that answers each request for a group of tests with its end."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def run_tests(
        self,
        tree: Path,
        arguments: list[str],
        environment: Mapping[str, str],
        *,
        longest_s: float,
        most_cpu_s: float,
    ) -> Ended:
        """Run pytest in a tree of sources.

        Parameters
        ----------
        tree : root of the sources and tests
        arguments : of pytest
        environment : variables beside those of this process
        longest_s : time after which the tests are killed [s]
        most_cpu_s : work after which they are ended [s]

        Raises
        ------
        EOFError
            If the process has ended.
        """
        asked = {
            "tree": str(tree),
            "arguments": arguments,
            "environment": dict(environment),
            "longest_s": longest_s,
            "most_cpu_s": most_cpu_s,
        }
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise EOFError("the process that runs the tests has ended")
        return Ended(**json.loads(answer))


@contextmanager
def start_warm_python(libraries: tuple[str, ...] = LIBRARIES) -> Iterator[WarmPython]:
    """Give a process that has imported libraries; it ends with the block.

    Parameters
    ----------
    libraries : names of modules
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "studies.mutants.warm_python", *libraries],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        yield WarmPython(process)
    finally:
        process.terminate()
        process.communicate()


def _answer_requests(libraries: list[str]) -> None:
    """Import libraries, then answer a request a line until the input ends."""
    for library in libraries:
        import_module(library)
    signal.signal(signal.SIGTERM, _end_with_tests)
    for line in sys.stdin:
        print(json.dumps(_run_in_copy(**json.loads(line)).__dict__), flush=True)


_running: set[int] = set()
"""The group of processes of the tests under way."""


def _end_with_tests(*_: object) -> None:
    for group in _running:
        os.killpg(group, signal.SIGKILL)
    os._exit(0)


def _run_in_copy(
    tree: str, arguments: list[str], environment: dict[str, str], longest_s: float, most_cpu_s: float
) -> Ended:
    with tempfile.TemporaryFile() as output:
        before, copy = os.times(), os.fork()
        if copy == 0:
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (max(1, round(most_cpu_s)), resource.RLIM_INFINITY))
            _become_pytest(tree, arguments, environment, output.fileno())
        _running.add(copy)
        code, deadline = None, time.monotonic() + longest_s
        while True:
            ended, status = os.waitpid(copy, os.WNOHANG)
            if ended:
                code = os.waitstatus_to_exitcode(status)
                break
            if time.monotonic() > deadline:
                os.killpg(copy, signal.SIGKILL)  # with the processes that the tests started
                os.waitpid(copy, 0)
                break
            time.sleep(POLL_S)
        _running.discard(copy)
        after = os.times()
        output.seek(0)
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        return Ended(code=code, output=output.read().decode(errors="replace"), cpu_s=spent)


def _become_pytest(tree: str, arguments: list[str], environment: dict[str, str], output: int) -> None:
    """Run pytest in this copy and end it."""
    code = 70
    try:
        os.setsid()
        for stream in (1, 2):
            os.dup2(output, stream)
        os.environ.update(environment)
        sys.dont_write_bytecode = (
            True  # a change within a second has the size and time of what was compiled before
        )
        os.chdir(tree)
        sys.path[:] = [
            tree,
            *(place for place in sys.path if place not in {"", str(Path(__file__).parents[2])}),
        ]
        projects = {"benchmarks", "studies", "catalogs", "flows", "manifests", "musync", "tasks", "tests"}
        for name in [name for name in sys.modules if name.split(".")[0] in projects]:
            del sys.modules[name]
        if "numba" in sys.modules:
            sys.modules["numba"].config.reload_config()  # it has read the folder of kernels at its import
        import pytest

        code = int(pytest.main(arguments))
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    _answer_requests(sys.argv[1:])
