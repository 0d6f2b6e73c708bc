"""LeRobot v3: an episode a clip, one Parquet file and one film each.

``observation.images.front`` is the picture as H.264 (4:2:0, constant rate factor 18: not lossless);
``observation.state`` the telemetry at the frame in float32, with our names, units and signs (pitch positive nose-down);
``observation.pose`` our ``T_world_rig`` (ISO 8855: x forward, y left, z up), row by row, in float64; ``action`` the
commanded brake pressure [MPa]; the task is the clip's label. With road users ``observation.environment_state`` has
eleven numbers for each of as many as any clip has: 1 where the clip has it and else 0, middle, yaw and velocity in the
axes of the rig, and size [m, rad, m/s]. ``timestamp`` is the time since the start of the clip [s]. Columns that a clip
does not represent at every frame (of a reference trace) are not in the state. Episodes are in the order of the grid's
splits, and ``splits`` has the range of episodes of each; without splits all are ``train``. Statistics are over all
frames; those of pictures are of colours in 0..1, sampled.

Format: codebase version v3.0, https://huggingface.co/docs/lerobot/lerobot-dataset-v3
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from flows.exporting.dataset import ExportedClip, ExportedDataset
from flows.exporting.road_users import list_objects_by_frame
from flows.exporting.running_statistics import RunningStatistics
from flows.reading.film import write_film
from flows.store.layout import write_json
from flows.store.missing import null_missing
from tasks.errors import InputError

CAMERA, STATE, POSE, ACTION = "observation.images.front", "observation.state", "observation.pose", "action"
ACTION_COLUMN = "brake_pressure_mpa"
ENVIRONMENT = "observation.environment_state"
FACTS = ("present", "x", "y", "z", "yaw", "v_x", "v_y", "v_z", "length", "width", "height")
"""Numbers of a road user in the environment's state."""
NO_STATE = frozenset({"t_ns", ACTION_COLUMN})
"""Columns of the tick table that are no part of the state."""
FILES_PER_CHUNK = 1000
SAMPLED = 4
"""Statistics of pictures take every fourth pixel of every fourth row; LeRobot's own writer samples them too."""
COUNTED = ("frame_index", "episode_index", "index", "task_index")
_FILE_NUMBERS = "chunk-{chunk_index:03d}/file-{file_index:03d}"
DATA_PATH, VIDEO_PATH = f"data/{_FILE_NUMBERS}.parquet", f"videos/{{video_key}}/{_FILE_NUMBERS}.mp4"


