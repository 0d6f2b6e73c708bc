"""The order in which workers compile, the place of data outside the repository, and a small finished dataset."""

import gc
import io
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, suppress
from pathlib import Path

import pytest
from filelock import FileLock, Timeout
from hypothesis import HealthCheck, settings

# small matrices: more threads than one cost twice the time (read by numpy when it is first imported)
for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(library, "1")

# Python looks for garbage again and again among all that is imported, and finds none: a third of what collecting costs
gc.disable()

# on a machine that other work keeps busy an example may take seconds: that is no fault of what is tested
settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")

DATA = Path(os.environ.get("MUSYNC_DATA", Path(__file__).resolve().parents[2] / "shared"))


@pytest.hookimpl(wrapper=True)
def pytest_collection(session):
    """Let one worker compile what all tests import while the other compiles the kernels, and then change places.

    Python keeps the bytecode of a file that it imports for the first time, and Numba a kernel's machine code: the
    worker that comes second reads both. Two workers that start with the same do everything twice.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is None:
        return (yield)
    shared = Path(session.config.option.basetemp).parent
    if worker != "gw0":
        compile_kernels(shared, ["rasteriser", "vehicle", "pose_solver"], wait=False)
    with FileLock(shared / "collected.lock") as lock:
        if (shared / "collected").exists():
            lock.release()  # there is nothing left to compile: all others import at once
        collected = yield
        (shared / "collected").touch()
    if worker == "gw0":
        compile_kernels(shared, ["rasteriser", "vehicle", "rain"], wait=True)
    return collected


def compile_kernels(shared: Path, names: Sequence[str], *, wait: bool) -> None:
    """Compile large kernels that no other worker has compiled.

    Parameters
    ----------
    shared : folder of all workers
    names : of `tests.kernels`, each of which may need those before it
    wait : until another worker has compiled what it compiles now; else that is passed over
    """
    from tests import kernels

    for name in names:
        with suppress(Timeout), FileLock(shared / f"{name}.lock", timeout=-1 if wait else 0):
            if (shared / name).exists():
                continue
            with (
                tempfile.TemporaryDirectory() as folder,
                own_notes(Path(folder)),
                redirect_stderr(io.StringIO()),
            ):
                getattr(kernels, f"compile_{name}")(Path(folder))
            (shared / name).touch()


def pytest_collection_finish() -> None:
    """From here on garbage is collected, and looked for in what the tests make."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish() -> None:
    """Let an extension that counts its objects at the end, and complains of them, find none."""
    gc.unfreeze()


@contextmanager
def own_notes(folder: Path) -> Iterator[None]:
    """Keep the notes of where scenes lie in a folder, and not in the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flows.making.locations.cache_root", lambda: folder)
        yield


@pytest.fixture(scope="session", autouse=True)
def own_notes_of_places(tmp_path_factory):
    """Equal scenes of two test processes lie in two places, and a test changes its own: each process notes its own."""
    with own_notes(tmp_path_factory.mktemp("notes")):
        yield


@pytest.fixture
def outside_data() -> Path:
    """The folder with reference/ and measured/; skips where it is absent."""
    if not (DATA / "reference").is_dir():
        pytest.skip(
            f"no reference data at {DATA}; set MUSYNC_DATA to the folder that holds reference/ and measured/"
        )
    return DATA


@pytest.fixture(scope="session")
def toy_dataset(tmp_path_factory):
    """A small finished dataset that tests of its readers share; who changes files takes a copy.

    Beside it lie its ``grid.yaml``, ``camera.yaml`` and ``scene``.
    """
    from flows.making.generate import generate_dataset
    from tests.toy_street import write_toy_grid

    folder = tmp_path_factory.mktemp("toy")
    grid = write_toy_grid(folder, frames=11)
    return generate_dataset(grid, str(folder / "data"), runner="threads", workers=2).layout
