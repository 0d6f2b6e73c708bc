"""Windows of frames and telemetry as a torch dataset, and an order that a seed decides."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch
from torch.utils.data import Dataset, Sampler

from catalogs.sentences import shorten, shorten_value
from flows.reading.arguments import is_whole
from flows.reading.frames import Frames, open_frames
from flows.reading.table_files import table_files
from flows.store.arrays import arrays_of
from flows.store.frame_metadata import check_frames, read_local_metadata
from flows.store.layout import Layout
from flows.store.parquet_files import CHECKED, CLIPS_PER_FILE, refuse_footer
from flows.store.sealed import recorded_grid
from manifests.manifest import is_quarantined
from tasks.errors import InputError

_NUMERIC = {"double", "int64", "bool"}


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipWindows(Dataset[dict[str, Any]]):
    """Samples ``{"clip", "start", "telemetry", and one entry an array}``; safe to hand to worker processes.

    Parameters
    ----------
    source : of the frames
    clips : index of each clip in the arrays
    telemetry : float32 [clips, frames, columns], in the units of the frame table
    columns : their names
    arrays : of rgb, depth and class
    window : frames in a sample [1]
    starts : first frame of each window in a clip [1]
    left_out : labels of the clips in quarantine that are not among them
    """

    source: Frames
    clips: tuple[int, ...]
    telemetry: torch.Tensor
    columns: tuple[str, ...]
    arrays: tuple[str, ...]
    window: int
    starts: tuple[int, ...]
    left_out: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.clips) * len(self.starts)

    def __getitem__(self, item: int) -> dict[str, Any]:
        if not 0 <= item < len(self):
            raise IndexError(item)
        index, start = divmod(item, len(self.starts))
        clip, span = self.clips[index], slice(self.starts[start], self.starts[start] + self.window)
        sample: dict[str, Any] = {
            "clip": clip,
            "start": span.start,
            "telemetry": self.telemetry[index, span],
        }
        pictures = self.source.read_window(clip, span, self.arrays)
        return sample | {name: torch.from_numpy(values) for name, values in pictures.items()}


class SeededOrder(Sampler[int]):
    """A shuffled order that depends on seed and epoch alone, whatever the workers or torch's own generator.

    Parameters
    ----------
    length : number of samples [1]
    seed : of the whole training [1]

    Raises
    ------
    InputError
        If one of them is no whole number of 0 or more.
    """

    def __init__(self, length: int, seed: int):
        problems = [
            f"{name} must be a whole number of 0 or more; it is {shorten_value(value)}"
            for name, value in (("length", length), ("seed", seed))
            if not (is_whole(value) and value >= 0)
        ]
        if problems:
            raise InputError(problems)
        self.length, self.seed, self.epoch = length, seed, 0

    def set_epoch(self, epoch: int) -> None:
        """Choose the epoch whose order the next iteration gives."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.length

    def __iter__(self) -> Iterator[int]:
        draw = np.random.Generator(np.random.Philox(key=[self.seed, self.epoch]))
        return iter(draw.permutation(self.length).tolist())


