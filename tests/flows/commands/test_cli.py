import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from manifests.provenance import SOURCE_ROOT


def musync(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flows.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=120, env=_environment())


def _environment() -> dict[str, str]:
    return {k: v for k, v in os.environ.items() if k != "PREFECT_API_URL"} | {"PYTHONPATH": str(SOURCE_ROOT)}


def test_validate_counts_clips_and_frames(tmp_path):
    done = musync("validate", "demo", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert (facts["clips"], facts["frames"]) == (15, 15 * 81)


@pytest.mark.parametrize(
    ("grid", "sentence"),
    [
        ("{name: t, colour: red, axes: {a: {b: {}}}}", "colour: unknown key"),
        (
            "{name: t, axes: {a: {b: {weather: rain, precipitation_mm_h: -1}}}}",
            "must not be negative; it is -1",
        ),
        ("{name: t, axes: {a: {b: {weather: snow, precipitation_mm_h: 1}}}}", "needs an accumulation time"),
        (
            "{name: t, axes: {a: {b: {hazard_center_m: 50, hazard_length_m: 900, hazard_height_m: 0.1}}}}",
            "must lie on the route of scene street",
        ),
        ("{name: t, scene: nowhere, axes: {a: {b: {}}}}", "nowhere"),
        ("{name: t, vehicle: tractor, axes: {a: {b: {}}}}", "tractor: no such"),
    ],
)
def test_a_faulty_grid_is_one_clear_sentence_exit_code_2_and_no_traceback(tmp_path, grid, sentence):
    (tmp_path / "grid.yaml").write_text(grid)
    done = musync("generate", "grid.yaml", "--out", "data", cwd=tmp_path)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "data").exists()


def test_a_folder_with_other_files_is_left_alone(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "thesis.tex").write_text("precious")
    done = musync("generate", "demo", "--out", "data", cwd=tmp_path)
    assert done.returncode == 2
    assert "must be an empty or new folder" in done.stderr
    assert [p.name for p in (tmp_path / "data").iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("command", ["audit", "describe"])
def test_a_folder_that_is_no_dataset_is_refused(tmp_path, command):
    done = musync(command, str(tmp_path), cwd=tmp_path)
    assert done.returncode == 2
    assert "manifest.json: no such file" in done.stderr


def test_a_manifest_of_another_version_is_refused(tmp_path):
    (tmp_path / "manifest.json").write_text('{"format": "musync-manifest/9"}')
    done = musync("audit", str(tmp_path), cwd=tmp_path)
    assert done.returncode == 2
    assert "musync-manifest/9" in done.stderr
