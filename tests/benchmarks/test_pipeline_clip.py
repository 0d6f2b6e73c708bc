"""The clips that the pipeline's benchmark measures."""

import pytest

from benchmarks.pipeline import CLIP, FRAMES, SIZES
from catalogs.entries import load


@pytest.mark.parametrize("size", SIZES)
def test_the_clip_of_each_size_is_a_grid_of_one_dry_stop_seen_by_a_camera_of_that_size(tmp_path, size):
    width, height, _ = size
    path = tmp_path / "clip.yaml"
    path.write_text(CLIP.format(width=width, height=height, frames=FRAMES))
    grid = load("grid", str(path))
    assert [(label, scenario.weather) for label, scenario in grid.scenarios] == [("dry", "dry")]
    assert (grid.settings.camera, grid.settings.frames) == (f"dashcam-{width}x{height}", FRAMES)
