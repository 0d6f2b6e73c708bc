"""Frames in the dataset store beside other forms of keeping them, in one run: ``python -m studies.peers.store``.

The frames are those of one dry clip of the built-in street, colour alone. Every form writes whole files, and none
waits for the disk: the store's flush is left out. Peers are used as a careful user would: PNG at OpenCV's own level,
HDF5 a chunk a frame with gzip and byte shuffle, tar with an index of its members, MP4 as H.264 at the encoder's own
quality, which is lossy, and lossless.
"""

import io
import os
import tarfile
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, Literal
from unittest.mock import patch

import av
import cv2
import h5py  # type: ignore[import-untyped]
import numpy as np
import yaml

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from flows.making.generate import generate_dataset
from flows.store.frame_metadata import check_array, read_local_metadata
from flows.store.frames import create_arrays, read_clip, read_frames, write_clip
from flows.store.layout import Layout

FRAMES, WINDOW, RATE, REPEATS = 41, 16, 10, 3
GRID = {
    "name": "peers",
    "frames": FRAMES,
    "scene": "street",
    "base": {"brake_onset_s": 1.0, "initial_speed_km_h": 50},
    "axes": {"weather": {"dry": {"weather": "dry"}}},
}


class StoredFrames(ABC):
    """One form of keeping a clip's frames, uint8 [frame, y, x, 3].

    Parameters
    ----------
    place : a folder of its own
    """

    name = ""
    lossless = True

    def __init__(self, place: Path):
        self.place = place

    @abstractmethod
    def write(self, frames: np.ndarray) -> None:
        """Write the clip, over an earlier one."""

    @abstractmethod
    def read(self, first: int, count: int) -> np.ndarray:
        """Return frames in a row, with nothing kept open from an earlier call."""

    def size(self) -> int:
        """Of the frames' files [B]."""
        return sum(path.stat().st_size for path in self.place.rglob("*") if path.is_file())


class Store(StoredFrames):
    """The dataset store: Zarr, a shard a clip, a chunk a frame, Zstandard and a checksum."""

    name = "store (Zarr shards)"
    compression: Literal["zstd", "lz4"] = "zstd"

    def write(self, frames: np.ndarray) -> None:
        if not (self.place / "rgb").is_dir():
            _, height, width, _ = frames.shape
            create_arrays(self.place, (1, len(frames), height, width), False, {}, self.compression)
        write_clip(self.place, 0, {"rgb": frames})

    def read(self, first: int, count: int) -> np.ndarray:
        shape = check_array(read_local_metadata(self.place), "rgb", self.place)
        return read_frames(self.place, "rgb", shape, 0, slice(first, first + count))


class PngFiles(StoredFrames):
    """A PNG file a frame."""

    name = "PNG files"

    def write(self, frames: np.ndarray) -> None:
        for index, frame in enumerate(frames):
            (self.place / f"{index:05d}.png").write_bytes(_encode_png(frame))

    def read(self, first: int, count: int) -> np.ndarray:
        paths = [self.place / f"{index:05d}.png" for index in range(first, first + count)]
        return np.stack([_decode_png(path.read_bytes()) for path in paths])


class Hdf5(StoredFrames):
    """One HDF5 array, a chunk a frame, gzip 4 with byte shuffle and a Fletcher checksum."""

    name = "HDF5 (gzip)"

    def write(self, frames: np.ndarray) -> None:
        with h5py.File(self.place / "clip.h5", "w") as file:
            file.create_dataset(
                "rgb",
                data=frames,
                chunks=(1, *frames.shape[1:]),
                compression="gzip",
                shuffle=True,
                fletcher32=True,
            )

    def read(self, first: int, count: int) -> np.ndarray:
        with h5py.File(self.place / "clip.h5") as file:
            return np.asarray(file["rgb"][first : first + count])


class TarOfPng(StoredFrames):
    """A tar file of PNG files, as WebDataset has them; an index beside it says where each begins."""

    name = "tar of PNG"
    ending = ".png"

    @staticmethod
    def encode(frame: np.ndarray) -> bytes:
        """Return the file of a picture."""
        return _encode_png(frame)

    @staticmethod
    def decode(content: bytes) -> np.ndarray:
        """Return the picture of a file."""
        return _decode_png(content)

    def write(self, frames: np.ndarray) -> None:
        with tarfile.open(self.place / "clip.tar", "w") as tar:
            for index, frame in enumerate(frames):
                content = self.encode(frame)
                member = tarfile.TarInfo(f"{index:05d}{self.ending}")
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))
        with tarfile.open(self.place / "clip.tar") as tar:
            np.save(self.place / "index.npy", [(member.offset_data, member.size) for member in tar])

    def read(self, first: int, count: int) -> np.ndarray:
        places = np.load(self.place / "index.npy")[first : first + count]
        frames = []
        with (self.place / "clip.tar").open("rb") as tar:
            for start, size in places:
                tar.seek(int(start))
                frames.append(self.decode(tar.read(int(size))))
        return np.stack(frames)


