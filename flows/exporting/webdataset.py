"""WebDataset: one ``.tar`` shard a clip, one sample a frame.

A sample holds ``rgb.png`` (sRGB, as stored), ``arrays.npz`` (depth [m], class and, where the dataset has them, its
instances and labels, as stored) and ``json`` (label and split of the clip; the telemetry at the frame with our names,
units and signs; the poses ``T_world_rig`` and ``T_world_camera``; the road users as their table has them; the camera
with its lens and shutter). Frames and signs are ours: ISO 8855 for world and rig, pitch positive nose-down; camera axes
x right, y down, z forward; pixel centres at +0.5. The samples of a shard stand in the order of time.

Format: https://github.com/webdataset/webdataset, a POSIX tar whose members with one stem are one sample.
"""

import json
import tarfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from flows.exporting.camera import describe_camera
from flows.exporting.dataset import ExportedClip, ExportedDataset
from flows.exporting.road_users import list_objects_by_frame
from tasks.render.contact_sheet import encode_png


def write_webdataset(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``clip-00000.tar`` and so on, numbered in the order of the export.

    Parameters
    ----------
    dataset : with frames
    folder : empty
    """
    for number, clip in enumerate(dataset):
        with tarfile.open(folder / f"clip-{number:05d}.tar", "w", format=tarfile.USTAR_FORMAT) as shard:
            for name, content in _iterate_members(clip, dataset.arrays):
                entry = tarfile.TarInfo(
                    name
                )  # time and owner stay zero: the same dataset gives the same bytes
                entry.size = len(content)
                shard.addfile(entry, BytesIO(content))


def _iterate_members(clip: ExportedClip, names: tuple[str, ...]) -> Iterator[tuple[str, bytes]]:
    arrays = {name: clip.read_array(name) for name in names}
    rgb = arrays.pop("rgb")
    users = list_objects_by_frame(clip)
    for frame, picture in enumerate(rgb):
        # an id has no dot, which would end the key
        key = f"{clip.clip_id}_{frame:06d}"
        packed = BytesIO()
        np.savez_compressed(
            packed, allow_pickle=False, **{name: values[frame] for name, values in arrays.items()}
        )
        yield f"{key}.arrays.npz", packed.getvalue()
        yield f"{key}.json", json.dumps(_describe_frame(clip, frame, users[frame]), allow_nan=False).encode()
        yield f"{key}.rgb.png", encode_png(picture)


def _describe_frame(clip: ExportedClip, frame: int, users: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "label": clip.label,
        "clip_id": clip.clip_id,
        "split": clip.record["split"],
        "weather": clip.record["scenario"]["weather"],
        "telemetry": clip.read_frame_telemetry(frame),
        "T_world_rig": clip.T_world_rig[frame].tolist(),
        "T_world_camera": clip.T_world_camera[frame].tolist(),
        "camera": describe_camera(clip.camera),
    } | ({"objects": users} if clip.plan.settings.has_objects else {})
