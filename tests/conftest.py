"""Where test data outside the repository lies, when there is any."""

import os
from pathlib import Path

import pytest

DATA = Path(os.environ.get("MUSYNC_DATA", Path(__file__).resolve().parents[2] / "shared"))


@pytest.fixture
def outside_data() -> Path:
    """The folder with reference/ and measured/; skips where it is absent."""
    if not (DATA / "reference").is_dir():
        pytest.skip(
            f"no reference data at {DATA}; set MUSYNC_DATA to the folder that holds reference/ and measured/"
        )
    return DATA