class Mp4(StoredFrames):
    """H.264 at the encoder's own quality (CRF 23, a key frame every 250 at most), one thread: lossy."""

    name = "MP4 (H.264, lossy)"
    lossless = False
    codec, pixels, options = "libx264", "yuv420p", {"threads": "1"}

    def write(self, frames: np.ndarray) -> None:
        with av.open(str(self.place / "clip.mp4"), "w") as file:
            stream: Any = file.add_stream(self.codec, rate=RATE, options=self.options)
            stream.height, stream.width, stream.pix_fmt = *frames.shape[1:3], self.pixels
            for frame in frames:
                file.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
            file.mux(stream.encode())

    def read(self, first: int, count: int) -> np.ndarray:
        frames = []
        with av.open(str(self.place / "clip.mp4")) as file:
            stream = file.streams.video[0]
            stream.codec_context.thread_count = 1
            assert stream.time_base is not None
            start = Fraction(first, RATE)
            file.seek(int(start / stream.time_base), stream=stream)
            for frame in file.decode(stream):
                if frame.pts is not None and frame.pts * stream.time_base >= start:
                    frames.append(frame.to_ndarray(format="rgb24"))
                    if len(frames) == count:
                        break
        return np.stack(frames)


class Mp4Lossless(Mp4):
    """H.264 of RGB without loss."""

    name = "MP4 (H.264 RGB, lossless)"
    lossless = True
    codec, pixels = "libx264rgb", "rgb24"
    options = {"threads": "1", "qp": "0"}  # noqa: RUF012


FORMS = (Store, PngFiles, Hdf5, TarOfPng, Mp4, Mp4Lossless)


def measure_rows() -> list[dict[str, Any]]:
    """Write and read one clip in every form.

    Returns
    -------
    Rows of name, value, unit, peer (the store) and ratio (value over the store's value).

    Raises
    ------
    RuntimeError
        If a form without loss gives other pixels back.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        frames = _make_frames(place)
        figures: dict[str, dict[str, tuple[float, str]]] = {}
        for form in FORMS:
            (place / form.__name__).mkdir()
            figures[form.name] = dict(_measure_form(form(place / form.__name__), frames))
    return [
        _compare(f"{name}: {what}", value, unit, figures[Store.name][what][0] if name != Store.name else 0.0)
        for what in figures[Store.name]
        for name, measured in figures.items()
        for value, unit in [measured[what]]
    ]


def _compare(name: str, value: float, unit: str, own: float) -> dict[str, Any]:
    """A row; without a ratio where there is nothing to hold the value against."""
    return make_row(name, value, unit, "the store", own) if own else make_row(name, value, unit)


def _measure_form(form: StoredFrames, frames: np.ndarray) -> Iterator[tuple[str, tuple[float, str]]]:
    """Return the measurements of a form, each with its name, value and unit."""
    with patch.object(os, "fsync", lambda descriptor: None):
        yield "write, frames", (len(frames) / least_cpu_s(lambda: form.write(frames), REPEATS), "1/CPU-s")
    back = form.read(0, len(frames))
    window = form.read(FRAMES // 2, WINDOW)
    if not np.array_equal(window, back[FRAMES // 2 :][:WINDOW]) or (
        form.lossless and not np.array_equal(back, frames)
    ):
        raise RuntimeError(f"{form.name} gave other pixels back")
    yield "bytes a frame", (form.size() / len(frames), "B")
    clip_s = least_cpu_s(lambda: form.read(0, len(frames)), REPEATS)
    yield "read whole clips, frames", (len(frames) / clip_s, "1/CPU-s")
    starts = np.random.default_rng(1).integers(0, len(frames) - WINDOW, 8)
    for name, count in (("one random frame", 1), (f"a window of {WINDOW} frames", WINDOW)):
        each = least_cpu_s(partial(_read_windows, form, starts, count), REPEATS) / len(starts)
        yield name, (1000 * each, "CPU-ms")
    error = np.abs(back.astype(int) - frames).max()
    yield "largest error of a channel", (float(error), "levels")


def _read_windows(form: StoredFrames, starts: np.ndarray, count: int) -> None:
    for start in starts:
        form.read(int(start), count)


def _make_frames(place: Path) -> np.ndarray:
    """Return the frames of one dry clip of the built-in street."""
    (place / "grid.yaml").write_text(yaml.safe_dump(GRID))
    generate_dataset(str(place / "grid.yaml"), str(place / "data"), runner="threads", workers=1)
    return read_clip(Layout(place / "data").frames, 0, "rgb")


def _encode_png(frame: np.ndarray) -> bytes:
    return cv2.imencode(".png", frame[..., ::-1])[1].tobytes()


def _decode_png(content: bytes) -> np.ndarray:
    return np.asarray(cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR))[..., ::-1]


if __name__ == "__main__":
    print_rows(measure_rows())
