"""Clips that draw their own camera, and weather that has ended: recorded, judged, exported and audited as they are."""

import json

import numpy as np
import pytest

from catalogs.scenes import write_scene
from flows.auditing.audit import audit_dataset
from flows.exporting.export import export_dataset
from flows.making.catalogue import catalogue_of
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan, read_plan
from studies.physics_judge.audit_physics import clip_facts
from tasks.errors import InputError
from tasks.render.camera import measure_mount
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """\
name: own-cameras
camera: camera.yaml
scene: flat
frames: 4
frame_rate_hz: 10
base: {initial_speed_km_h: 30, hold_speed: true}
axes:
  weather:
    dry: {weather: dry}
    rain: {weather: rain, precipitation_mm_h: 20}
    after: {weather: rain, precipitation_mm_h: 20, falling: false}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("own-cameras")
    write_scene(toy_street(1), place / "flat", {})
    focal = next(line for line in TOY_CAMERA.splitlines() if line.startswith("focal_length"))
    value = float(focal.split("value:")[1].split(",")[0])
    bounded = focal.replace("unit:", f"bounds: [{0.8 * value}, {1.3 * value}], unit:")
    (place / "camera.yaml").write_text(TOY_CAMERA.replace(focal, bounded))
    (place / "grid.yaml").write_text(GRID)
    return place


@pytest.fixture(scope="module")
def made(folder):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return generate_dataset("grid.yaml", str(folder / "data"), runner="threads", workers=1).layout


def test_each_clip_has_its_camera_in_tables_attributes_and_exports(made, folder):
    rows = sorted(clip_facts(made.root), key=lambda row: row["index"])
    own = [catalogue_of(made.root).camera_of(int(row["seed"])) for row in rows]
    assert len({row["focal_length_px"] for row in rows}) == 3
    for row, camera in zip(rows, own, strict=True):
        assert {name: row[name] for name in measure_mount(camera)} == measure_mount(camera)
    attributes = json.loads((made.frames / "zarr.json").read_text())["attributes"]
    np.testing.assert_array_equal(attributes["K"], [camera.K for camera in own])
    np.testing.assert_array_equal(attributes["T_rig_camera"], [camera.T_rig_camera for camera in own])
    export_dataset(str(made), to="coco", out=str(folder / "coco"))
    images = json.loads((folder / "coco" / "annotations.json").read_text())["images"]
    assert {one["K"][0][0] for one in images} == {row["focal_length_px"] for row in rows}
    with pytest.raises(InputError, match="each clip draws its own"):
        export_dataset(str(made), to="kitti", out=str(folder / "kitti"))


def test_rain_that_has_ended_is_driven_on_as_before_and_the_dataset_passes_its_audit(made):
    rows = {row["label"]: row for row in clip_facts(made.root)}
    assert [rows[label]["falling"] for label in ("dry", "rain", "after")] == [True, True, False]
    for name in ("film_depth_mm", "surface_friction", "stopping_distance"):
        np.testing.assert_equal(rows["after"][name], rows["rain"][name])
    assert audit_dataset(str(made), share=1.0, runner="threads", workers=1)["verified"]


def test_a_clip_keeps_its_id_where_it_names_nothing_new(made, folder, monkeypatch):
    monkeypatch.chdir(folder)
    clips = {clip.label: clip for clip in read_plan(made.root).clips}
    assert not {"falling", "sky", "sun_azimuth_deg"} & clips["rain"].scenario.as_record().keys()
    assert clips["after"].scenario.as_record()["falling"] is False


def test_a_sky_is_refused_over_a_scene_that_does_not_know_its_light(folder, monkeypatch):
    monkeypatch.chdir(folder)
    named = GRID.replace("dry: {weather: dry}", "dry: {weather: dry, sky: clear}")
    (folder / "named.yaml").write_text(named)
    with pytest.raises(InputError, match="knows its own light"):
        make_plan("named.yaml", "numba")
