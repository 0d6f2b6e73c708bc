"""Pictures to H.264 and back; the same pictures give the same bytes."""

from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

FINE = 18
"""Constant rate factor of films to look at: visually lossless [1]."""


def write_film(
    target: Path | BytesIO, pictures: Sequence[NDArray[np.uint8]], frame_rate_hz: float, crf: int = FINE
) -> None:
    """Encode pictures as H.264 in MP4.

    Parameters
    ----------
    target : file or buffer
    pictures : uint8 [H, W, 3] sRGB each, of even size [1]
    frame_rate_hz : [Hz]
    crf : constant rate factor: 0 is lossless, 51 the worst [1]
    """
    height, width = pictures[0].shape[:2]
    with av.open(str(target) if isinstance(target, Path) else target, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=round(frame_rate_hz))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        # with its macroblock tree, x264 encodes the same small pictures in several ways
        stream.options = {"crf": str(crf), "preset": "medium", "threads": "1", "x264-params": "mbtree=0"}
        for frame in (*_make_frames(pictures), None):
            for packet in stream.encode(frame):
                container.mux(packet)


def through_film(pictures: NDArray[np.uint8], frame_rate_hz: float, crf: int) -> NDArray[np.uint8]:
    """Encode pictures as a film and return the decoded pictures.

    Parameters
    ----------
    pictures : uint8 [F, H, W, 3] sRGB, of even size [1]
    frame_rate_hz : [Hz]
    crf : constant rate factor [1]
    """
    film = BytesIO()
    write_film(film, list(pictures), frame_rate_hz, crf)
    film.seek(0)
    with av.open(film, "r", format="mp4") as container:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])


def _make_frames(pictures: Iterable[NDArray[np.uint8]]) -> Iterable[av.VideoFrame]:
    for picture in pictures:
        yield av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
