"""Pictures to H.264 and back, as a viewer of a film gets them."""

from io import BytesIO

import av
import numpy as np
from numpy.typing import NDArray

from flows.reading.film import write_film


def through_film(pictures: NDArray[np.uint8], frame_rate_hz: float, crf: int) -> NDArray[np.uint8]:
    """Encode pictures as a film and return the decoded pictures.

    Parameters
    ----------
    pictures : uint8 [F, H, W, 3] sRGB
    frame_rate_hz : as `write_film` takes it [Hz]
    crf : constant rate factor [1]
    """
    film = BytesIO()
    height, width = pictures.shape[1:3]
    write_film(film, list(pictures), frame_rate_hz, crf)
    film.seek(0)
    with av.open(film, "r", format="mp4") as container:
        return np.stack(
            [frame.to_ndarray(format="rgb24")[:height, :width] for frame in container.decode(video=0)]
        )
