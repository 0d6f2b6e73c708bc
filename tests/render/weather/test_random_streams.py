"""Counter-based random numbers against their published answers."""

import numpy as np
import pytest

from tasks.render.weather.random_streams import lattice_unit, philox, scale_to_unit, stream_key


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_philox_gives_the_known_answers_of_random123(counter, key, answer):
    words = philox(*(np.uint64(c) for c in counter), np.uint64(key[0] | key[1] << 32))
    assert tuple(int(word) for word in words) == answer


def test_streams_differ_by_name_and_by_seed():
    keys = {stream_key(seed, name) for seed in (-1, 0, 1, 2**70) for name in ("rain", "snow", "puddles")}
    assert len(keys) == 12
    assert all(0 <= key < 2**64 for key in keys)


def test_unit_numbers_stay_inside_the_open_interval():
    assert 0 < scale_to_unit(np.uint64(0)) < 1e-9
    assert 1 - 1e-9 < scale_to_unit(np.uint64(0xFFFFFFFF)) < 1


def test_lattice_numbers_are_uniform_and_neighbours_are_independent():
    key = np.uint64(stream_key(3, "lattice"))
    values = np.array([[lattice_unit(x, y, key) for x in range(-60, 60)] for y in range(-60, 60)])
    assert values.mean() == pytest.approx(0.5, abs=0.01)
    assert values.std() == pytest.approx(12**-0.5, abs=0.005)
    for shifted in (np.roll(values, 1, axis=0), np.roll(values, 1, axis=1)):
        assert abs(np.corrcoef(values.ravel(), shifted.ravel())[0, 1]) < 0.03
