"""MCAP with Foxglove's JSON schemas: one file a clip, which Foxglove and any MCAP reader play.

``/telemetry`` (our own schema) has every tick, 1 kHz, with our names, units and signs: pitch positive nose-down; what
is not represented is absent. ``/tf`` (FrameTransform) has world to rig at every frame, and rig to camera.
``/camera/image`` is CompressedImage (PNG, as stored), ``/camera/depth`` RawImage in 32FC1 [m], ``/camera/class``
RawImage in 8UC1, and ``/camera/calibration`` CameraCalibration. With road users ``/objects`` (SceneUpdate) has their
boxes in the world, a cube an entity, and ``/camera/instance`` RawImage in 16UC1 their numbers.

World and rig are ISO 8855 as ours; the rotation's pitch about +y is positive nose-down. The frame "camera" has x right,
y down, z forward. Pixel centres are whole numbers, as ROS and OpenCV count them, so that the principal point is ours
less half a pixel. Log time is the time since the start of the clip.

Format: https://mcap.dev/spec
"""

import json
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.exporting.dataset import TICK_COLUMNS, ExportedClip, ExportedDataset, describe_columns
from flows.exporting.poses import compute_quaternions
from flows.exporting.road_users import list_objects_by_frame
from tasks.render.camera import PIXEL_CENTRE, Camera
from tasks.render.contact_sheet import encode_png

Message = dict[str, Any]
TELEMETRY = "musync.Telemetry"
_TEXT, _NUMBER, _COUNT = {"type": "string"}, {"type": "number"}, {"type": "integer", "minimum": 0}
_TRUTH = {"type": "boolean"}
TRUTHS = ("contact_f", "contact_r")
"""Columns of the tick table that hold true and false."""
_BYTES = {"type": "string", "contentEncoding": "base64"}
_TIME = {"type": "object", "title": "time", "properties": {"sec": _COUNT, "nsec": _COUNT}}
TOPICS = {
    "/telemetry": TELEMETRY,
    "/tf": "foxglove.FrameTransform",
    "/camera/calibration": "foxglove.CameraCalibration",
    "/camera/image": "foxglove.CompressedImage",
    "/camera/depth": "foxglove.RawImage",
    "/camera/class": "foxglove.RawImage",
    "/objects": "foxglove.SceneUpdate",
    "/camera/instance": "foxglove.RawImage",
}
"""Topics and the names of their schemas."""
OF_ROAD_USERS = ("/objects", "/camera/instance")


def _object(title: str, **properties: Any) -> Message:
    return {"title": title, "type": "object", "properties": properties}


def _numbers(length: int | None = None) -> Message:
    sizes = {} if length is None else {"minItems": length, "maxItems": length}
    return {"type": "array", "items": _NUMBER, **sizes}


SCHEMAS: dict[str, Message] = {
    schema["title"]: schema
    for schema in (
        _object("foxglove.CompressedImage", timestamp=_TIME, frame_id=_TEXT, data=_BYTES, format=_TEXT),
        _object(
            "foxglove.RawImage",
            timestamp=_TIME,
            frame_id=_TEXT,
            width=_COUNT,
            height=_COUNT,
            encoding=_TEXT,
            step=_COUNT,
            data=_BYTES,
        ),
        _object(
            "foxglove.CameraCalibration",
            timestamp=_TIME,
            frame_id=_TEXT,
            width=_COUNT,
            height=_COUNT,
            distortion_model=_TEXT,
            D=_numbers(),
            K=_numbers(9),
            R=_numbers(9),
            P=_numbers(12),
        ),
        _object(
            "foxglove.SceneUpdate",
            deletions={"type": "array", "items": _object("foxglove.SceneEntityDeletion")},
            entities={"type": "array", "items": _object("foxglove.SceneEntity", id=_TEXT, frame_id=_TEXT)},
        ),
        _object(
            "foxglove.FrameTransform",
            timestamp=_TIME,
            parent_frame_id=_TEXT,
            child_frame_id=_TEXT,
            translation=_object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER),
            rotation=_object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
        ),
        _object(
            TELEMETRY,
            timestamp=_TIME,
            **{
                name: (_TRUTH if name in TRUTHS else _NUMBER)
                | {"description": f"[{words['unit'] or '1'}] {words['description']}"}
                for name, words in describe_columns(TICK_COLUMNS).items()
            },
        ),
    )
}


