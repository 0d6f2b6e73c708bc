"""Where test data outside the repository lies, when there is any; and one thread for linear algebra."""

import os
from pathlib import Path

import pytest

# small matrices: more threads than one cost twice the time (read by numpy when it is first imported)
for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(library, "1")

DATA = Path(os.environ.get("MUSYNC_DATA", Path(__file__).resolve().parents[2] / "shared"))


@pytest.fixture
def outside_data() -> Path:
    """The folder with reference/ and measured/; skips where it is absent."""
    if not (DATA / "reference").is_dir():
        pytest.skip(
            f"no reference data at {DATA}; set MUSYNC_DATA to the folder that holds reference/ and measured/"
        )
    return DATA
