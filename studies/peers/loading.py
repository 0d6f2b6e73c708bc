"""Random windows as a team that trains draws them, from the store and its peers: ``python -m studies.peers.loading``.

Three clips of the built-in street (dry, rain, snow) of 81 frames at 480 x 320, colour alone; windows of 16 frames from
random places. Figures are of processor time. A tar has an index of its members, so that it can be drawn from at random;
WebDataset itself reads a tar from its beginning. A form whose library is not installed is left out, and named.
"""

import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import psutil
import torch
import yaml
import zarr
from torch.utils.data import DataLoader, Dataset

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from flows.making.generate import generate_dataset
from flows.store.frames import read_clip
from flows.store.layout import Layout
from studies.peers.store import Mp4, Store, StoredFrames, TarOfPng

FRAMES, WINDOW, DRAWS, REPEATS = 81, 16, 24, 3
GRID = {
    "name": "loading",
    "frames": FRAMES,
    "scene": "street",
    "base": {"brake_onset_s": 1.0, "initial_speed_km_h": 50, "peak_pressure_mpa": 2.3},
    "axes": {
        "weather": {
            "dry": {"weather": "dry"},
            "rain-25": {"weather": "rain", "precipitation_mm_h": 25},
            "snow-3": {"weather": "snow", "precipitation_mm_h": 3, "snow_accumulation_h": 1},
        }
    },
}


class StoreByZarr(Store):
    """The store as Zarr's own Python library reads it."""

    name = "store, read by zarr-python"

    def read(self, first: int, count: int) -> np.ndarray:
        array = zarr.open_array(self.place / "rgb", mode="r", zarr_format=3)
        return np.asarray(array[0, first : first + count])


class StoreLz4(Store):
    """The store of a grid with ``compression: lz4``."""

    name = "store, compression: lz4"
    compression = "lz4"


