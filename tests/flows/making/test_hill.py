"""A dataset on a hill: the grade of its scene's route stands in its inputs, its ticks and its motion, and is judged."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.road_grade import ROAD_GRADE
from catalogs.scenes import write_scene
from flows.auditing.audit import audit_dataset
from flows.auditing.explain import explain_frame
from flows.auditing.repair import repair_dataset
from flows.making.catalogue import Catalogue
from flows.making.freezing import frozen_run
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan, read_plan
from flows.store.layout import Layout
from flows.store.telemetry import columns_hash
from studies.lineage.driven_lines import Asked, drive_clip, is_driven
from studies.lineage.kept_lines import list_lines
from studies.physics_judge.audit_physics import audit_physics, clip_columns, clip_facts
from studies.physics_judge.frozen_constants import read_constants
from studies.physics_judge.laws.audit import audit_clip
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.scene.route import route_from_positions
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """\
name: hill
scene: {folder}/scene
camera: {folder}/camera.yaml
vehicle_mode: {mode}
frames: 16
frame_rate_hz: 5
pictures: false
scenarios:
  stop: {{initial_speed_km_h: 30, peak_pressure_mpa: 2.3, brake_onset_s: 0.4}}
"""


def write_hill(folder: Path, mode: str = "paper", grade: float = 0.08) -> str:
    """A grid on the toy street whose route climbs from its eighth metre on."""
    s = np.linspace(0.0, 40.0, 81)
    heights = grade * np.maximum(s - 8.0, 0.0) ** 2 / (8.0 + np.maximum(s - 8.0, 0.0))
    route = route_from_positions(np.stack([s, 0 * s, heights], axis=1))
    write_scene(replace(toy_street(), route=route), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    (folder / "grid.yaml").write_text(GRID.format(folder=folder, mode=mode))
    return str(folder / "grid.yaml")


@pytest.fixture(scope="module")
def hill(tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("hill")
    return generate_dataset(write_hill(folder), str(folder / "data"), runner="threads", workers=1).layout


@pytest.fixture(scope="module")
def level(tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("level")
    grid = write_hill(folder, grade=0.0)
    return generate_dataset(grid, str(folder / "data"), runner="threads", workers=1).layout


def clip_of(layout: Layout) -> tuple[dict, dict, dict]:
    facts = clip_facts(layout.root)[0]
    return (*(clip_columns(layout.root, table, facts) for table in ("ticks", "frames")), facts)


def test_the_stop_is_shorter_uphill_and_its_label_ranges_are_on_the_same_hill(hill, level):
    up, flat = clip_of(hill)[2], clip_of(level)[2]
    assert up["stopping_distance"] < 0.98 * flat["stopping_distance"]
    # a dry stop at this pressure hardly depends on friction
    assert up["stopping_distance_p50"] == pytest.approx(up["stopping_distance"], rel=0.01)


def test_the_grade_stands_in_the_ticks_and_in_the_inputs_of_a_hill_alone(hill, level):
    ticks = clip_of(hill)[0]
    np.testing.assert_array_equal(ticks["road_grade"], Catalogue(hill.inputs).grade.at(ticks["station"]))
    assert 0.03 < ticks["road_grade"].max() < 0.08
    assert ROAD_GRADE in json.loads(hill.manifest.read_bytes())["inputs"]
    assert ROAD_GRADE not in json.loads(level.manifest.read_bytes())["inputs"]
    assert not clip_of(level)[0]["road_grade"].any()


def test_every_audit_drives_the_same_hill(hill):
    assert audit_physics(str(hill.root))["verified"]
    assert audit_dataset(str(hill.root), share=1.0, runner="threads", workers=1)["verified"]
    assert explain_frame(str(hill.root), "stop", 8)["agrees"]


def test_without_the_scene_the_motion_follows_from_the_inputs(hill):
    plan = read_plan(hill.root)
    asked = Asked(
        scenario=plan.clips[0].scenario, mode="paper", variant="full", duration_s=plan.duration_s, route=None
    )
    again = drive_clip(asked, Catalogue(hill.inputs))
    names = [channel.name for channel in TICK_CHANNELS]
    recorded = json.loads(hill.manifest.read_bytes())["clips"][0]["content"]["ticks"]
    assert columns_hash(again.ride.columns, names) == recorded
    lines = [
        line.key
        for line in list_lines(ROAD_GRADE, (hill.inputs / ROAD_GRADE).read_bytes())
        if is_driven(line)
    ]
    assert lines == ["spacing", "rise"]


def test_the_frozen_run_of_a_hill_has_the_telemetry_of_its_dataset(hill):
    frozen = frozen_run(load("grid", str(hill.root.parent / "grid.yaml")))
    assert (
        frozen["clips"][0]["ticks"] == json.loads(hill.manifest.read_bytes())["clips"][0]["content"]["ticks"]
    )


def test_a_hill_that_is_drawn_and_not_felt_breaks_the_law_of_the_grade_alone(hill, level):
    """The motion of a level road beside poses that climb."""
    ticks, frames, facts = clip_of(level)
    drawn = clip_of(hill)[1]
    climbing = frames | {"T_world_rig": frames["T_world_rig"].copy()}
    rise = np.interp(frames["station"], drawn["station"], drawn["T_world_rig"][:, 11])
    climbing["T_world_rig"][:, 11] += rise
    assert audit_clip(ticks, frames, facts, read_constants(level.root)).passed
    verdict = audit_clip(ticks, climbing, facts, read_constants(level.root))
    assert "road rises by its grade" in [law.name for law in verdict.broken]


def test_an_open_question_of_sampling_hides_no_tenth_of_a_grade(hill):
    ticks, frames, facts = clip_of(hill)
    wrong = 1.1 * ticks["road_grade"]
    shown = frames | {"road_grade": wrong[frames["tick"]]}
    verdict = audit_clip(ticks | {"road_grade": wrong}, shown, facts, read_constants(hill.root))
    assert "m dv/dt is the sum of forces" in [law.name for law in verdict.broken]


def test_a_road_steeper_than_any_street_is_refused_since_up_is_somewhere_else(tmp_path):
    with pytest.raises(InputError, match=r"grade of the road must be at most 0.35 .*z axis must point up"):
        make_plan(write_hill(tmp_path, grade=1.5), "cpu")


def test_repair_makes_the_grade_again_from_the_scene(tmp_path: Path) -> None:
    layout = generate_dataset(
        write_hill(tmp_path), str(tmp_path / "data"), runner="threads", workers=1
    ).layout
    kept = layout.inputs / ROAD_GRADE
    before = kept.read_bytes()
    kept.unlink()
    assert repair_dataset(str(layout.root), runner="threads", workers=1)["restored"] == [
        f"inputs/{ROAD_GRADE}"
    ]
    assert kept.read_bytes() == before
