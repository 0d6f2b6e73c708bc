"""The cameras that ship look where a dashcam looks."""

import numpy as np
import pytest

from catalogs.entries import load


@pytest.mark.parametrize("name", ["dashcam-480x320", "dashcam-1280x720"])
def test_cameras_look_forward_from_above_the_road(name):
    camera = load("camera", name)
    np.testing.assert_allclose(camera.T_rig_camera[:3, :3] @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    assert camera.T_rig_camera[2, 3] > 1
    assert (camera.K[0, 2], camera.K[1, 2]) == (camera.width / 2, camera.height / 2)
