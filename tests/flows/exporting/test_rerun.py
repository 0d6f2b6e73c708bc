"""Rerun's own reader gives back telemetry, poses and pixels on our time."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tasks.conventions import TICK_CHANNELS
from tests.flows.exporting.conftest import BRAKING, HUMP

chunk = pytest.importorskip("rerun.chunk", reason="pip install 'musync-gs[export]'")


@pytest.fixture(scope="module")
def read(export):
    """Rows of every entity's component by clip: (time [ns] or None, value) in the order of time."""
    clips = {}
    for path, label in zip(sorted(export("rerun").glob("*.rrd")), (BRAKING, HUMP), strict=True):
        reader = chunk.RrdReader(path)
        rows: dict[tuple[str, str], list] = {}
        for part in reader.stream():
            batch = part.to_record_batch()
            names = [name for name in batch.schema.names if ":" in name]
            times = (
                batch["t"].cast("int64").to_pylist() if "t" in batch.schema.names else [None] * batch.num_rows
            )
            assert "log_time" not in batch.schema.names
            for name in names:
                column = batch[name]
                rows.setdefault((part.entity_path, name), []).extend(
                    (time, column[k].values) for k, time in enumerate(times)
                )
        for values in rows.values():
            values.sort(key=lambda row: -1 if row[0] is None else row[0])
        clips[label] = reader.recordings()[0], rows
    return clips


def test_telemetry_has_every_tick_in_float64(read, stored):
    for label, clip in stored.items():
        store, rows = read[label]
        assert store.recording_id == clip.clip_id
        for channel in TICK_CHANNELS[1:]:
            series = rows[f"/telemetry/{channel.name}", "Scalars:scalars"]
            assert [time for time, _ in series] == clip.ticks["t_ns"].tolist()
            values = np.array([value[0].as_py() for _, value in series])
            np.testing.assert_array_equal(values, clip.ticks[channel.name].astype(float), channel.name)
    caption = read[BRAKING][1]["/telemetry/pitch", "SeriesLines:names"][0][1][0].as_py()
    assert caption == "body pitch about static equilibrium, nose-down positive [rad]"


def test_poses_pictures_depth_and_classes_are_those_stored(read, stored):
    for label, clip in stored.items():
        rows = read[label][1]
        turns = [value[0].as_py() for _, value in rows["/world/rig", "Transform3D:quaternion"]]
        places = [value[0].as_py() for _, value in rows["/world/rig", "Transform3D:translation"]]
        pitch = Rotation.from_quat(turns).as_euler("ZYX")[:, 1]
        np.testing.assert_allclose(pitch, clip.frames["pitch"], atol=1e-6)  # nose-down positive, in float32
        np.testing.assert_allclose(places, clip.T_world_rig[:, :3, 3], atol=1e-5)
        for frame in range(11):
            time, blob = rows["/world/rig/camera/rgb", "EncodedImage:blob"][frame]
            assert time == clip.frames["t_ns"][frame]
            packed = np.asarray(blob[0].values, np.uint8)
            np.testing.assert_array_equal(
                cv2.imdecode(packed, cv2.IMREAD_COLOR)[..., ::-1], clip.pixels["rgb"][frame]
            )
            for entity, kind, name in (
                ("depth", np.float32, "DepthImage:buffer"),
                ("class", np.uint8, "SegmentationImage:buffer"),
            ):
                buffer = np.asarray(rows[f"/world/rig/camera/{entity}", name][frame][1][0].values, np.uint8)
                np.testing.assert_array_equal(buffer.view(kind).reshape(64, 96), clip.pixels[entity][frame])
