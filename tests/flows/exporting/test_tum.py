"""evo reads the camera's trajectory."""

import numpy as np
import pytest

from flows.making.catalogue import catalogue_of
from tests.flows.exporting.conftest import BRAKING, HUMP


def test_evo_reads_times_and_camera_poses(export, stored, toy_dataset):
    file_interface = pytest.importorskip("evo.tools.file_interface", reason="pip install evo")
    camera = catalogue_of(toy_dataset.root).camera
    files = sorted(export("tum").glob("*.txt"))
    for path, label in zip(files, (BRAKING, HUMP), strict=True):
        read = file_interface.read_tum_trajectory_file(path)
        np.testing.assert_array_equal(read.timestamps, stored[label].frames["t_ns"] / 1e9)
        np.testing.assert_allclose(
            read.poses_se3, stored[label].T_world_rig @ camera.T_rig_camera, atol=1e-12
        )


def test_a_braking_camera_looks_down(export):
    *_, x, y, _, _ = np.loadtxt(sorted(export("tum").glob("*.txt"))[0])[-1]
    forward_up = 1 - 2 * (x * x + y * y)  # of the camera's z axis, along the world's z
    assert forward_up < -0.001
