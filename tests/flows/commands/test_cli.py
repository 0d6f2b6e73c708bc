"""Commands as a user types them: their exit codes, and what stands on the terminal."""

import json
from math import degrees
from types import SimpleNamespace

import pytest

from flows.reading.describe import BYTES_PER_PIXEL, BYTES_PER_TICK
from tests.flows.shell import run_command
from tests.toy_street import write_toy_grid


@pytest.fixture
def musync(tmp_path, monkeypatch, capsys):
    """Run a command in the test's folder; returns its exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> SimpleNamespace:
        code = run_command(monkeypatch, *words)
        return SimpleNamespace(code=code, **capsys.readouterr()._asdict())

    return run


def test_validate_counts_clips_and_frames(musync):
    done = musync("validate", "demo", "--json")
    assert done.code == 0, done.err
    facts = json.loads(done.out)
    assert (facts["clips"], facts["frames"]) == (15, 15 * 81)


def test_validate_tells_the_run_that_generate_makes_with_the_same_options(musync, tmp_path):
    grid = write_toy_grid(tmp_path, frames=10)
    options = ("--vehicle", "multibody-grown", "--no-frames")
    told = json.loads(musync("validate", grid, *options, "--json").out)
    made = json.loads(musync("generate", grid, *options, "--out", "data", "--json").out)
    assert told["run_id"] == made["run_id"] != json.loads(musync("validate", grid, "--json").out)["run_id"]
    assert told["frames"] == 0
    assert musync("validate", grid, "--vehicle", "nowhere").code == 2


def test_validate_counts_the_pixels_of_a_camera_given_by_an_absolute_path(musync, tmp_path):
    (tmp_path / "folder").mkdir()
    grid = write_toy_grid(tmp_path / "folder", frames=10)
    done = musync("validate", grid, "--json")
    assert done.code == 0, done.err
    facts = json.loads(done.out)
    assert facts["frames"] == 40
    assert facts["megabytes_estimate"] == pytest.approx(
        (BYTES_PER_PIXEL * 40 * 96 * 64 + BYTES_PER_TICK * facts["ticks"]) / 1e6, abs=0.06
    )


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
def test_a_faulty_grid_is_one_clear_sentence_exit_code_2_and_no_traceback(musync, tmp_path, grid, sentence):
    (tmp_path / "grid.yaml").write_text(grid)
    done = musync("generate", "grid.yaml", "--out", "data")
    assert done.code == 2
    assert sentence in done.err
    assert "Traceback" not in done.err
    assert not (tmp_path / "data").exists()


def test_a_folder_with_other_files_is_left_alone(musync, tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "thesis.tex").write_text("precious")
    done = musync("generate", "demo", "--out", "data")
    assert done.code == 2
    assert "must be an empty or new folder" in done.err
    assert [p.name for p in (tmp_path / "data").iterdir()] == ["thesis.tex"]


def test_describe_gives_a_row_a_clip_with_units_that_a_terminal_can_hold(musync, toy_dataset, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    shown = musync("lab", "describe", str(toy_dataset.root)).out.splitlines()
    whole = json.loads(musync("lab", "describe", str(toy_dataset.root), "--json").out)["clips"]
    assert any("stop_m" in line and "peak_pitch_deg" in line for line in shown)
    for clip in whole:
        (line,) = [line for line in shown if clip["label"] in line]
        assert f"{degrees(clip['peak_pitch']):.5g}" in line


def test_a_manifest_of_another_version_is_refused(musync, tmp_path):
    (tmp_path / "manifest.json").write_text('{"format": "musync-manifest/9"}')
    done = musync("audit", str(tmp_path))
    assert done.code == 2
    assert "musync-manifest/9" in done.err
