"""What became of an approach: columns of clips, on bends and towards several road users."""

import re
from math import inf, nan, pi

import numpy as np
import pyarrow.parquet as pq
import pytest

import musync
from flows.making.generate import generate_dataset
from flows.making.road_users import OUTCOMES, RANGED
from manifests.provenance import SOURCE_ROOT
from tasks.driving.outcome import Outcome, join_outcomes
from tasks.driving.targets import locate_body
from tasks.scene.road_users.motion import move_on_track
from tasks.scene.road_users.track import Track
from tests.scene.test_route_shape import helix

QUERIES = (SOURCE_ROOT / "docs" / "how-to" / "query-a-dataset.md").read_text()
GRID = """
name: meetings
pictures: false
vehicle_mode: coupled
frames: 11
frame_rate_hz: 10
duration_s: 2
axes:
  users:
    nobody: {initial_speed_km_h: 50, hold_speed: true}
    standing: {initial_speed_km_h: 50, hold_speed: true, objects: [{kind: car, track: {gap_m: 12}}]}
    world:
      initial_speed_km_h: 50
      hold_speed: true
      objects: [{kind: car, track: {world_m: [14.0115, 0]}}]
    oncoming:
      initial_speed_km_h: 50
      hold_speed: true
      objects: [{kind: car, track: {gap_m: 40, lateral_m: 3.5, heading_deg: 180, speed_km_h: 30}}]
    led:
      initial_speed_km_h: 50
      hold_speed: true
      objects: [{kind: car, track: {gap_m: 6, speed_km_h: 50, change_at_s: 0, acceleration_m_s2: -12}}]
    braked:
      initial_speed_km_h: 50
      peak_pressure_mpa: 8
      ramp_s: 0.1
      brake_onset_s: 0.1
      objects:
        - {kind: car, track: {gap_m: 24}}
        - {kind: adult, track: {gap_m: 40, lateral_m: -1.5, heading_deg: 90, speed_km_h: 5}}
"""


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meetings")
    (folder / "grid.yaml").write_text(GRID)
    generate_dataset(str(folder / "grid.yaml"), str(folder / "data"), runner="threads", workers=1)
    return folder / "data"


def test_clips_say_what_became_of_their_road_users_and_null_where_there_are_none(data):
    table = pq.read_table(data / "telemetry" / "clips.parquet")
    rows = {row["label"].split("/")[0]: {name: row[name] for name in OUTCOMES} for row in table.to_pylist()}
    assert set(rows["nobody"].values()) == {None}
    speed = 50 / 3.6
    hit = {"collided": True, "impact_speed": speed, "min_ttc": 0.0, "clearance": 0.0, "avoided_speed": 0.0}
    assert rows["standing"] == pytest.approx(hit, abs=1e-6)
    assert rows["world"] == rows["standing"] | {"avoided_speed": None}
    assert rows["oncoming"] == dict.fromkeys(OUTCOMES) | {
        "collided": False, "impact_speed": 0.0, "avoided_speed": 0.0
    }  # fmt: skip
    braked = rows["braked"]
    assert not braked["collided"] and braked["avoided_speed"] == pytest.approx(speed)
    ticks = musync.open(str(data)).pandas("ticks", ["station"], clip="braked")
    # the bumper is 0.8 m before the front axle, from which the gap of 24 m counts
    assert braked["clearance"] == pytest.approx(24 - 0.8 - ticks["station"].max(), abs=1e-9)
    assert 0 < braked["min_ttc"] < 24 / speed


def test_outcomes_have_percentiles_under_the_surface_bounds(data):
    rows = {row["label"]: row for row in musync.open(str(data)).pandas("clips").to_dict("records")}
    assert all(np.isnan(rows["nobody"][f"{name}_p50"]) for name in RANGED)
    braked, standing = rows["braked"], rows["standing"]
    for name in ("clearance", "min_ttc"):
        assert braked[f"{name}_p05"] < braked[f"{name}_p50"] < braked[f"{name}_p95"]
        assert braked[f"{name}_p05"] < braked[name] < braked[f"{name}_p95"]
    # a lead car brakes as hard as each road allows
    assert rows["led"]["impact_speed_p05"] < rows["led"]["impact_speed"] < rows["led"]["impact_speed_p95"]
    # nobody brakes there: no road changes the impact
    assert {standing[f"impact_speed_p{p}"] for p in ("05", "50", "95")} == {standing["impact_speed"]}
    (asked,) = re.findall(r'musync sql datasets/demo "(SELECT label, clearance.*)"', QUERIES)
    answer = {row[0]: row[1:] for row in musync.open(str(data)).sql(asked).fetchall()}
    assert answer["braked"] == pytest.approx([braked[f"clearance{part}"] for part in ("_p05", "", "_p95")])


def test_outcome_columns_have_units_and_answer_the_documented_query(data, toy_dataset):
    field = pq.read_schema(data / "telemetry" / "clips.parquet").field("impact_speed")
    assert field.metadata[b"units"] == b"m s-1" and b"road user" in field.metadata[b"description"]
    (asked,) = re.findall(r'musync sql datasets/demo "(.* FILTER \(collided\).*)"', QUERIES)
    assert musync.open(str(data)).sql(asked).fetchall()[0] == pytest.approx(("dry", 3, 50.0), abs=1e-4)
    # a dataset without road users has the columns in the views, without values
    assert {row[1:] for row in musync.open(str(toy_dataset.root)).sql(asked).fetchall()} == {(0, None)}


def test_a_body_beside_a_bend_is_met_at_the_station_of_its_nearest_corner():
    route, time = helix(50.0, 0.0), np.arange(0.0, 2.0, 0.01)
    inside = Track(start=(20.0, 1.5), speed=10.0)
    path = locate_body(move_on_track(inside, route, time, 1.0), (4.0, 2.0, 1.5), route, time)
    # 10 m/s on a circle of 48.5 m about the centre of the bend are more stations than metres
    assert path.speed == pytest.approx(10.0 * 50.0 / 48.5, rel=1e-3)
    corner = np.arctan2(2.0, 48.5 - 1.0) * 50.0  # at the inner side, which leads most
    assert path.station[0] == pytest.approx(20.0 - corner, abs=0.01)
    across = Track(start=(20.0, -6.0), heading=pi / 2, speed=2.0)
    path = locate_body(move_on_track(across, route, time, 1.0), (4.0, 2.0, 1.5), route, time)
    assert np.abs(path.speed).max() < 0.1 and path.width == pytest.approx(4.0, abs=0.1)


def test_the_first_target_that_is_met_decides_and_without_one_the_nearest():
    free = Outcome(
        collided=False, impact_speed=0.0, min_ttc=1.5, clearance=3.0, avoided_speed=9.0, brake_time=1.0, impact_time=inf
    )  # fmt: skip
    aside = Outcome(
        collided=False, impact_speed=0.0, min_ttc=inf, clearance=nan, avoided_speed=nan, brake_time=1.0, impact_time=inf
    )  # fmt: skip
    met, later = (
        Outcome(
            collided=True, impact_speed=v, min_ttc=0.0, clearance=0.0, avoided_speed=2.0, brake_time=1.0, impact_time=t
        )
        for v, t in ((5.0, 2.0), (8.0, 3.0))
    )  # fmt: skip
    assert join_outcomes([free, later, met]) == met
    assert join_outcomes([aside, free]) == free