def write_lerobot(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``data/``, ``videos/`` and ``meta/``.

    Parameters
    ----------
    dataset : with frames of even size, at a whole number of frames a second
    folder : empty

    Raises
    ------
    InputError
        If the frames are of odd size or the rate no whole number, or a clip does not know its brake pressure.
    """
    camera, rate = dataset.camera, dataset.frame_rate_hz
    if camera.width % 2 or camera.height % 2 or rate != round(rate):
        raise InputError(
            f"{dataset.layout}: --to lerobot needs frames of even size at a whole number a second; they are"
            f" {camera.width} x {camera.height} at {rate:g}"
        )
    known = dataset.known_columns
    if ACTION_COLUMN not in known:
        raise InputError(
            f"{dataset.layout}: --to lerobot takes the brake pressure as the action, and the reference traces of this"
            " dataset do not hold it at every frame: name clips that have it with --clip, or take another format"
        )
    state = tuple(name for name in known if name not in NO_STATE)
    dataset = replace(dataset, rows=sort_by_split(dataset.rows))
    episodes, first, total = [], 0, RunningStatistics()
    for number, clip in enumerate(dataset):
        numbers = {"chunk_index": number // FILES_PER_CHUNK, "file_index": number % FILES_PER_CHUNK}
        columns = _collect_columns(clip, state, number, first, rate)
        if most := _count_road_users(dataset):
            columns[ENVIRONMENT] = _list_environment(clip, most)
        pictures = clip.read_array("rgb")
        data, film = (
            folder / DATA_PATH.format(**numbers),
            folder / VIDEO_PATH.format(video_key=CAMERA, **numbers),
        )
        for file in (data, film):
            file.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(null_missing(_make_table(columns)), data)
        write_film(film, list(pictures), rate)
        own = RunningStatistics()
        for name, values in columns.items():
            own.add(name, values)
        sampled = pictures[:, ::SAMPLED, ::SAMPLED].reshape(-1, 3) / 255.0
        own.add(CAMERA, sampled, frames=len(pictures))
        total.merge(own)
        last = first + len(pictures)
        episodes.append(_describe_episode(clip, number, (first, last), numbers, rate) | _flatten(own))
        first = last
    _write_meta(folder, dataset, state, episodes, total, frames=first)


def sort_by_split(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return records of clips with those of one split beside each other, splits in the order of their first clip."""
    splits = list(dict.fromkeys(row["split"] for row in rows))
    return sorted(rows, key=lambda row: splits.index(row["split"]))


def describe_splits(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Return the episodes of each split, first and behind the last; those of a grid without splits are ``train``.

    Parameters
    ----------
    rows : records of the clips, as `sort_by_split` returns them
    """
    ranges, first = {}, 0
    for split, group in groupby(rows, key=lambda row: row["split"]):
        last = first + len(list(group))
        ranges[split or "train"] = f"{first}:{last}"
        first = last
    return ranges


def _collect_columns(
    clip: ExportedClip, state: Sequence[str], number: int, first: int, rate: float
) -> dict[str, NDArray[Any]]:
    frames = clip.frames
    count = np.arange(len(frames["frame"]), dtype=np.int64)
    return {
        STATE: np.stack([frames[name] for name in state], axis=1).astype(np.float32),
        POSE: np.asarray(frames["T_world_rig"], np.float64),
        ACTION: frames[ACTION_COLUMN].astype(np.float32),
        "timestamp": (count / rate).astype(np.float32),
        "frame_index": count,
        "episode_index": np.full(len(count), number),
        "index": first + count,
        "task_index": np.full(len(count), number),
    }


def _count_road_users(dataset: ExportedDataset) -> int:
    return max(len(row["scenario"].get("objects", ())) for row in dataset.rows)


def _list_environment(clip: ExportedClip, most: int) -> NDArray[np.float32]:
    """Return `FACTS` of each road user at each frame, float32 [F, 11 most]; 0 where there are fewer."""
    rows = list_objects_by_frame(clip)
    facts = np.zeros((len(rows), most, len(FACTS)), np.float32)
    for frame, users in enumerate(rows):
        for row in users:
            w, x, y, z = row["rotation_rig"]
            yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
            facts[frame, row["object"] - 1] = (1, *row["centre_rig"], yaw, *row["velocity_rig"], *row["size"])
    return facts.reshape(len(rows), -1)


def _make_table(columns: Mapping[str, NDArray[Any]]) -> pa.Table:
    return pa.table(
        {
            name: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
            if values.ndim == 2
            else pa.array(values)
            for name, values in columns.items()
        }
    )


def _describe_episode(
    clip: ExportedClip, number: int, span: tuple[int, int], numbers: Mapping[str, int], rate: float
) -> dict[str, Any]:
    return {
        "episode_index": number,
        "tasks": [clip.label],
        "length": span[1] - span[0],
        "data/chunk_index": numbers["chunk_index"],
        "data/file_index": numbers["file_index"],
        "dataset_from_index": span[0],
        "dataset_to_index": span[1],
        f"videos/{CAMERA}/chunk_index": numbers["chunk_index"],
        f"videos/{CAMERA}/file_index": numbers["file_index"],
        f"videos/{CAMERA}/from_timestamp": 0.0,
        f"videos/{CAMERA}/to_timestamp": (span[1] - span[0]) / rate,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }


def _flatten(statistics: RunningStatistics) -> dict[str, Any]:
    rows = _shape_statistics(statistics).items()
    return {f"stats/{name}/{kind}": value for name, row in rows for kind, value in row.items()}


def _shape_statistics(statistics: RunningStatistics) -> dict[str, dict[str, list[Any]]]:
    """Those of pictures have the shape [3, 1, 1] of a normalised picture's channels."""
    rows = statistics.summarise()
    rows[CAMERA] = {
        kind: values if kind == "count" else np.reshape(values, (3, 1, 1)).tolist()
        for kind, values in rows[CAMERA].items()
    }
    return rows


def _describe_features(dataset: ExportedDataset, state: Sequence[str]) -> dict[str, Any]:
    height, width, rate = dataset.camera.height, dataset.camera.width, round(dataset.frame_rate_hz)
    video = {"height": height, "width": width, "codec": "h264", "pix_fmt": "yuv420p", "is_depth_map": False}
    users = [f"{fact}_{number}" for number in range(1, _count_road_users(dataset) + 1) for fact in FACTS]
    environment = {ENVIRONMENT: {"dtype": "float32", "shape": [len(users)], "names": users}} if users else {}
    info = {f"video.{key}": value for key, value in (video | {"fps": rate, "channels": 3}).items()}
    return {
        CAMERA: {
            "dtype": "video",
            "shape": [height, width, 3],
            "names": ["height", "width", "channels"],
            "info": info | {"has_audio": False},
        },
        STATE: {"dtype": "float32", "shape": [len(state)], "names": list(state)},
        POSE: {
            "dtype": "float64",
            "shape": [16],
            "names": [f"T_world_rig_{k // 4}{k % 4}" for k in range(16)],
        },
        ACTION: {"dtype": "float32", "shape": [1], "names": [ACTION_COLUMN]},
        **environment,
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        **{name: {"dtype": "int64", "shape": [1], "names": None} for name in COUNTED},
    }


def _write_meta(
    folder: Path,
    dataset: ExportedDataset,
    state: Sequence[str],
    episodes: list[dict[str, Any]],
    total: RunningStatistics,
    frames: int,
) -> None:
    import pandas as pd

    numbers = {"chunk_index": 0, "file_index": 0}
    meta = folder / "meta"
    table = meta / "episodes" / f"{_FILE_NUMBERS.format(**numbers)}.parquet"
    table.parent.mkdir(parents=True)
    pq.write_table(null_missing(pa.Table.from_pylist(episodes)), table)
    tasks = pd.Index([episode["tasks"][0] for episode in episodes], name="task")
    pd.DataFrame({"task_index": range(len(tasks))}, index=tasks).to_parquet(meta / "tasks.parquet")
    write_json(meta / "stats.json", _shape_statistics(total))
    write_json(
        meta / "info.json",
        {
            "codebase_version": "v3.0",
            "robot_type": dataset.plan.settings.vehicle,
            "total_episodes": len(episodes),
            "total_frames": frames,
            "total_tasks": len(episodes),
            "chunks_size": FILES_PER_CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": round(dataset.frame_rate_hz),
            "splits": describe_splits(dataset.rows),
            "data_path": DATA_PATH,
            "video_path": VIDEO_PATH,
            "features": _describe_features(dataset, state),
        },
    )
