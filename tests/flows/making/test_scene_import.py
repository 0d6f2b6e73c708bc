"""An import judges its result: road below the route, or what to try; files as others write them, end to end."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from catalogs.scenes.gaussian_files import write_gaussians
from flows.cli import app
from flows.making.scenes import scene_import
from tasks.scene.classify import find_level_surface
from tasks.scene.transform import transform_gaussians
from tests.toy_street import toy_street

SCENE = toy_street()
IN_CAMERA = np.array([[0.0, -1, 0, 0], [0, 0, -1, 1.5], [1, 0, 0, 0], [0, 0, 0, 1]])
"""From the street's frame to that of a camera 1.5 m above its start."""
PARSER = {"transform": [[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 2]], "scale": 0.05}


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A cloud and poses 1.5 m above its road, both in the frame of the first camera; the working folder."""
    monkeypatch.chdir(tmp_path)
    write_gaussians(transform_gaussians(SCENE.gaussians, IN_CAMERA), tmp_path / "cloud.ply")
    poses = np.tile(np.eye(4), (30, 1, 1))
    poses[:, 2, 3] = np.arange(30)
    np.savetxt(tmp_path / "poses.txt", poses[:, :3].reshape(30, 12))
    return tmp_path


def run(*words: str) -> tuple[int, dict]:
    done = CliRunner().invoke(app, ["scene", "import", *words, "--json"])
    return done.exit_code, json.loads(done.stdout) if done.stdout.startswith("{") else {}


def test_a_route_above_its_road_is_good(files):
    code, facts = run("cloud.ply", "--route", "poses.txt", "--out", "scene")
    assert (code, facts["road_found"], facts["road_coverage"], facts["warnings"]) == (0, True, 1.0, [])
    assert facts["road_share"] > 0.5


def test_a_wrong_camera_height_fails_and_the_right_one_is_named(files):
    code, facts = run("cloud.ply", "--route", "poses.txt", "--out", "scene", "--camera-height", "2.2")
    assert (code, facts["road_found"], facts["road_share"]) == (1, False, 0.0)
    assert "lies 0.70 m above it; give --camera-height 1.50" in facts["warnings"][0]
    assert (files / "scene" / "scene.json").exists()


def test_files_without_a_metric_scale_fail_and_the_unit_is_named(files):
    small = np.diag([0.1, 0.1, 0.1, 1.0]) @ IN_CAMERA
    write_gaussians(transform_gaussians(SCENE.gaussians, small), files / "cloud.ply")
    poses = np.loadtxt("poses.txt")
    poses[:, 3::4] *= 0.1
    np.savetxt("small.txt", poses)
    code, facts = run("cloud.ply", "--route", "small.txt", "--out", "a", "--half-width", "0.35")
    assert (code, facts["road_found"]) == (1, False)
    assert "--metres-per-unit 10" in facts["warnings"][0]
    code, facts = run("cloud.ply", "--route", "small.txt", "--out", "b", "--metres-per-unit", "10")
    assert (code, facts["road_coverage"]) == (0, 1.0)


def test_a_cloud_of_nerfstudio_is_found_by_its_dataparser(files):
    frames = [
        {"file_path": f"{i}.png", "transform_matrix": (np.diag([1.0, -1, -1, 1]) + move(i)).tolist()}
        for i in range(30)
    ]
    (files / "transforms.json").write_text(json.dumps({"frames": frames}))
    (files / "dataparser_transforms.json").write_text(json.dumps(PARSER))
    own = np.diag([0.05, 0.05, 0.05, 1.0]) @ np.vstack([PARSER["transform"], [0, 0, 0, 1]])
    write_gaussians(transform_gaussians(SCENE.gaussians, own @ IN_CAMERA), files / "cloud.ply")
    code, facts = run("cloud.ply", "--route", "transforms.json", "--out", "a")
    assert code == 1
    assert "give --dataparser dataparser_transforms.json" in facts["warnings"][0]
    code, facts = run(
        "cloud.ply", "--route", "transforms.json", "--out", "b", "--dataparser", "dataparser_transforms.json"
    )
    assert (code, facts["road_coverage"]) == (0, 1.0)


def move(metres: float) -> np.ndarray:
    return np.pad([[metres]], ((2, 1), (3, 0)))


def test_what_was_left_out_of_a_cloud_is_told(files):
    content = bytearray((files / "cloud.ply").read_bytes())
    content[-4:] = np.float32(np.nan).tobytes()
    (files / "cloud.ply").write_bytes(content)
    facts = scene_import("cloud.ply", "poses.txt", "scene")
    assert facts["gaussians"] == len(SCENE.gaussians) - 1
    assert facts["warnings"][0].startswith("1 of")
    assert facts["road_found"]


def test_a_level_surface_has_to_lie_along_the_route():
    route, cloud = SCENE.route, SCENE.gaussians
    assert find_level_surface(cloud, route, 4.0, -4.0) == pytest.approx(0.0, abs=0.01)
    short = replace(route, station=route.station[:5], T_world_rig=route.T_world_rig[:5])
    long = replace(
        route, T_world_rig=np.eye(4) + 4 * (route.T_world_rig - np.eye(4)), station=4 * route.station
    )
    assert find_level_surface(cloud, short, 4.0, -4.0) is not None
    assert find_level_surface(cloud, long, 4.0, -4.0) is None