class TarOfJpeg(TarOfPng):
    """A tar file of JPEG files of quality 95."""

    name, ending, lossless = "tar of JPEG 95, lossy", ".jpg", False

    @staticmethod
    def encode(frame: np.ndarray) -> bytes:
        return cv2.imencode(".jpg", frame[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()


class TarOfJxl(TarOfPng):
    """A tar file of JPEG XL files without loss, at the effort that is decoded the quickest."""

    name, ending = "tar of JPEG XL", ".jxl"

    @staticmethod
    def encode(frame: np.ndarray) -> bytes:
        content: bytes = import_module("imagecodecs").jpegxl_encode(
            frame, lossless=True, effort=1, numthreads=1
        )
        return content

    @staticmethod
    def decode(content: bytes) -> np.ndarray:
        return np.asarray(import_module("imagecodecs").jpegxl_decode(content, numthreads=1))


class TarOfJxlLossy(TarOfJxl):
    """A tar file of JPEG XL files at distance 1, which is meant to look the same."""

    name, lossless = "tar of JPEG XL, distance 1, lossy", False

    @staticmethod
    def encode(frame: np.ndarray) -> bytes:
        content: bytes = import_module("imagecodecs").jpegxl_encode(
            frame, distance=1.0, effort=3, numthreads=1
        )
        return content


class Mp4ShortGroups(Mp4):
    """H.264 with a key frame every 8: a window begins near one."""

    name = "MP4 (H.264, key frame every 8, lossy), PyAV"
    options = {"threads": "1", "g": "8"}  # noqa: RUF012


class Mp4ByTorchcodec(Mp4ShortGroups):
    """The same, read by torchcodec."""

    name = "MP4 (H.264, key frame every 8, lossy), torchcodec"

    def read(self, first: int, count: int) -> np.ndarray:
        decoders: ModuleType = import_module("torchcodec.decoders")
        decoder = decoders.VideoDecoder(
            self.place / "clip.mp4", dimension_order="NHWC", num_ffmpeg_threads=1, seek_mode="approximate"
        )
        return np.asarray(decoder.get_frames_in_range(first, first + count).data)


FORMS: tuple[type[StoredFrames], ...] = (
    Store, StoreLz4, StoreByZarr, TarOfPng, TarOfJxl, TarOfJxlLossy, TarOfJpeg, Mp4, Mp4ShortGroups,
    Mp4ByTorchcodec,
)  # fmt: skip


class Windows(Dataset[torch.Tensor]):
    """Windows of clips in one form, by torch's protocol.

    Parameters
    ----------
    clips : each clip in this form
    draws : clip and first frame of each window
    """

    def __init__(self, clips: list[StoredFrames], draws: list[tuple[int, int]]):
        self.clips, self.draws = clips, draws

    def __len__(self) -> int:
        return len(self.draws)

    def __getitem__(self, item: int) -> torch.Tensor:
        clip, first = self.draws[item]
        return torch.from_numpy(np.ascontiguousarray(self.clips[clip].read(first, WINDOW)))


def measure_rows() -> list[dict[str, Any]]:
    """Write the clips in every form and draw the same windows from each.

    Returns
    -------
    Rows of name, value, unit, peer (the store) and ratio (value over the store's value).
    """
    torch.set_num_threads(1)
    draw = np.random.default_rng(1)
    draws = [(int(draw.integers(len(GRID["axes"]["weather"]))), int(draw.integers(FRAMES - WINDOW)))  # type: ignore[index]
             for _ in range(DRAWS)]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        clips = _make_clips(Path(folder))
        figures: dict[str, dict[str, tuple[float, str]]] = {}
        for form in FORMS:
            try:
                figures[form.name] = dict(_measure_form(form, clips, draws, Path(folder)))
            except (ImportError, OSError, RuntimeError) as error:
                print(f"{form.name}: left out, {str(error).splitlines()[0]}")
    own = figures[Store.name]
    return [
        make_row(f"{name}: {what}", value, unit, "the store", own[what][0])
        for what in own
        for name, measured in figures.items()
        for value, unit in [measured[what]]
    ]


def _measure_form(
    form: type[StoredFrames], clips: list[np.ndarray], draws: list[tuple[int, int]], folder: Path
) -> Iterator[tuple[str, tuple[float, str]]]:
    """Return the measurements of a form, each with its name, value and unit."""
    kept = []
    for index in range(len(clips)):
        place = folder / form.__name__ / str(index)
        place.mkdir(parents=True)
        kept.append(form(place))
    written = least_cpu_s(lambda: [one.write(frames) for one, frames in zip(kept, clips, strict=True)], 1)
    yield "written, frames", (len(clips) * FRAMES / written, "1/CPU-s")
    yield "bytes a frame", (sum(one.size() for one in kept) / len(clips) / FRAMES, "B")
    windows = Windows(kept, draws)
    errors = [np.abs(windows[k].numpy().astype(int) - clips[c][s : s + WINDOW]).max()
              for k, (c, s) in enumerate(draws[:6])]  # fmt: skip
    yield "largest error of a channel", (float(max(errors)), "levels")
    alone = least_cpu_s(lambda: [windows[k] for k in range(len(draws))], REPEATS)
    yield "frames in windows, no workers", (DRAWS * WINDOW / alone, "1/CPU-s")
    for workers in (1, 2):
        least = min(_cpu_of_workers(windows, workers) for _ in range(REPEATS))
        yield f"frames in windows, {workers} workers", (DRAWS * WINDOW / least, "1/CPU-s")


def _cpu_of_workers(windows: Windows, workers: int) -> float:
    """Processor time of one epoch in all processes of a loader, its workers warm [CPU-s]."""
    loader = DataLoader(windows, batch_size=2, num_workers=workers, persistent_workers=True)

    def run_epoch() -> None:
        for _ in loader:
            pass

    run_epoch()
    before = _sum_cpu()
    run_epoch()
    return _sum_cpu() - before


def _sum_cpu() -> float:
    processes = [psutil.Process(), *psutil.Process().children()]
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def _make_clips(place: Path) -> list[np.ndarray]:
    (place / "grid.yaml").write_text(yaml.safe_dump(GRID))
    generate_dataset(str(place / "grid.yaml"), str(place / "data"), runner="threads", workers=1)
    return [read_clip(Layout(place / "data").frames, index, "rgb") for index in range(3)]


if __name__ == "__main__":
    print_rows(measure_rows())
