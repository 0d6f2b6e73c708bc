"""A dataset of several scenes: each clip drives in its own, and ids, records, judges and exports know which."""

import json
from dataclasses import replace

import numpy as np
import pytest

from catalogs.road_grade import name_grade_file
from catalogs.scenes import write_scene
from flows.auditing.audit import audit_dataset
from flows.auditing.explain import explain_frame
from flows.exporting.export import export_dataset
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan, read_plan
from flows.reading.report import make_report
from flows.store.layout import Layout
from studies.lineage import trace
from studies.physics_judge.audit_physics import audit_physics, clip_columns, clip_facts
from tasks.errors import InputError
from tasks.scene.route import route_from_positions
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """\
name: several
camera: {camera}
frames: 6
frame_rate_hz: 10
axes:
  place: {places}
  weather:
    dry: {{initial_speed_km_h: 30, peak_pressure_mpa: 2.3, brake_onset_s: 0.1}}
    rain: {{initial_speed_km_h: 30, weather: rain, precipitation_mm_h: 20}}
"""
PLACES = "{flat: {scene: flat}, slope: {scene: slope}}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The working folder: two toy streets, one of which climbs."""
    place = tmp_path_factory.mktemp("several")
    s = np.linspace(0.0, 40.0, 81)
    climb = route_from_positions(np.stack([s, 0 * s, 0.06 * s], axis=1))
    write_scene(toy_street(1), place / "flat", {})
    write_scene(replace(toy_street(2), route=climb), place / "slope", {})
    (place / "camera.yaml").write_text(TOY_CAMERA)
    return place


@pytest.fixture(autouse=True)
def work_there(folder, monkeypatch):
    monkeypatch.chdir(folder)


def write_grid(folder, places: str = PLACES, name: str = "grid") -> str:
    path = folder / f"{name}.yaml"
    path.write_text(GRID.format(camera="camera.yaml", places=places))
    return str(path)


@pytest.fixture(scope="module")
def made(folder) -> Layout:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return generate_dataset(write_grid(folder), str(folder / "data"), runner="threads", workers=1).layout


def test_each_clip_drives_and_is_seen_in_its_own_scene(made):
    rows = {row["label"]: row for row in clip_facts(made.root)}
    assert {row["scene"] for row in rows.values()} == {"flat", "slope"}
    heights = {
        label: clip_columns(made.root, "frames", row)["T_world_rig"].reshape(-1, 4, 4)[-1, 2, 3]
        for label, row in rows.items()
    }
    assert abs(heights["flat/dry"]) < 0.1 < heights["slope/dry"]
    grades = {label: clip_columns(made.root, "ticks", row)["road_grade"] for label, row in rows.items()}
    assert not grades["flat/rain"].any()
    assert grades["slope/rain"].min() > 0.05


def test_the_manifest_records_each_scene_and_the_grade_of_those_that_climb(made):
    manifest = json.loads(made.manifest.read_bytes())
    assert [scene["name"] for scene in manifest["scenes"]] == ["flat", "slope"]
    assert len({scene["sha256"] for scene in manifest["scenes"]}) == 2
    assert name_grade_file("slope") in manifest["inputs"]
    assert name_grade_file("flat") not in manifest["inputs"]
    assert {clip["scenario"]["scene"] for clip in manifest["clips"]} == {"flat", "slope"}


def test_another_scene_changes_no_id_of_the_clips_of_the_others(folder, made):
    alone, _ = make_plan(write_grid(folder, "{slope: {scene: slope}}", "alone"), "cpu")
    ids = {clip.label: clip.clip_id for clip in read_plan(made.root).clips}
    assert {clip.label: clip.clip_id for clip in alone.clips}.items() <= ids.items()


def test_the_dataset_is_audited_explained_traced_and_shown(made, tmp_path, monkeypatch):
    result = audit_dataset(str(made.root), share=0.5, seed=1, runner="threads", workers=1)
    assert result["verified"], result["contradictions"] + result["not_remade"]
    assert audit_physics(str(made.root))["verified"]
    assert explain_frame(str(made.root), "slope/dry", 5)["steps"]
    monkeypatch.setattr(trace, "move_lines", lambda *given: [])  # which takes seconds, and has its own tests
    lineage = trace.trace_lineage(str(made.root), "slope/dry")
    assert lineage["follows"] and lineage["scene"]["name"] == "slope"
    make_report(str(made.root), out=str(tmp_path / "report"))
    page = "".join(path.read_text() for path in (tmp_path / "report").glob("*.html"))
    assert "2 scenes" in page


def test_each_clip_is_exported_with_the_gaussians_of_its_scene(made, tmp_path):
    export_dataset(str(made.root), "nerfstudio", out=str(tmp_path / "out"), clips=["flat/dry", "slope/dry"])
    scenes = sorted((tmp_path / "out" / "scenes").glob("*.ply"))
    assert len(scenes) == 2 and scenes[0].read_bytes() != scenes[1].read_bytes()


def test_a_scene_that_is_missing_is_one_sentence(folder):
    with pytest.raises(InputError, match="scene nowhere: no such scene") as caught:
        make_plan(write_grid(folder, "{a: {scene: nowhere}, b: {scene: flat}}", "missing"), "cpu")
    assert len(caught.value.problems) == 1


def test_a_scene_outside_the_working_folder_is_refused(folder):
    with pytest.raises(InputError, match="below the working folder"):
        make_plan(write_grid(folder, f"{{a: {{scene: {folder}/flat}}}}", "outside"), "cpu")
