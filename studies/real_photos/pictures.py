"""Labelled pictures, real ones from a folder and ours from datasets, and the parts into which real ones are split."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

import musync

CLASSES = ("dry", "wet", "snow")
CLASS_OF_WEATHER = {"dry": "dry", "rain": "wet", "snow": "snow"}
"""Class of each kind of weather; clips of other kinds are left out."""
SIDE = 96
"""Pictures are squeezed to a square of this side [px]; the network sees half of it."""
SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".bmp")
PART = 200
"""Photographs of a class that are held out, and as many again for development [1]; at most a third of the class."""
FEWEST = 6
"""Photographs that a class must have [1]."""


@dataclass(frozen=True, kw_only=True)
class Pictures:
    """Labelled pictures; every field has a row a picture.

    Parameters
    ----------
    pixels : uint8 [N, SIDE, SIDE, 3] RGB
    label : place of the class in ``CLASSES``
    name : where a picture comes from
    """

    pixels: NDArray[np.uint8]
    label: NDArray[np.int64]
    name: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.label)

    def take(self, rows: NDArray[np.int64]) -> "Pictures":
        """Return the pictures of some rows."""
        return Pictures(pixels=self.pixels[rows], label=self.label[rows], name=self.name[rows])

    def draw_each(self, count: int, seed: int) -> "Pictures":
        """Return as many pictures of each class, drawn without replacement.

        Parameters
        ----------
        count : of each class [1]
        seed : of the draw [1]
        """
        draw = np.random.default_rng(seed)
        rows = [draw.permutation(np.flatnonzero(self.label == k))[:count] for k in range(len(CLASSES))]
        return self.take(np.concatenate(rows))


def join_pictures(parts: Sequence[Pictures]) -> Pictures:
    """Return several sets as one."""
    return Pictures(
        pixels=np.concatenate([part.pixels for part in parts]),
        label=np.concatenate([part.label for part in parts]),
        name=np.concatenate([part.name for part in parts]),
    )


def read_photographs(folder: Path, names: Mapping[str, str]) -> tuple[Pictures, list[str]]:
    """Read a folder of photographs with a subfolder a class, in the order of their names.

    Parameters
    ----------
    folder : of the subfolders
    names : subfolder of each class that is not called as the class

    Returns
    -------
    pictures : all that can be read
    unread : names of those that cannot

    Raises
    ------
    InputError
        If a subfolder is missing or has too few photographs.
    """
    pixels: list[NDArray[np.uint8]] = []
    label, name, unread, problems = [], [], [], []
    for number, kind in enumerate(CLASSES):
        place = folder / names.get(kind, kind)
        if not place.is_dir():
            problems.append(f"{place}: must be the folder of the {kind} photographs; there is none")
            continue
        for file in sorted(file for file in place.iterdir() if file.suffix.lower() in SUFFIXES):
            found = cv2.imread(str(file), cv2.IMREAD_COLOR)
            if found is None:
                unread.append(f"{place.name}/{file.name}")
                continue
            pixels.append(squeeze_picture(found[:, :, ::-1]))
            label.append(number)
            name.append(f"{place.name}/{file.name}")
        if (count := label.count(number)) < FEWEST:
            problems.append(
                f"{place}: must hold at least {FEWEST} photographs that can be read; it holds {count}"
            )
    if problems:
        raise musync.InputError(problems)
    return Pictures(pixels=np.stack(pixels), label=np.array(label), name=np.array(name)), unread


def split_photographs(photographs: Pictures) -> tuple[Pictures, Pictures, Pictures]:
    """Return the held-out photographs, those for development, and the rest, from which training draws.

    The same folder gives the same parts. Nothing is chosen by the held-out part.
    """
    draw = np.random.default_rng(0)
    parts: tuple[list[NDArray[np.int64]], ...] = ([], [], [])
    for number in range(len(CLASSES)):
        rows = draw.permutation(np.flatnonzero(photographs.label == number))
        size = min(PART, len(rows) // 3)
        for part, chosen in zip(parts, np.split(rows, [size, 2 * size]), strict=True):
            part.append(chosen)
    held_out, development, rest = (photographs.take(np.sort(np.concatenate(part))) for part in parts)
    return held_out, development, rest


def read_frames(data: musync.Dataset, name: str, *, of_a_clip: int) -> Pictures:
    """Read frames of a dataset, evenly spaced in each clip of a kind of weather that has a class.

    Clips in quarantine are taken too: no motion is recovered from them here.

    Parameters
    ----------
    data : dataset with frames
    name : of the dataset, for the pictures' names
    of_a_clip : frames of each clip at most [1]

    Raises
    ------
    InputError
        If the dataset has no frames, or no clip of such a kind.
    """
    if "rgb" not in data.frames:
        raise musync.InputError(f"{name}: must be a dataset with frames; it has none")
    pixels, label, names = [], [], []
    for clip in data.pandas("clips").sort_values("index").to_dict("records"):
        if (kind := CLASS_OF_WEATHER.get(clip["weather"])) is None:
            continue
        shown = data.frames["rgb"][int(clip["index"])]
        for frame in np.unique(np.linspace(0, len(shown) - 1, of_a_clip).round().astype(int)):
            pixels.append(squeeze_picture(shown[frame]))
            label.append(CLASSES.index(kind))
            names.append(f"{name}/{clip['label']}/{frame}")
    if lacking := [kind for number, kind in enumerate(CLASSES) if number not in label]:
        raise musync.InputError(
            f"{name}: must show dry road, rain and snow; it has no clip of {', '.join(lacking)}"
        )
    return Pictures(pixels=np.stack(pixels), label=np.array(label), name=np.array(names))


def squeeze_picture(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a whole picture [H, W, 3] as a square; its sides are squeezed, as the network expects of all."""
    return cv2.resize(np.ascontiguousarray(picture), (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(
        np.uint8
    )
