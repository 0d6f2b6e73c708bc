"""Messages of Foxglove's well-known schemas as JSON, and our own one for telemetry.

The names, fields and frames are those of https://docs.foxglove.dev/docs/visualization/message-schemas: a camera's frame
has x right, y down, z into the picture, as ours; a transform takes child coordinates to the parent.
"""

from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.exporting.dataset import TICK_COLUMNS, describe_columns
from tasks.render.camera import PIXEL_CENTRE, Camera

Message = dict[str, Any]
TELEMETRY = "musync.Telemetry"
_TEXT, _NUMBER, _COUNT = {"type": "string"}, {"type": "number"}, {"type": "integer", "minimum": 0}
_TRUTH = {"type": "boolean"}
TRUTHS = ("contact_f", "contact_r")
"""Columns of the tick table that hold true and false."""
_BYTES = {"type": "string", "contentEncoding": "base64"}
_TIME = {"type": "object", "title": "time", "properties": {"sec": _COUNT, "nsec": _COUNT}}


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
    values : float32 or uint8 [H, W]
    """
    height, width = values.shape
    plain = np.ascontiguousarray(values, np.dtype(values.dtype).newbyteorder("<"))
    return _seen(t_ns) | {
        "width": width,
        "height": height,
        "encoding": {"float32": "32FC1", "uint8": "8UC1"}[values.dtype.name],
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
