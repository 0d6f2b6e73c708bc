"""Pictures that went through a film keep their size, and lose what its rate factor says."""

import numpy as np
import pytest

from studies.evaluation.film import through_film
from tests.flows.reading.test_film import make_gradients


@pytest.mark.parametrize(("height", "width"), [(64, 96), (65, 96), (64, 97), (65, 97)])
def test_a_picture_of_odd_size_comes_back_in_its_own_size(height, width):
    frames = make_gradients(height, width)
    back = through_film(frames, 10.0, 1)
    assert back.shape == frames.shape
    error = np.abs(back.astype(int) - frames)
    assert error[:, -2:].mean() < 2 and error[:, :, -2:].mean() < 2 and error.mean() < 2


def test_a_film_gives_back_what_its_rate_factor_leaves() -> None:
    y, x = np.mgrid[:64, :96]
    frames = np.stack([np.stack([x + k, y, x + y], axis=-1) % 256 for k in range(5)]).astype(np.uint8)
    errors = [
        float(np.abs(through_film(frames, 10.0, crf).astype(int) - frames).mean()) for crf in (1, 23, 45)
    ]
    assert through_film(frames, 10.0, 23).shape == frames.shape
    assert errors == sorted(errors) and errors[0] < 3.0
