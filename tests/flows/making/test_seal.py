"""The preview of a dataset of any size."""

from itertools import pairwise

import numpy as np
import pytest

from flows.making.run_report import RunCost
from flows.making.seal import pick_evenly
from flows.making.summaries import _join, _pack
from flows.store.telemetry import labelled_table


def test_a_short_run_shows_every_clip():
    assert pick_evenly("abc", 24) == ["a", "b", "c"]


def test_a_long_run_shows_some_from_the_first_to_the_last():
    shown = pick_evenly(range(10_000), 24)
    assert len(shown) == 24 and shown[0] == 0 and shown[-1] == 9_999
    assert max(b - a for a, b in pairwise(shown)) <= 436


@pytest.mark.parametrize(
    "values",
    [
        ["dry", "rain", "snow", "ice"],
        ["dry", "rain", None, "ice"],
        [None, None, "orb", "orb"],
        [1.5, 2, None, None],
        [1, 2, 3, 4],
        [True, False, True, True],
        [None] * 4,
    ],
)
def test_a_column_is_the_same_in_one_batch_and_in_two(values):
    one = labelled_table({"x": _join([_pack(values)])})
    two = labelled_table({"x": _join([_pack(values[:2]), _pack(values[2:])])})
    assert two.schema == one.schema
    shown = [
        None if isinstance(value, float) and np.isnan(value) else value for value in two["x"].to_pylist()
    ]
    assert shown == values


def test_the_cost_of_a_run_is_that_of_its_clips_together():
    clips = [
        {"cpu_s": 2.0, "wall_s": 3.0, "peak_memory_mib": 600.0},
        {"cpu_s": 1.0, "wall_s": 1.5, "peak_memory_mib": 500.0},
    ]
    cost = RunCost()
    for clip in clips:
        cost = cost.with_clip(clip)
    assert cost == RunCost(cpu_s=3.0, wall_s=4.5, peak_memory_mib=600.0)
