"""Films hold the pictures at their times, whatever size and rate, and are the same bytes again."""

from fractions import Fraction
from io import BytesIO

import av
import cv2
import numpy as np
import pytest

from flows.reading.film import write_film


def make_gradients(height: int, width: int) -> np.ndarray:
    y, x = np.mgrid[:height, :width]
    frames = [np.stack([(x + k) / 2, y, (x + y) / 2], axis=-1) for k in range(5)]
    return np.stack(frames).astype(np.uint8)


@pytest.mark.parametrize(("rate", "seconds"), [(10, "1/10"), (2.5, "2/5"), (0.4, "5/2"), (29.97, "100/2997")])
def test_a_frame_is_shown_at_its_time(rate, seconds):
    film = BytesIO()
    write_film(film, list(make_gradients(32, 48)), rate)
    film.seek(0)
    with av.open(film) as read:
        stream = read.streams.video[0]
        shown = [frame.pts * stream.time_base for frame in read.decode(stream)]
    np.testing.assert_allclose(np.array(shown, float), np.arange(5) * float(Fraction(seconds)), atol=1e-4)


def test_the_same_pictures_give_the_same_film():
    noise = np.random.default_rng(0).integers(0, 255, (12, 96, 160, 3)).astype(np.uint8)
    pictures = [cv2.GaussianBlur(picture, (0, 0), 3) for picture in noise]
    films = set()
    for _ in range(40):
        film = BytesIO()
        write_film(film, pictures, 10.0)
        films.add(film.getvalue())
    assert len(films) == 1
