"""The frames of a finished dataset, wherever they are: stored in it, or made when they are read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catalogs.sentences import shorten
from flows.store.frame_metadata import check_array, read_local_metadata
from flows.store.frames import read_clip, read_frames
from flows.store.layout import Layout
from tasks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Frames:
    """The stored frames of a dataset; `flows.reading.recipes.Recipes` makes them instead.

    Parameters
    ----------
    layout : of the dataset
    """

    layout: Layout
    _shapes: dict[str, tuple[int, ...]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        # each process looks at the arrays itself: it may be on another machine
        return self.__dict__ | {"_shapes": {}}

    def find(self, index: int) -> Layout:
        """Return the dataset that holds the frames and the road users of a clip."""
        return self.layout

    def read(self, index: int, name: str, frames: Sequence[int] | None = None) -> np.ndarray:
        """Return frames of one array of a clip, as `flows.store.frames.read_clip` does."""
        return read_clip(self.find(index).frames, index, name, frames)

    def read_window(self, index: int, span: slice, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return frames in a row of a clip by the name of the array.

        Raises
        ------
        InputError
            If they are missing, damaged or not those that muSync writes.
        """
        return {name: self._read_span(self.layout, index, span, name) for name in names}

    def _read_span(self, place: Layout, index: int, span: slice, name: str) -> np.ndarray:
        if name not in self._shapes:
            # its metadata again: the dataset may be another since it was opened
            self._shapes[name] = check_array(read_local_metadata(place.frames), name, place.frames)
        try:
            return read_frames(place.frames, name, self._shapes[name], index, span)
        except (ValueError, RuntimeError, OSError) as error:
            raise InputError(
                f"{place.frames / name}: clip {index}: cannot be read; {shorten(error)}: musync lab repair makes it"
                " again"
            ) from None


def open_frames(layout: Layout, manifest: Mapping[str, Any]) -> Frames:
    """Return where the frames of a dataset are read; whether it has any is left to who reads them.

    Parameters
    ----------
    layout, manifest : of the dataset

    Raises
    ------
    InputError
        If what frames are made from is not as recorded.
    """
    if manifest["grid"].get("pictures", True) != "later":
        return Frames(layout=layout)
    # it imports what makes clips, which a reader of stored frames need not wait for
    from flows.reading.recipes import open_recipes

    return open_recipes(layout, manifest)