def windows_of(
    layout: Layout,
    manifest: Mapping[str, Any],
    window: int,
    stride: int,
    columns: Sequence[str],
    arrays: Sequence[str],
    clips: Sequence[str] | None,
    quarantined: bool,
) -> ClipWindows:
    """The windows of a dataset's clips, in the order of the dataset.

    A clip in quarantine is left out, with a warning, unless ``quarantined`` or ``clips`` asks for it.

    Raises
    ------
    InputError
        Listing every argument that breaks a rule; or files are not as muSync writes them.
    """
    frames = manifest["grid"]["frames"]
    rows = [
        row for row in manifest["clips"] if clips is None or row["label"] in clips or row["clip_id"] in clips
    ]
    files = list(table_files(layout, manifest)["frames"].values())
    settings = recorded_grid(manifest["grid"], layout.manifest)
    known = arrays_of(settings.labels, settings.has_objects) if settings.pictures else {}
    problems = _find_column_problems(files[0], columns)
    problems += [f"array {name!r}: the dataset has {', '.join(sorted(known)) or 'no frames'}"
                 for name in arrays if name not in known]  # fmt: skip
    if not (is_whole(window) and 1 <= window <= frames):
        problems.append(
            f"window must be a whole number in 1 to the {frames} frames of a clip; it is {shorten_value(window)}"
        )
    if repeated := sorted({name for name in columns if list(columns).count(name) > 1}):
        problems.append(f"columns must name each column once; {', '.join(repeated)} stand there twice")
    if not (is_whole(stride) and stride >= 1):
        problems.append(f"stride must be a whole number of 1 or more; it is {shorten_value(stride)}")
    named = {name for row in rows for name in (row["label"], row["clip_id"])}
    problems += [
        f"clip {name!r}: no such label or id in the dataset" for name in sorted(set(clips or ()) - named)
    ]
    if clips is not None and not clips:
        problems.append("clips: must name one or more; None takes all that are not in quarantine")
    left_out = (
        tuple(row["label"] for row in rows if is_quarantined(row))
        if clips is None and not quarantined
        else ()
    )
    rows = [row for row in rows if row["label"] not in left_out]
    if not rows and not problems:
        problems = [f"{layout}: every clip is in quarantine; quarantined=True includes them"]
    if problems:
        raise InputError(problems)
    if left_out:
        warnings.warn(
            f"{len(left_out)} of {len(rows) + len(left_out)} clips are in quarantine and left out"
            f" ({', '.join(left_out)}); quarantined=True takes them too",
            stacklevel=3,
        )
    source = open_frames(layout, manifest)
    if arrays and settings.stores_frames:
        check_frames(
            read_local_metadata(layout.frames), arrays, layout.frames, len(manifest["clips"]), frames
        )
    values: dict[str, np.ndarray] = {}
    for file in files:
        values |= _clip_values(file, columns, frames)
    if absent := [row["label"] for row in rows if row["clip_id"] not in values]:
        raise InputError(
            f"{layout}/telemetry/frames: rows of {len(absent)} clips are missing ({shorten_value(absent)}):"
            " musync verify says which files are damaged"
        )
    return ClipWindows(
        source=source,
        clips=tuple(row["index"] for row in rows),
        telemetry=torch.from_numpy(np.stack([values[row["clip_id"]] for row in rows])),
        columns=tuple(columns),
        arrays=tuple(arrays),
        window=window,
        starts=tuple(range(0, frames - window + 1, stride)),
        left_out=left_out,
    )


def _find_column_problems(file: Path, columns: Sequence[str]) -> list[str]:
    try:
        schema = pq.read_schema(file)
    except (pa.ArrowException, OSError) as error:
        return [
            f"{file}: must be a Parquet file as muSync writes it; {shorten(error)}: musync lab repair makes it again"
        ]
    names = [field.name for field in schema if str(field.type) in _NUMERIC]
    return [
        f"column {name!r}: no such numeric column of the frame table"
        for name in columns
        if names.count(name) != 1
    ]


def _clip_values(file: Path, columns: Sequence[str], frames: int) -> dict[str, np.ndarray]:
    """Columns of one file of the frame table, a block [frame, column] a clip.

    Raises
    ------
    InputError
        If it does not hold ``frames`` rows of each of its clips, one after the other, with these columns as numbers.
    """
    refuse_footer(file, frames * CLIPS_PER_FILE)
    try:
        table = pq.read_table(file, columns=["clip_id", *columns], partitioning=None, **CHECKED)
        numbers = [table[name].to_numpy().astype(np.float32) for name in columns]
        ids = table["clip_id"].to_pylist()
        if odd := [
            field for field in table.schema if field.name in columns and str(field.type) not in _NUMERIC
        ]:
            raise TypeError(f"column {odd[0].name!r} is of type {odd[0].type}")
    except (pa.ArrowException, KeyError, ValueError, TypeError, OSError) as error:
        raise InputError(
            f"{file}: must be a Parquet file as muSync writes it; {shorten(error)}: musync lab repair makes it again"
        ) from None
    named = ids[::frames]
    if [name for name in named for _ in range(frames)] != ids or len(set(named)) != len(named):
        raise InputError(
            f"{file}: must hold {frames} rows of each clip, one clip after the other: musync verify says whether it is"
            " damaged"
        )
    block = np.stack(numbers, axis=1) if numbers else np.empty((len(ids), 0), np.float32)
    return dict(zip(named, block.reshape(len(named), frames, len(columns)), strict=True))
