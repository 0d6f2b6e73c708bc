"""The clips that the pipeline's benchmark measures."""

import pytest

from benchmarks.pipeline import CLIP, FRAMES, LIMITS, WEATHERS
from catalogs.entries import load


@pytest.mark.parametrize(("size", "label"), LIMITS)
def test_each_clip_is_a_grid_of_one_stop_in_its_weather_seen_by_a_camera_of_its_size(tmp_path, size, label):
    path = tmp_path / "clip.yaml"
    path.write_text(CLIP.format(size=size, label=label, weather=WEATHERS[label], frames=FRAMES))
    grid = load("grid", str(path))
    assert [(name, scenario.weather) for name, scenario in grid.scenarios] == [(label, label.split("-")[0])]
    assert (grid.settings.camera, grid.settings.frames) == (f"dashcam-{size}", FRAMES)
