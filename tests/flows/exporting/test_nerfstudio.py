"""transforms.json by its documented schema, and the Gaussians by plyfile and by our own reader."""

import json

import cv2
import numpy as np
import pytest

from catalogs.scenes.gaussian_files import read_gaussians
from flows.making.catalogue import catalogue_of
from flows.making.driving import hazard_of
from flows.making.pictures import edit_scene, shape_road
from flows.making.plan import read_plan
from tests.flows.exporting.conftest import BRAKING, HUMP

NERFSTUDIO_DEPTH_UNIT = 1e-3
"""Default of ``depth_unit_scale_factor`` in nerfstudio's NerfstudioDataParserConfig, for .npy and .png alike."""
FOLDERS = {BRAKING: "00000_dry_flat", HUMP: "00003_snow-3_hump"}


def test_pictures_depth_intrinsics_and_opengl_poses(export, stored, toy_dataset):
    camera = catalogue_of(toy_dataset.root).camera
    for label, clip in stored.items():
        folder = export("nerfstudio") / FOLDERS[label]
        content = json.loads((folder / "transforms.json").read_text())
        assert [content[key] for key in ("w", "h", "fl_x", "fl_y", "cx", "cy")] == [
            96,
            64,
            80.0,
            80.0,
            48.0,
            32.0,
        ]
        assert [frame["t_ns"] for frame in content["frames"]] == clip.frames["t_ns"].tolist()
        for k, frame in enumerate(content["frames"]):
            picture = cv2.imread(str(folder / frame["file_path"]))[..., ::-1]
            np.testing.assert_array_equal(picture, clip.pixels["rgb"][k])
            depth = np.load(folder / frame["depth_file_path"])
            assert depth.dtype == np.float32
            np.testing.assert_allclose(
                depth * NERFSTUDIO_DEPTH_UNIT, np.nan_to_num(clip.pixels["depth"][k]), rtol=1e-6
            )
            pose = np.array(frame["transform_matrix"])
            expected = clip.T_world_rig[k] @ camera.T_rig_camera
            np.testing.assert_allclose(pose[:3, 3], expected[:3, 3])
            right, up, back = pose[:3, :3].T
            np.testing.assert_allclose([right, -up, -back], expected[:3, :3].T)
    first, last = (
        [
            f["transform_matrix"][2][2]
            for f in json.loads((export("nerfstudio") / FOLDERS[BRAKING] / "transforms.json").read_text())[
                "frames"
            ]
        ][k]
        for k in (0, -1)
    )
    assert last > first + 0.001  # nose down: the axis that points back rises


@pytest.mark.parametrize("label", [BRAKING, HUMP])
def test_the_ply_of_a_clip_is_the_scene_that_it_was_drawn_from(export, toy_dataset, label):
    plan, catalogue = read_plan(toy_dataset.root), catalogue_of(toy_dataset.root)
    folder = export("nerfstudio") / FOLDERS[label]
    file = folder / json.loads((folder / "transforms.json").read_text())["gaussians_file"]
    scenario = next(clip.scenario for clip in plan.clips if clip.label == label)
    albedo = catalogue.weather_parameters.sky.asphalt_albedo
    relief = shape_road(catalogue.scene, hazard_of(scenario))
    drawn = edit_scene(catalogue.scene, relief, catalogue.marking, albedo)
    assert np.array_equal(drawn.means, catalogue.scene.gaussians.means) == (label == BRAKING)
    read = read_gaussians(file)
    np.testing.assert_allclose(read.means, drawn.means, atol=1e-6)
    np.testing.assert_allclose(read.opacities, drawn.opacities, rtol=1e-5)
    np.testing.assert_allclose(read.scales, drawn.scales, rtol=1e-5)


def test_plyfile_reads_the_gaussians_with_the_raised_road(export, toy_dataset):
    plyfile = pytest.importorskip("plyfile", reason="pip install plyfile")
    flat, hump = (
        plyfile.PlyData.read(export("nerfstudio") / f"scenes/road-{k:03d}.ply")["vertex"] for k in (0, 1)
    )
    assert {"x", "y", "z", "opacity", "scale_0", "rot_0", "f_dc_0"} <= set(hump.data.dtype.names)

    def road_height(cloud):
        near = (np.abs(cloud["x"] - 4) < 0.2) & (np.abs(cloud["y"]) < 1) & (cloud["z"] < 0.2)
        return float(np.max(cloud["z"][near]))

    assert road_height(flat) == pytest.approx(0, abs=0.01)
    assert road_height(hump) == pytest.approx(0.075, abs=0.005)  # the middle of the hump, at station 4 m
