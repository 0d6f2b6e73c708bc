"""The MCAP reader gives back every message, each of which keeps to its schema."""

import base64
import json
from collections import defaultdict

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catalogs.entries import load
from tasks.conventions import TICK_CHANNELS
from tests.flows.exporting.conftest import BRAKING, HUMP

reader = pytest.importorskip("mcap.reader", reason="pip install 'musync-gs[export]'")
jsonschema = pytest.importorskip("jsonschema")


@pytest.fixture(scope="module")
def read(export):
    topics, metadata = {}, {}
    for path, label in zip(sorted(export("mcap").glob("*.mcap")), (BRAKING, HUMP), strict=True):
        topics[label] = defaultdict(list)
        with path.open("rb") as stream:
            source = reader.make_reader(stream, validate_crcs=True)
            for schema, channel, message in source.iter_messages():
                topics[label][channel.topic].append((message.log_time, json.loads(message.data), schema))
            metadata[label] = [record.metadata for record in source.iter_metadata()]
    return topics, metadata


def test_telemetry_has_every_tick_to_the_last_bit_and_time_in_nanoseconds(read, stored):
    for label, clip in stored.items():
        messages = read[0][label]["/telemetry"]
        assert [time for time, _, _ in messages] == clip.ticks["t_ns"].tolist()
        for channel in TICK_CHANNELS:
            there = [message.get(channel.name, np.nan) for _, message, _ in messages]
            np.testing.assert_array_equal(there, clip.ticks[channel.name], channel.name)
        assert messages[-1][1]["timestamp"] == {"sec": 1, "nsec": 0}
    assert json.loads(messages[0][2].data)["properties"]["pitch"]["description"].startswith(
        "[rad] body pitch"
    )
    assert read[0][BRAKING]["/telemetry"][-1][1]["pitch"] > 0.001


def test_transforms_are_the_rig_s_poses_and_pitch_about_y_is_nose_down(read, stored):
    for label, clip in stored.items():
        moving = [message for _, message, _ in read[0][label]["/tf"] if message["child_frame_id"] == "rig"]
        rotation = Rotation.from_quat([[m["rotation"][axis] for axis in "xyzw"] for m in moving])
        np.testing.assert_allclose(rotation.as_matrix(), clip.T_world_rig[:, :3, :3], atol=1e-15)
        places = [[m["translation"][axis] for axis in "xyz"] for m in moving]
        np.testing.assert_array_equal(places, clip.T_world_rig[:, :3, 3])
        np.testing.assert_allclose(rotation.as_euler("ZYX")[:, 1], clip.frames["pitch"], atol=1e-12)


def test_pictures_depth_and_camera_are_those_stored(read, stored, toy_dataset):
    camera = load("camera", toy_dataset.inputs / "camera.yaml")
    for label, clip in stored.items():
        topics = read[0][label]
        for frame in range(11):
            packed = np.frombuffer(base64.b64decode(topics["/camera/image"][frame][1]["data"]), np.uint8)
            np.testing.assert_array_equal(
                cv2.imdecode(packed, cv2.IMREAD_COLOR)[..., ::-1], clip.pixels["rgb"][frame]
            )
            for name, kind in (("depth", "<f4"), ("class", "u1")):
                image = topics[f"/camera/{name}"][frame][1]
                values = np.frombuffer(base64.b64decode(image["data"]), kind).reshape(
                    image["height"], image["width"]
                )
                assert image["step"] == values.strides[0]
                np.testing.assert_array_equal(values, clip.pixels[name][frame])
        K = np.reshape(topics["/camera/calibration"][0][1]["K"], (3, 3))
        assert (K[0, 0], K[0, 2], K[1, 2]) == (camera.K[0, 0], 96 / 2 - 0.5, 64 / 2 - 0.5)


def test_each_message_keeps_to_its_schema_and_the_file_names_its_clip(read, stored):
    for label, topics in read[0].items():
        for messages in topics.values():
            _, message, schema = messages[-1]
            jsonschema.validate(message, json.loads(schema.data))
            assert message.keys() <= json.loads(schema.data)["properties"].keys()
        (told,) = read[1][label]
        assert told["clip_id"] == stored[label].clip_id
