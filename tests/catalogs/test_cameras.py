"""The cameras that ship look where a dashcam looks."""

import numpy as np
import pytest
import yaml

from catalogs.entries import find_entry, load
from tasks.render.camera import measure_mount


@pytest.mark.parametrize("name", ["dashcam-480x320", "dashcam-1280x720", "dashcam-1920x1280"])
def test_cameras_look_forward_from_above_the_road(name):
    camera = load("camera", name)
    np.testing.assert_allclose(camera.T_rig_camera[:3, :3] @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    assert camera.T_rig_camera[2, 3] > 1
    assert (camera.K[0, 2], camera.K[1, 2]) == (camera.width / 2, camera.height / 2)


BOUNDS = {
    "focal_length": (300, 500),
    "height_above_road": (1.0, 2.0),
    "pitch_down": (-3, 9),
    "roll_right": (-2, 4),
}


@pytest.fixture
def varied(tmp_path):
    entry = yaml.safe_load(find_entry("camera", "dashcam-480x320").read_text())
    entry |= {name: {"value": 0, "unit": "deg", "source": "test"} for name in ("pitch_down", "roll_right")}
    for name, bounds in BOUNDS.items():
        entry[name]["bounds"] = [*bounds]
    file = tmp_path / "varied.yaml"
    file.write_text(yaml.safe_dump(entry))
    return file


def test_a_seed_draws_a_camera_between_the_bounds_of_its_file(varied):
    seen = [measure_mount(load("camera", varied, seed)) for seed in range(40)]
    assert seen[7] == measure_mount(load("camera", varied, 7))
    drawn = {
        "focal_length": [one["focal_length_px"] for one in seen],
        "height_above_road": [one["camera_height"] for one in seen],
        "pitch_down": np.degrees([one["camera_pitch"] for one in seen]),
        "roll_right": np.degrees([one["camera_roll"] for one in seen]),
    }
    for name, (low, high) in BOUNDS.items():
        assert low <= min(drawn[name]) < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < max(drawn[name]) <= high
    ranks = np.corrcoef([*drawn.values()])
    assert np.abs(ranks[np.triu_indices(4, 1)]).max() < 0.5
    assert load("camera", varied).varies and not load("camera", "dashcam-480x320").varies


def test_a_camera_that_rolls_right_sees_the_road_rise_on_its_right(varied):
    camera = next(
        c for seed in range(9) if measure_mount(c := load("camera", varied, seed))["camera_roll"] > 0.01
    )
    right, down = camera.T_rig_camera[:3, 0], camera.T_rig_camera[:3, 1]
    assert right[2] < 0 and right[1] < 0 and down[2] < 0
