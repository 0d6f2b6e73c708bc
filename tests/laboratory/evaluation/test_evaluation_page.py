"""The page of an evaluation: text of users and datasets is text in it."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.evaluation.motion_curves import PITCH, MotionPanel
from studies.evaluation.page import render_page
from studies.evaluation.rows import figure_row
from tests.flows.pages.test_writer import HOSTILE, assert_text_alone


@pytest.mark.parametrize("hostile", HOSTILE)
def test_the_evaluation_takes_labels_as_text(hostile):
    times = np.linspace(0, 1, 5)
    motion = SimpleNamespace(pitch=np.zeros(5))
    clip = SimpleNamespace(
        facts={"label": hostile}, frames={"pitch": np.zeros(5)}, times=times, motions={hostile: motion},
        thumbnails=[np.zeros((4, 6, 3), np.uint8)],
    )  # fmt: skip
    rows = [
        figure_row("pitch_rmse", hostile, hostile, 1.0, "deg", note=hostile),
        figure_row("e_geometry_hump", hostile, hostile, 1.0, "1", floor=0.5, note=hostile),
    ]
    panel = MotionPanel(
        title=hostile, quantity=PITCH, times=times, meant=np.zeros(5), recovered={hostile: np.zeros((2, 5))}
    )
    found = assert_text_alone(render_page([clip], rows, {hostile: [panel]}, hostile, hostile), hostile)
    assert sum(text == hostile for text in found.text) > 5 and found.tags.count("img") == 1
