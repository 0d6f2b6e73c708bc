"""MCAP with Foxglove's JSON schemas: one file a clip, which Foxglove and any MCAP reader play.

``/telemetry`` (our own schema) has every tick, 1 kHz, with our names, units and signs: pitch positive nose-down; what
is not represented is absent. ``/tf`` (FrameTransform) has world to rig at every frame, and rig to camera.
``/camera/image`` is CompressedImage (PNG, as stored), ``/camera/depth`` RawImage in 32FC1 [m], ``/camera/class``
RawImage in 8UC1, and ``/camera/calibration`` CameraCalibration.

World and rig are ISO 8855 as ours; the rotation's pitch about +y is positive nose-down. The frame "camera" has x right,
y down, z forward. Pixel centres are whole numbers, as ROS and OpenCV count them, so that the principal point is ours
less half a pixel. Log time is the time since the start of the clip.

Format: https://mcap.dev/spec
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from flows.exporting import foxglove
from flows.exporting.dataset import TICK_COLUMNS, ExportedClip, ExportedDataset
from flows.exporting.poses import compute_quaternions
from tasks.render.contact_sheet import encode_png

TOPICS = {
    "/telemetry": foxglove.TELEMETRY,
    "/tf": "foxglove.FrameTransform",
    "/camera/calibration": "foxglove.CameraCalibration",
    "/camera/image": "foxglove.CompressedImage",
    "/camera/depth": "foxglove.RawImage",
    "/camera/class": "foxglove.RawImage",
}
"""Topics and the names of their schemas."""


def write_mcap(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``NAME.mcap`` for each clip.

    Parameters
    ----------
    dataset : with frames or without
    folder : empty
    """
    from mcap.writer import CompressionType, Writer

    for clip in dataset:
        with (folder / f"{clip.name}.mcap").open("wb") as stream:
            writer = Writer(stream, compression=CompressionType.ZSTD)
            writer.start(profile="", library="musync")
            schemas = {
                name: writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
                for name, schema in foxglove.SCHEMAS.items()
            }
            channels = {
                topic: writer.register_channel(topic, "json", schemas[name])
                for topic, name in TOPICS.items()
                if clip.pictures or not topic.startswith("/camera")
            }
            for topic, t_ns, message in _iterate_messages(clip):
                content = json.dumps(message, allow_nan=False).encode()
                writer.add_message(channels[topic], log_time=t_ns, publish_time=t_ns, data=content)
            writer.add_metadata("musync", _describe_clip(dataset, clip))
            writer.finish()


def _iterate_messages(clip: ExportedClip) -> Iterator[tuple[str, int, foxglove.Message]]:
    """Yield topic, time [ns] and message, in the order of time."""
    frame_of_tick = {int(tick): frame for frame, tick in enumerate(clip.frames["tick"])}
    columns = {name: clip.ticks[name].tolist() for name in TICK_COLUMNS}
    T_world_rig, mount = clip.T_world_rig, clip.camera.T_rig_camera
    turns = compute_quaternions(T_world_rig, scalar_first=False)
    turn = compute_quaternions(mount[None], scalar_first=False)[0]
    arrays = {name: clip.read_array(name) for name in ("rgb", "depth", "class")} if clip.pictures else {}
    for tick, t_ns in enumerate(columns["t_ns"]):
        values = {name: column[tick] for name, column in columns.items()}
        known = {name: value for name, value in values.items() if np.isfinite(value)}
        yield "/telemetry", t_ns, {"timestamp": foxglove.describe_time(t_ns)} | known
        if (frame := frame_of_tick.get(tick)) is None:
            continue
        yield "/tf", t_ns, foxglove.describe_transform(t_ns, "world", "rig", T_world_rig[frame], turns[frame])
        yield "/tf", t_ns, foxglove.describe_transform(t_ns, "rig", "camera", mount, turn)
        if arrays:
            yield "/camera/calibration", t_ns, foxglove.describe_camera(t_ns, clip.camera)
            yield "/camera/image", t_ns, foxglove.describe_png(t_ns, encode_png(arrays["rgb"][frame]))
            yield "/camera/depth", t_ns, foxglove.describe_raw_image(t_ns, arrays["depth"][frame])
            yield "/camera/class", t_ns, foxglove.describe_raw_image(t_ns, arrays["class"][frame])


def _describe_clip(dataset: ExportedDataset, clip: ExportedClip) -> dict[str, Any]:
    return {
        "run_id": dataset.manifest["run_id"],
        "clip_id": clip.clip_id,
        "label": clip.label,
        "scenario": json.dumps(clip.record["scenario"]),
    }
