"""Windows of frames and telemetry as a torch dataset, and an order that a seed decides."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import torch
import zarr
from torch.utils.data import Dataset, Sampler

from flows.store.arrays import arrays_of
from flows.store.layout import Layout
from manifests.manifest import is_quarantined
from tasks.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipWindows(Dataset[dict[str, Any]]):
    """Samples ``{"clip", "start", "telemetry", and one entry an array}``; safe to hand to worker processes.

    Parameters
    ----------
    frames : the Zarr group's path
    clips : index of each clip in the arrays
    telemetry : float32 [clips, frames, columns], in the units of the frame table
    columns : their names
    arrays : of rgb, depth and class
    window : frames in a sample [1]
    starts : first frame of each window in a clip [1]
    left_out : labels of the clips in quarantine that are not among them
    """

    frames: Path
    clips: tuple[int, ...]
    telemetry: torch.Tensor
    columns: tuple[str, ...]
    arrays: tuple[str, ...]
    window: int
    starts: tuple[int, ...]
    left_out: tuple[str, ...]
    _opened: dict[str, zarr.Array] = field(default_factory=dict, init=False, repr=False)

    def __len__(self) -> int:
        return len(self.clips) * len(self.starts)

    def __getitem__(self, item: int) -> dict[str, Any]:
        if not 0 <= item < len(self):
            raise IndexError(item)
        place, turn = divmod(item, len(self.starts))
        clip, span = self.clips[place], slice(self.starts[turn], self.starts[turn] + self.window)
        sample: dict[str, Any] = {
            "clip": clip,
            "start": span.start,
            "telemetry": self.telemetry[place, span],
        }
        return sample | {
            name: torch.from_numpy(np.asarray(self._array(name)[clip, span])) for name in self.arrays
        }

    def __getstate__(self) -> dict[str, Any]:
        # each worker opens the arrays itself: an open store belongs to its process
        return self.__dict__ | {"_opened": {}}

    def _array(self, name: str) -> zarr.Array:
        if name not in self._opened:
            array = zarr.open_group(self.frames, mode="r")[name]
            assert isinstance(array, zarr.Array)
            self._opened[name] = array
        return self._opened[name]


class SeededOrder(Sampler[int]):
    """A shuffled order that depends on seed and epoch alone, whatever the workers or torch's own generator.

    Parameters
    ----------
    length : number of samples [1]
    seed : of the whole training [1]
    """

    def __init__(self, length: int, seed: int):
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
    root: Path,
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
        Listing every argument that breaks a rule.
    """
    layout = Layout(root)
    frames = manifest["grid"]["frames"]
    rows = [
        row for row in manifest["clips"] if clips is None or row["label"] in clips or row["clip_id"] in clips
    ]
    files = sorted((layout.telemetry / "frames").glob("*/*.parquet"))
    known = {f.name for f in pq.read_schema(files[0]) if str(f.type) in {"double", "int64", "bool"}}
    stored = {name for name in arrays_of(labels=True) if (layout.frames / name).is_dir()}
    problems = [
        f"column {name!r}: no such numeric column of the frame table" for name in columns if name not in known
    ]
    problems += [f"array {name!r}: the dataset has {', '.join(sorted(stored)) or 'no frames'}"
                 for name in arrays if name not in stored]  # fmt: skip
    if not 1 <= window <= frames:
        problems.append(f"window must lie in 1 to the {frames} frames of a clip; it is {window}")
    if stride < 1:
        problems.append(f"stride must be 1 or more; it is {stride}")
    named = {name for row in rows for name in (row["label"], row["clip_id"])}
    problems += [f"clip {name!r}: no such label or id in the dataset" for name in set(clips or ()) - named]
    left_out = (
        tuple(row["label"] for row in rows if is_quarantined(row))
        if clips is None and not quarantined
        else ()
    )
    rows = [row for row in rows if row["label"] not in left_out]
    if not rows and not problems:
        problems = [f"{root}: every clip is in quarantine; quarantined=True takes them all the same"]
    if problems:
        raise InputError(problems)
    if left_out:
        warnings.warn(
            f"{len(left_out)} of {len(rows) + len(left_out)} clips are in quarantine and left out"
            f" ({', '.join(left_out)}); quarantined=True takes them too",
            stacklevel=3,
        )
    values: dict[str, np.ndarray] = {}
    for file in files:
        table = pq.read_table(file, columns=["clip_id", *columns])
        block = np.stack([table[name].to_numpy().astype(np.float32) for name in columns], axis=1)
        ids = table["clip_id"].to_pylist()[::frames]
        values |= dict(zip(ids, block.reshape(len(ids), frames, len(columns)), strict=True))
    return ClipWindows(
        frames=layout.frames,
        clips=tuple(row["index"] for row in rows),
        telemetry=torch.from_numpy(np.stack([values[row["clip_id"]] for row in rows])),
        columns=tuple(columns),
        arrays=tuple(arrays),
        window=window,
        starts=tuple(range(0, frames - window + 1, stride)),
        left_out=left_out,
    )
