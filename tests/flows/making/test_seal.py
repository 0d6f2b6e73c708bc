"""The preview of a dataset of any size."""

from itertools import pairwise

from flows.making.seal import pick_evenly


def test_a_short_run_shows_every_clip():
    assert pick_evenly("abc", 24) == ["a", "b", "c"]


def test_a_long_run_shows_some_from_the_first_to_the_last():
    shown = pick_evenly(range(10_000), 24)
    assert len(shown) == 24 and shown[0] == 0 and shown[-1] == 9_999
    assert max(b - a for a, b in pairwise(shown)) <= 436
