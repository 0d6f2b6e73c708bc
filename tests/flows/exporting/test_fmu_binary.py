"""The C frame of an FMU beside the headers of the standard."""

import shutil
import subprocess
from pathlib import Path

import pytest

from catalogs.entries import load
from flows.exporting.fmu_binary import FRAME, find_compiler, find_own_platform, format_header
from tasks.vehicle.model.embedded_variables import INPUTS

fmpy = pytest.importorskip("fmpy", reason="FMPy, which has the headers, is not installed: pip install fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def test_the_frame_has_the_functions_of_the_standards_own_headers(tmp_path):
    (tmp_path / "model.h").write_text(
        format_header(load("vehicle", "multibody-grown"), [0.0] * len(INPUTS), "guid")
    )
    headers = Path(fmpy.__file__).parent / "c-code"
    words = [
        "-std=c11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-fsyntax-only",
        "-DMUSYNC_HEADERS",
        f"-I{headers}",
        f"-I{tmp_path}",
    ]
    done = subprocess.run(
        [*find_compiler(find_own_platform()), *words, str(FRAME)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
