"""Frames that are made when they are read, with the bytes that would have been stored.

A dataset with ``pictures: later`` records telemetry, inputs and plan, from which its frames follow. Whole clips are
made as in any run, pose check included, into a dataset of the same plan in the user's cache; of more clips than its
bound holds, those go that were read least recently. A window of a clip that is not there is made alone and not kept.
Nothing is written to the dataset. Frames are refused where the telemetry made with them is not the recorded one.
"""

import asyncio
import os
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from filelock import FileLock
from zarr.storage import LocalStore, WrapperStore

from catalogs.sentences import shorten_value
from flows.making.clip import draw_window, make_clip
from flows.making.generate import create_frame_arrays
from flows.making.input_changes import read_kept, refuse_changed_records
from flows.making.locations import find_scene, refuse_changed_scene
from flows.making.plan import Plan, read_plan
from flows.reading.frames import Frames
from flows.store.layout import STAGED_TABLES, Layout, read_json, write_atomically, write_pieces
from flows.store.sealed import read_receipt
from manifests.canonical import content_id
from manifests.explain import as_sentences, find_tool_differences, tools_here
from tasks.errors import InputError
from tasks.kernel_cache import cache_root

BOUND = "MUSYNC_FRAMES_GB"
"""Environment variable: size of the cache of frames [GB]."""
USUAL_BOUND_GB = 20.0
TRIES = 3
"""Times that a clip is made which other readers push out of a cache that is too small for all of them [1]."""

_MAKING = Lock()
"""Held while this process makes a clip: several at once would take the memory of several."""