def describe_time(t_ns: int) -> dict[str, int]:
    """Return a time since the start of the clip [ns] as Foxglove writes it."""
    return {"sec": t_ns // 10**9, "nsec": t_ns % 10**9}


def describe_png(t_ns: int, png: bytes) -> Message:
    """Return a picture of the camera as ``foxglove.CompressedImage``."""
    return _seen(t_ns) | {"data": b64encode(png).decode(), "format": "png"}


def describe_raw_image(t_ns: int, values: NDArray[Any]) -> Message:
    """Return an array of the camera's pixels as ``foxglove.RawImage``.

    Parameters
    ----------
    t_ns : time since the start of the clip [ns]
    values : float32, uint8 or uint16 [H, W]
    """
    height, width = values.shape
    plain = np.ascontiguousarray(values, np.dtype(values.dtype).newbyteorder("<"))
    return _seen(t_ns) | {
        "width": width,
        "height": height,
        "encoding": {"float32": "32FC1", "uint8": "8UC1", "uint16": "16UC1"}[values.dtype.name],
        "step": width * values.dtype.itemsize,
        "data": b64encode(plain.tobytes()).decode(),
    }


def describe_camera(t_ns: int, camera: Camera) -> Message:
    """Return a camera as ``foxglove.CameraCalibration``, whose pixel centres are whole numbers."""
    K = camera.K - PIXEL_CENTRE
    return _seen(t_ns) | {
        "width": camera.width,
        "height": camera.height,
        "distortion_model": "plumb_bob",
        "D": [0.0] * 5 if camera.distortion is None else camera.distortion.tolist(),
        "K": K.ravel().tolist(),
        "R": np.eye(3).ravel().tolist(),
        "P": np.column_stack((K, np.zeros(3))).ravel().tolist(),
    }


def describe_boxes(t_ns: int, rows: Sequence[Mapping[str, Any]]) -> Message:
    """Return the boxes of road users in the world as ``foxglove.SceneUpdate``.

    Parameters
    ----------
    t_ns : time since the start of the clip [ns]
    rows : of the frame's road users
    """
    entities = []
    for row in rows:
        w, x, y, z = row["rotation_world"]
        pose = {
            "position": dict(zip("xyz", row["centre_world"], strict=True)),
            "orientation": {"x": x, "y": y, "z": z, "w": w},
        }
        cube = {
            "pose": pose,
            "size": dict(zip("xyz", row["size"], strict=True)),
            "color": {"r": 1.0, "g": 0.6, "b": 0.0, "a": 0.4},
        }
        facts = {name: row[name] for name in ("kind", "visibility", "truncation", "velocity_world")}
        entities.append(
            {
                "timestamp": describe_time(t_ns),
                "frame_id": "world",
                "id": str(row["object"]),
                "lifetime": describe_time(0),
                "frame_locked": False,
                "metadata": [{"key": name, "value": str(value)} for name, value in facts.items()],
                "cubes": [cube],
            }
        )
    return {"deletions": [], "entities": entities}


def describe_transform(
    t_ns: int, parent: str, child: str, pose: NDArray[np.float64], quaternion_xyzw: NDArray[np.float64]
) -> Message:
    """Return a pose as ``foxglove.FrameTransform``.

    Parameters
    ----------
    t_ns : time since the start of the clip [ns]
    parent, child : names of the frames
    pose : child to parent [4, 4] [m]
    quaternion_xyzw : its rotation [4] [1]
    """
    return {
        "timestamp": describe_time(t_ns),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": dict(zip("xyz", pose[:3, 3].tolist(), strict=True)),
        "rotation": dict(zip("xyzw", quaternion_xyzw.tolist(), strict=True)),
    }


def _seen(t_ns: int) -> Message:
    return {"timestamp": describe_time(t_ns), "frame_id": "camera"}


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
                for name, schema in SCHEMAS.items()
            }
            channels = {
                topic: writer.register_channel(topic, "json", schemas[name])
                for topic, name in TOPICS.items()
                if (clip.pictures or not topic.startswith("/camera"))
                and (clip.objects or topic not in OF_ROAD_USERS)
            }
            for topic, t_ns, message in _iterate_messages(clip):
                content = json.dumps(message, allow_nan=False).encode()
                writer.add_message(channels[topic], log_time=t_ns, publish_time=t_ns, data=content)
            writer.add_metadata("musync", _describe_clip(dataset, clip))
            writer.finish()


def _iterate_messages(clip: ExportedClip) -> Iterator[tuple[str, int, Message]]:
    """Yield topic, time [ns] and message, in the order of time."""
    frame_of_tick = {int(tick): frame for frame, tick in enumerate(clip.frames["tick"])}
    columns = {name: clip.ticks[name].tolist() for name in TICK_COLUMNS}
    T_world_rig, mount = clip.T_world_rig, clip.camera.T_rig_camera
    turns = compute_quaternions(T_world_rig, scalar_first=False)
    turn = compute_quaternions(mount[None], scalar_first=False)[0]
    names = ("rgb", "depth", "class", *(["instance"] if clip.objects else []))
    arrays = {name: clip.read_array(name) for name in names} if clip.pictures else {}
    users = list_objects_by_frame(clip)
    for tick, t_ns in enumerate(columns["t_ns"]):
        values = {name: column[tick] for name, column in columns.items()}
        known = {name: value for name, value in values.items() if np.isfinite(value)}
        yield "/telemetry", t_ns, {"timestamp": describe_time(t_ns)} | known
        if (frame := frame_of_tick.get(tick)) is None:
            continue
        yield "/tf", t_ns, describe_transform(t_ns, "world", "rig", T_world_rig[frame], turns[frame])
        yield "/tf", t_ns, describe_transform(t_ns, "rig", "camera", mount, turn)
        if clip.objects:
            yield "/objects", t_ns, describe_boxes(t_ns, users[frame])
        if arrays:
            yield "/camera/calibration", t_ns, describe_camera(t_ns, clip.camera)
            yield "/camera/image", t_ns, describe_png(t_ns, encode_png(arrays["rgb"][frame]))
            yield "/camera/depth", t_ns, describe_raw_image(t_ns, arrays["depth"][frame])
            yield "/camera/class", t_ns, describe_raw_image(t_ns, arrays["class"][frame])
        if "instance" in arrays:
            yield "/camera/instance", t_ns, describe_raw_image(t_ns, arrays["instance"][frame])


def _describe_clip(dataset: ExportedDataset, clip: ExportedClip) -> dict[str, Any]:
    return {
        "run_id": dataset.manifest["run_id"],
        "clip_id": clip.clip_id,
        "label": clip.label,
        "scenario": json.dumps(clip.record["scenario"]),
    }
