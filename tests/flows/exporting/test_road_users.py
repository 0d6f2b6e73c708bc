"""A dataset with road users: its table and masks against each other, and every export against them, value by value."""

import json
import tarfile

import numpy as np
import pyarrow.parquet as pq
import pytest

import musync
from catalogs.entries import load
from flows.auditing.audit import audit_dataset
from flows.exporting.export import export_dataset
from flows.making import gate
from flows.making.catalogue import catalogue_of
from flows.making.generate import generate_dataset
from flows.store.layout import Layout
from studies.evaluation.judged_clip import View
from tasks.errors import InputError
from tests.toy_street import write_toy_grid

GRID = """\
name: toy
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 6
frame_rate_hz: 10
base: {{initial_speed_km_h: 40}}
axes:
  traffic:
    alone: {{}}
    lead:
      objects:
        - {{kind: car, track: {{gap_m: 5, speed_km_h: 30, change_at_s: 0.1, acceleration_m_s2: -6}}}}
        - {{kind: adult, track: {{station_m: 9, lateral_m: -2.6, heading_deg: 90, speed_km_h: 5}}}}
"""
CAR, ADULT = 1, 2
EDGES = ["box_left", "box_top", "box_right", "box_bottom"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("users")
    out = folder / "ds"
    generate_dataset(write_toy_grid(folder, GRID), str(out), runner="threads", workers=1)
    return out


@pytest.fixture(scope="module")
def data(made):
    opened = musync.open(made)
    yield opened
    opened.connection.close()


@pytest.fixture(scope="module")
def rows(data):
    return data.pandas("objects").set_index(["frame", "object"])


@pytest.fixture(scope="module")
def masks(data):
    return np.asarray(data.frames["instance"][data["lead"].record["index"]])


def test_only_the_clip_with_road_users_has_rows_and_instances(data, rows, masks):
    assert len(rows) == 12 and set(rows.label) == {"lead"}
    assert set(np.unique(masks)) == {0, CAR, ADULT}
    assert not np.asarray(data.frames["instance"][data["alone"].record["index"]]).any()
    assert data.sql("SELECT count(*) FROM objects WHERE kind = 'adult'").fetchall() == [(6,)]


def test_boxes_are_those_of_the_masks_and_hold_the_projected_body(made, data, rows, masks):
    """The box of a body that nothing hides is within a pixel of the projection of its own 3D box's ends."""
    camera, poses = (
        load("camera", made.parent / "camera.yaml"),
        np.stack(data["lead"].pandas("frames")["T_world_rig"]).reshape(-1, 4, 4),
    )
    for (frame, number), row in rows.iterrows():
        v, u = np.nonzero(masks[frame] == number)
        assert row.visible_pixels == len(u)
        box = row[EDGES].tolist()
        assert box == [u.min(), v.min(), u.max() + 1, v.max() + 1]
        assert row.visibility > 0.9 and row.truncation == 0
        if number == CAR:
            tail = np.array(row.centre_world) - [row["size"][0] / 2, 0, 0]
            ends = tail + np.array(
                [[0, y * row["size"][1] / 2, z * row["size"][2] / 2] for y in (-1, 1) for z in (-1, 1)]
            )
            local = (ends - (poses[frame] @ camera.T_rig_camera)[:3, 3]) @ (
                poses[frame] @ camera.T_rig_camera
            )[:3, :3]
            seen = local[:, :2] / local[:, 2:] * camera.K[0, 0] + camera.K[:2, 2]
            low, high = seen.min(axis=0), seen.max(axis=0)
            overlap = np.prod(np.minimum(high, box[2:]) - np.maximum(low, box[:2]))
            assert overlap / (np.prod(high - low) + np.prod(np.subtract(box[2:], box[:2])) - overlap) > 0.8


def test_the_lead_car_brakes_by_the_closed_form(rows):
    car = rows.xs(CAR, level="object")
    speed = np.linalg.norm(np.stack(car.velocity_world), axis=1)
    np.testing.assert_allclose(speed, 30 / 3.6 - 6 * np.clip(np.arange(6) / 10 - 0.1, 0, None), atol=1e-9)
    way = np.stack(car.centre_world)[:, 0] - (5 + 4.023 / 2)
    since = np.clip(np.arange(6) / 10 - 0.1, 0, None)
    np.testing.assert_allclose(way, 30 / 3.6 * np.arange(6) / 10 - 3 * since**2, atol=1e-9)


def test_an_audit_makes_table_and_masks_again_and_names_a_changed_one(made, tmp_path):
    assert audit_dataset(str(made), share=1, seed=1, runner="threads")["verified"]
    path = Layout(made).object_table(1)
    kept = path.read_bytes()
    table = pq.read_table(path)
    try:
        pq.write_table(table.slice(0, len(table) - 1), path)
        told = audit_dataset(str(made), share=1, seed=1, runner="threads")
    finally:
        path.write_bytes(kept)
    assert not told["verified"]
    assert told["mismatches"][0]["changed"] == ["objects"]


@pytest.fixture(scope="module")
def export(made, tmp_path_factory):
    def to(name):
        folder = tmp_path_factory.mktemp(name) / "out"
        export_dataset(str(made), name, out=str(folder))
        return folder

    return to


def test_coco_has_mask_box_and_motion(export, rows, masks):
    content = json.loads((export("coco") / "annotations.json").read_text())
    names = {row["id"]: row["name"] for row in content["categories"]}
    frames = {image["id"]: image["frame"] for image in content["images"] if image["clip"] == "lead"}
    found = [row for row in content["annotations"] if row["iscrowd"] == 0]
    assert len(found) == 12
    for note in found:
        row = rows.loc[(frames[note["image_id"]], note["instance_id"] - 10_000)]
        assert names[note["category_id"]] == row.kind
        assert note["area"] == row.visible_pixels
        left, top, width, height = note["bbox"]
        assert [left, top, left + width, top + height] == row[
            ["box_left", "box_top", "box_right", "box_bottom"]
        ].tolist()
        np.testing.assert_allclose(note["centre"], row.centre_world)
        np.testing.assert_allclose(note["velocity"], row.velocity_world)


def test_pycocotools_gives_back_the_masks(export, masks):
    module = pytest.importorskip("pycocotools.coco", reason="pip install pycocotools")
    read = module.COCO(str(export("coco") / "annotations.json"))
    for note in read.loadAnns(read.getAnnIds(iscrowd=False)):
        image = read.imgs[note["image_id"]]
        np.testing.assert_array_equal(
            read.annToMask(note).astype(bool), masks[image["frame"]] == note["instance_id"] - 10_000
        )


def test_kitti_labels_project_into_their_boxes(export, rows):
    folder = export("kitti") / "object" / "training"
    P = np.array(
        (folder / "calib" / "000000.txt").read_text().split("P2: ")[1].split("\n")[0].split(), float
    ).reshape(3, 4)
    lines = [(folder / "label_2" / f"{6 + frame:06d}.txt").read_text().splitlines() for frame in range(6)]
    assert not (folder / "label_2" / "000000.txt").read_text()
    for frame, both in enumerate(lines):
        for number, line in enumerate(both, start=1):
            kind, *numbers = line.split()
            row = rows.loc[(frame, number)]
            assert kind == {"car": "Car", "adult": "Pedestrian"}[row.kind]
            values = np.array(numbers, float)
            np.testing.assert_allclose(
                values[3:7], [row.box_left, row.box_top, row.box_right - 1, row.box_bottom - 1]
            )
            np.testing.assert_allclose(values[7:10], np.array(row["size"])[[2, 1, 0]])
            np.testing.assert_allclose(values[13], {CAR: -np.pi / 2, ADULT: -np.pi}[number], atol=2e-2)
            u, v, z = P @ np.append(values[10:13], 1)
            assert row.box_left < u / z < row.box_right
            assert row.box_top < v / z < row.box_bottom + 0.5


def test_nuscenes_has_an_annotation_in_every_sample(export, rows):
    folder = export("nuscenes") / "v1.0-musync"
    tables = {path.stem: json.loads(path.read_text()) for path in folder.glob("*.json")}
    by_token = {name: {row["token"]: row for row in table} for name, table in tables.items()}
    assert len(tables["instance"]) == 2 and len(tables["sample_annotation"]) == 12
    names = {"vehicle.car": CAR, "human.pedestrian.adult": ADULT}
    for note in tables["sample_annotation"]:
        instance = by_token["instance"][note["instance_token"]]
        number = names[by_token["category"][instance["category_token"]]["name"]]
        sample, frame = by_token["sample"][note["sample_token"]], 0
        while sample["prev"]:
            sample, frame = by_token["sample"][sample["prev"]], frame + 1
        row = rows.loc[(frame, number)]
        np.testing.assert_allclose(note["translation"], row.centre_world)
        np.testing.assert_allclose(note["rotation"], row.rotation_world)
        np.testing.assert_allclose(note["size"], np.array(row["size"])[[1, 0, 2]])
        assert bool(note["prev"]) == (frame > 0) and bool(note["next"]) == (frame < 5)
        assert note["visibility_token"] == str(4)


def test_the_devkit_of_nuscenes_reads_boxes_and_velocities(export, rows):
    module = pytest.importorskip("nuscenes.nuscenes", reason="pip install nuscenes-devkit")
    read = module.NuScenes(version="v1.0-musync", dataroot=str(export("nuscenes")), verbose=False)
    for instance in read.instance:
        note, frame = read.get("sample_annotation", instance["first_annotation_token"]), 0
        number = CAR if note["category_name"] == "vehicle.car" else ADULT
        while note["next"]:
            if frame:
                velocity = read.box_velocity(note["token"])
                np.testing.assert_allclose(velocity, rows.loc[(frame, number)].velocity_world, atol=0.35)
            np.testing.assert_allclose(
                read.get_box(note["token"]).center, rows.loc[(frame, number)].centre_world
            )
            note, frame = read.get("sample_annotation", note["next"]), frame + 1


def test_webdataset_and_mcap_carry_the_rows(export, rows):
    with tarfile.open(export("webdataset") / "clip-00001.tar") as shard:
        names = sorted(name for name in shard.getnames() if name.endswith(".json"))
        for frame, name in enumerate(names):
            users = json.loads(shard.extractfile(name).read())["objects"]
            for user in users:
                np.testing.assert_allclose(user["centre_rig"], rows.loc[(frame, user["object"])].centre_rig)
    reader = pytest.importorskip("mcap.reader", reason="pip install mcap")
    (path,) = export("mcap").glob("*lead.mcap")
    with path.open("rb") as stream:
        messages = [
            json.loads(m.data) for _, c, m in reader.make_reader(stream).iter_messages(topics=["/objects"])
        ]
    assert len(messages) == 6
    for frame, message in enumerate(messages):
        for entity in message["entities"]:
            position = entity["cubes"][0]["pose"]["position"]
            np.testing.assert_allclose(
                [position[k] for k in "xyz"], rows.loc[(frame, int(entity["id"]))].centre_world
            )


def test_lerobot_has_the_environment(export, rows):
    folder = export("lerobot")
    state = np.stack(
        pq.read_table(folder / "data/chunk-000/file-001.parquet")["observation.environment_state"].to_pylist()
    )
    assert state.shape == (6, 22)
    for (frame, number), row in rows.iterrows():
        own = state[frame].reshape(2, 11)[number - 1]
        yaw = {CAR: 0, ADULT: np.pi / 2}[number]
        wanted = [1, *row.centre_rig, yaw, *row.velocity_rig, *row["size"]]
        np.testing.assert_allclose(own, wanted, atol=2e-3)


def test_no_check_reads_the_depth_of_what_moves(made, data, masks, monkeypatch):
    index = data["lead"].record["index"]
    stored = {name: np.asarray(data.frames[name][index]) for name in ("rgb", "depth", "class", "instance")}
    assert np.isfinite(stored["depth"][masks > 0]).any()
    seen = []

    def keep(pinhole, *_, **_how):
        seen.append(pinhole["depth"])
        raise InputError("enough")

    monkeypatch.setattr(gate, "prepare_for_checks", keep)
    with pytest.raises(InputError, match="enough"):
        gate.judge_motion(stored, {}, 0.0, catalogue_of(made), catalogue_of(made).camera)
    for depth in (*seen, View(root=made).arrays(index, "depth")[0]):
        assert np.isnan(depth[masks > 0]).all()
        np.testing.assert_array_equal(depth[masks == 0], stored["depth"][masks == 0])
