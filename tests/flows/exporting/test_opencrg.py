"""The road surface, read by the specification: Python has no official reader."""

import numpy as np
import pytest

from flows.exporting.opencrg import format_crg
from tasks.surface.road_profile import RoadHazard
from tests.flows.exporting.conftest import HUMP


def read_crg(text):
    """Keywords of the blocks, and heights [u, v], as ASAM OpenCRG 1.1.2 lays them out."""
    head, _, data = text.partition("$" * 80 + "\n")
    blocks = {}
    for line in head.splitlines():
        if line.startswith("$"):
            block = blocks.setdefault(line[1:], []) if len(line) > 1 else []
        else:
            block.append(line)
    words = dict(line.replace(" ", "").split("=") for line in blocks["ROAD_CRG"])
    channels = [line for line in blocks["KD_Definition"] if line.startswith("D:")]
    rows = [[float(line[k : k + 10]) for k in range(0, 80, 10)] for line in data.splitlines()]
    assert all(len(line) == 80 for line in data.splitlines())
    assert len(channels) == len(rows[0])
    return {name: float(value) for name, value in words.items()}, np.array(rows)


@pytest.mark.parametrize("height", [0.075, -0.08])
def test_a_hump_rises_and_a_depression_sinks_at_its_station(height):
    words, heights = read_crg(format_crg(RoadHazard(center_m=18, length_m=2, height_m=height), -3, 40, "a"))
    u = words["REFERENCE_LINE_START_U"] + words["REFERENCE_LINE_INCREMENT"] * np.arange(len(heights))
    assert u[-1] == pytest.approx(words["REFERENCE_LINE_END_U"])
    sides = (words["LONG_SECTION_V_LEFT"] - words["LONG_SECTION_V_RIGHT"]) / words["LONG_SECTION_V_INCREMENT"]
    assert round(sides) + 1 == heights.shape[1]
    phase = np.pi * (u - 18)
    expected = np.where(np.abs(u - 18) <= 1, height / 2 * (1 + np.cos(phase)), 0)
    np.testing.assert_allclose(heights, np.repeat(expected[:, None], 8, axis=1), atol=1e-7)


def test_the_road_of_a_clip_is_what_its_wheels_felt(export, stored):
    words, heights = read_crg(sorted(export("opencrg").glob("*.crg"))[1].read_text())
    u = words["REFERENCE_LINE_START_U"] + words["REFERENCE_LINE_INCREMENT"] * np.arange(len(heights))
    ticks = stored[HUMP].ticks
    assert u[0] < ticks["station"].min() - 2 and u[-1] > ticks["station"].max()
    there = np.interp(ticks["station"], u, heights[:, 3])
    np.testing.assert_allclose(there, ticks["road_height_f"], atol=1e-4)
