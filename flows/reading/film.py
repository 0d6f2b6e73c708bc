"""Pictures to H.264; the same pictures give the same bytes.

The chroma of H.264 4:2:0 needs an even width and height: a picture of odd size gets its last row or column once more.
"""

from collections.abc import Iterable, Sequence
from fractions import Fraction
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
    pictures : uint8 [H, W, 3] sRGB each, of one size
    frame_rate_hz : a whole number or a fraction, to a thousandth [Hz]
    crf : constant rate factor: 0 is lossless, 51 the worst [1]
    """
    height, width = pictures[0].shape[:2]
    rate = Fraction(frame_rate_hz).limit_denominator(1000)
    with av.open(str(target) if isinstance(target, Path) else target, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.width, stream.height, stream.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
        # with its macroblock tree, x264 encodes the same small pictures in several ways
        stream.options = {"crf": str(crf), "preset": "medium", "threads": "1", "x264-params": "mbtree=0"}
        for frame in (*_make_frames(pictures), None):
            for packet in stream.encode(frame):
                container.mux(packet)


def _make_frames(pictures: Iterable[NDArray[np.uint8]]) -> Iterable[av.VideoFrame]:
    for picture in pictures:
        height, width = picture.shape[:2]
        even = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        yield av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
