"""Where test data outside the repository lies, one thread for linear algebra, and a small finished dataset."""

import gc
import os
from pathlib import Path

import pytest
from filelock import FileLock

# small matrices: more threads than one cost twice the time (read by numpy when it is first imported)
for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(library, "1")

# Python looks for garbage again and again among all that is imported, and finds none: a third of what collecting costs
gc.disable()

DATA = Path(os.environ.get("MUSYNC_DATA", Path(__file__).resolve().parents[2] / "shared"))


def pytest_collection_finish() -> None:
    """From here on garbage is collected, and looked for in what the tests make."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish() -> None:
    """Let an extension that counts its objects at the end, and complains of them, find none."""
    gc.unfreeze()


@pytest.fixture(scope="session", autouse=True)
def own_notes_of_places(tmp_path_factory):
    """Equal scenes of two test processes lie in two places, and a test changes its own: each process notes its own."""
    folder = tmp_path_factory.mktemp("notes")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flows.making.places.cache_root", lambda: folder)
        yield


@pytest.fixture(scope="session", autouse=True)
def compiled_kernels(tmp_path_factory):
    """Two workers compile the large kernels in turn, each other ones first, so that neither does what the other did."""
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    if not worker:
        return
    from tests import kernels

    jobs = [kernels.compile_rasteriser, kernels.compile_vehicle, kernels.compile_weather]
    first = int(worker.removeprefix("gw")) % len(jobs)
    for job in jobs[first:] + jobs[:first]:
        done = tmp_path_factory.getbasetemp().parent / f"{job.__name__}.done"
        with FileLock(done.with_suffix(".lock")):
            if not done.exists():
                job(tmp_path_factory.mktemp("kernels"))
                done.touch()


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
