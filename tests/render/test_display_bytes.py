"""The table of sRGB bytes against the formula that it stands for."""

import numpy as np

from tasks.render.composition import encode_8bit
from tasks.render.display_bytes import encode_picture


def test_every_light_has_the_byte_of_the_formula() -> None:
    """Among them each number about the places where the byte changes, and what lies outside 0 to 1."""
    every = np.arange(np.float32(1e-5).view(np.uint32), np.float32(1.1).view(np.uint32), 101, dtype=np.uint32)
    first = every[np.flatnonzero(np.diff(encode_8bit(every.view(np.float32)).astype(int))) + 1]
    near = (first[:, None] + np.arange(-101, 1)).ravel().astype(np.uint32)
    light = np.concatenate([every, near]).view(np.float32)
    light = np.concatenate([light, np.float32([0, -0.0, -1, -np.inf, np.inf, 1, 7])])
    wanted = encode_8bit(np.clip(light, -1, 2))
    assert len(first) == 255
    np.testing.assert_array_equal(encode_picture(light), wanted)


def test_a_picture_keeps_its_shape_and_nan_is_black() -> None:
    picture = np.full((4, 6, 3), 0.5, np.float32)[:, ::2]  # not contiguous
    picture[1, 2] = np.nan
    encoded = encode_picture(picture)
    assert encoded.shape == (4, 3, 3) and encoded.dtype == np.uint8
    assert not encoded[1, 2].any() and (np.delete(encoded.reshape(12, 3), 5, axis=0) == 188).all()