@dataclass(frozen=True, kw_only=True)
class Recipes(Frames):
    """Frames that are made when they are read.

    Parameters
    ----------
    layout : of the dataset
    cache : dataset in the user's cache, for the code and libraries at hand alone
    ticks : recorded hash of each clip's telemetry
    differences : a sentence for each tool that is another here than the one that made the telemetry
    """

    cache: Layout
    ticks: tuple[str, ...]
    differences: tuple[str, ...]
    _as_recorded: set[int] = field(default_factory=set, init=False, repr=False, compare=False)

    @cached_property
    def plan(self) -> Plan:
        """The plan of the clips with their frames."""
        plan = read_plan(self.layout.root)
        return replace(plan, settings=plan.settings.model_copy(update={"pictures": True}))

    def find(self, index: int) -> Layout:
        """Return the cache, for which the clip is made if it is not there.

        Raises
        ------
        InputError
            If an input is not as recorded or cannot be found, the cache cannot be written, or the telemetry that comes
            out with the frames is not the recorded one.
        """
        if not self.holds(index):
            with self._explain_cache():
                self.prepare_cache()
                with _MAKING, FileLock(self.receipt(index).with_suffix(".lock")):
                    if not self.holds(index):
                        make_clip(self.cache, index, self._find_scene(index))
                        forget_oldest(keep={self.receipt(index)})
        self.refuse_other_motion(index)
        return self.cache

    def read(self, index: int, name: str, frames: Sequence[int] | None = None) -> np.ndarray:
        """Return frames of one array of a clip; one that is damaged in the cache is made again."""
        self.find(index)
        with suppress(InputError):
            return super().read(index, name, frames)
        remove_clip(self.receipt(index))
        return super().read(index, name, frames)

    def read_window(self, index: int, span: slice, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return frames in a row of a clip by the name of the array; they alone are made if the cache lacks the clip.

        Raises
        ------
        InputError
            As `find` raises it.
        """
        if names and self.holds(index):
            self.refuse_other_motion(index)
            with suppress(InputError):
                return {name: self._read_span(self.cache, index, span, name) for name in names}
        if not names:
            return {}
        made, ticks = draw_window(self.layout, index, self._find_scene(index), range(span.start, span.stop))
        self.refuse_other_motion(index, ticks)
        return {name: made[name] for name in names}

    def as_zarr(self) -> Any:
        """Return the Zarr store of the frames."""
        with self._explain_cache():
            self.prepare_cache()
        return FramesMade(self)

    def receipt(self, index: int) -> Path:
        """Return the file in the cache that is there where the clip is."""
        return self.cache.receipt(self.plan.clips[index].clip_id)

    def holds(self, index: int) -> bool:
        """Whether the cache holds a clip, which then counts as read just now."""
        receipt = self.receipt(index)
        with suppress(OSError):  # somebody else's cache, or none yet
            os.utime(receipt)
        return receipt.is_file()

    def prepare_cache(self) -> None:
        """Lay out the dataset in the cache, its plan last; one that is there stays."""
        if self.cache.plan.is_file():
            return
        for name, content in read_kept(self.layout, self.plan.inputs).items():
            write_atomically(self.cache.inputs / name, content)
        create_frame_arrays(self.cache, self.plan)
        self.cache.staging.mkdir(exist_ok=True)
        write_pieces(self.cache.plan, self.plan.file_pieces())

    def read_motion(self, index: int) -> str:
        """Return the hash of the telemetry that a clip in the cache was made with."""
        return read_receipt(self.cache, self.plan.clips[index].clip_id)["content"]["ticks"]

    def refuse_other_motion(self, index: int, ticks: str | None = None) -> None:
        """Raise `InputError` unless the telemetry of frames, by default those in the cache, is the recorded one."""
        if index in self._as_recorded:
            return
        if (ticks or self.read_motion(index)) != self.ticks[index]:
            clip = self.plan.clips[index]
            tools = "; ".join(self.differences) or "none that is recorded"
            raise InputError(
                f"{self.layout}: the frames of clip {clip.label} must show the recorded telemetry; it comes out"
                f" otherwise here, so that they are refused; tools that differ: {tools}: read the dataset with those"
                " that made it"
            )
        self._as_recorded.add(index)

    def _find_scene(self, index: int) -> str:
        record = self.plan.record_of(self.plan.clips[index].scenario.scene)
        refuse_changed_scene(record)
        return find_scene(record)

    @contextmanager
    def _explain_cache(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise InputError(
                f"{self.cache.root.parent}: the cache of frames must be a folder that can be written, with room for a"
                f" clip; {error.strerror}: set MUSYNC_CACHE to one that is"
            ) from None


class FramesMade(WrapperStore[LocalStore]):
    """Zarr store of a cache of frames that makes a clip when a shard of it is first read."""

    def __init__(self, recipes: Recipes) -> None:
        super().__init__(LocalStore(recipes.cache.frames, read_only=True))
        self.recipes = recipes

    async def get(self, key: str, *arguments: Any, **options: Any) -> Any:
        """Return the bytes of a file, or None where there can be none.

        Raises
        ------
        InputError
            As `Recipes.find` raises it, or if other readers push the clip out of the cache again and again.
        """
        _, is_shard, place = key.partition("/c/")
        if not is_shard:
            return await super().get(key, *arguments, **options)
        index, loop = int(place.partition("/")[0]), asyncio.get_running_loop()
        for _ in range(TRIES):
            # in a thread of its own: who makes a clip writes with Zarr, and waits for its loop and the loop's threads
            with ThreadPoolExecutor(1) as own:
                await loop.run_in_executor(own, self.recipes.find, index)
            if (found := await super().get(key, *arguments, **options)) is not None:
                return found
        raise InputError(
            f"{self.recipes.layout}: the cache of frames is too small for those that read: raise {BOUND}"
        )


def open_recipes(layout: Layout, manifest: Mapping[str, Any]) -> Recipes:
    """Return the frames of a dataset that makes them when they are read.

    Parameters
    ----------
    layout, manifest : of the dataset

    Raises
    ------
    InputError
        If the plan or a kept input is not as recorded.
    """
    refuse_changed_records(layout, manifest)  # type: ignore[arg-type]
    here = tools_here()
    rows = [row for row in find_tool_differences(manifest, here) if row["input"] != "processor"]
    if rows:
        warnings.warn(
            f"{layout}: its frames are made with other tools than its telemetry, and can be others than those tools"
            f" would have made: {'; '.join(as_sentences(rows))}",
            stacklevel=2,
        )
    return Recipes(
        layout=layout,
        cache=Layout(_find_caches() / content_id([manifest["run_id"], here["made_with"]])),
        ticks=tuple(clip["content"]["ticks"] for clip in manifest["clips"]),
        differences=tuple(as_sentences(rows)),
    )


def forget_oldest(keep: Collection[Path] = ()) -> None:
    """Remove the clips that were read least recently, until the cache of frames is within its bound.

    Parameters
    ----------
    keep : receipts of clips that stay
    """
    receipts = {path: _find_files(path) for path in _find_caches().glob("*/.staging/*.json")}
    sizes = {path: sum(_stamp(file)[1] for file in files) for path, files in receipts.items()}
    over = sum(sizes.values()) - 1e9 * read_bound()
    for path in sorted(receipts.keys() - set(keep), key=_stamp):
        if over <= 0:
            return
        over -= sizes[path]
        remove_clip(path)


def remove_clip(receipt: Path) -> None:
    """Remove a clip from a cache, its receipt first: without it the clip is made again."""
    for path in [*_find_files(receipt), receipt.with_suffix(".lock")]:
        path.unlink(missing_ok=True)


def read_bound() -> float:
    """Return the size of the cache of frames [GB].

    Raises
    ------
    InputError
        If the environment sets no positive number.
    """
    text = os.environ.get(BOUND, str(USUAL_BOUND_GB))
    with suppress(ValueError):
        if (bound := float(text)) > 0:
            return bound
    raise InputError(f"{BOUND} must be a number above 0 [GB]; it is {shorten_value(text)}")


def _find_caches() -> Path:
    return cache_root() / "frames"


def _find_files(receipt: Path) -> list[Path]:
    """Return the files of a clip in a cache: its receipt, tables, and those that the receipt names."""
    layout = Layout(receipt.parents[1])
    files = [receipt, *(layout.staged(receipt.stem, table) for table in STAGED_TABLES)]
    with suppress(InputError, KeyError, TypeError):
        files += [layout.root / name for name in read_json(receipt)["artifacts"]]
    return files


def _stamp(path: Path) -> tuple[int, int]:
    """Return when a file was written or marked as read [ns], and its size [B]; of a file that is gone, zeros."""
    with suppress(FileNotFoundError):
        facts = path.stat()
        return facts.st_mtime_ns, facts.st_size
    return 0, 0
