"""A true mask loses in the road-edit metric only by the metric's own morphology and flow."""

import numpy as np

from benchmarks.road_edit_true_mask import score_true_masks
from tasks.eval.road_edit import RoadEditSettings

SETTINGS = RoadEditSettings()


def strips(heights: list[int]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Still pictures, and outlines of so many rows."""
    noise = np.random.default_rng(1).integers(0, 255, (120, 160, 3)).astype(np.uint8)
    targets = [np.zeros((120, 160), bool) for _ in heights]
    for target, rows in zip(targets, heights, strict=True):
        target[70 : 70 + rows, 40:120] = True
    return [noise] * len(heights), targets


def test_a_true_mask_of_a_still_feature_loses_nothing() -> None:
    score = score_true_masks(*strips([6, 6, 6]), SETTINGS)
    assert (score.localised_edit_rate, score.temporal_iou, score.active_frames) == (1.0, 1.0, 3)
    assert score.anchor_error == 0.0


def test_an_outline_of_fewer_rows_than_the_opening_is_lost_though_it_is_true() -> None:
    """The opening is three rows high; a frame that shows two is active all the same."""
    score = score_true_masks(*strips([2, 6]), SETTINGS)
    assert (score.localised_edit_rate, score.temporal_iou, score.active_frames) == (0.5, 0.0, 2)
    assert score.anchor_error == 0.5
