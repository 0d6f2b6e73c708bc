"""Road edits and weather severity: what must be seen is seen, and nothing else."""

import cv2
import numpy as np
import pytest

from studies.evaluation.metrics.road_edit import (
    register_background,
    score_road_edit,
    score_true_masks,
    temporal_iou,
)
from studies.evaluation.metrics.severity import measure_image, severity_agreement

DRAW = np.random.Generator(np.random.Philox(4))
GROUND = cv2.GaussianBlur(DRAW.integers(0, 255, (160, 240, 3)).astype(np.uint8), (0, 0), 2.5)
SPOT = np.zeros((160, 240), bool)
SPOT[90:106, 100:150] = True


def shift_picture(picture: np.ndarray, x: float, y: float) -> np.ndarray:
    move = np.array([[1, 0, x], [0, 1, y]], np.float32)
    return cv2.warpAffine(picture, move, picture.shape[1::-1], borderMode=cv2.BORDER_REFLECT)


def edit_picture(picture: np.ndarray, where: np.ndarray) -> np.ndarray:
    return np.where(where[..., None], picture // 3, picture)


def test_an_edit_in_its_place_is_localised_through_a_moved_camera() -> None:
    flat = [GROUND] * 4
    feature = [edit_picture(shift_picture(GROUND, 0.5 * k, -0.4 * k), SPOT) for k in range(4)]
    score = score_road_edit(feature, flat, [SPOT] * 4)
    assert score is not None and score.localised_edit_rate == 1.0
    assert score.anchor_error < 0.02 and score.temporal_iou > 0.8


def test_no_edit_and_an_edit_elsewhere_are_missing() -> None:
    away = np.roll(SPOT, (-70, 60), axis=(0, 1))
    for feature in (GROUND, edit_picture(GROUND, away)):
        score = score_road_edit([feature] * 3, [GROUND] * 3, [SPOT] * 3)
        assert score is not None
        assert (score.localised_edit_rate, score.anchor_error, score.temporal_iou) == (0.0, 1.0, 0.0)


def test_an_edit_of_the_whole_road_shows_in_the_share_outside_alone() -> None:
    """The mask is cut at the dilated target, so the paper's three figures take it for a localised edit."""
    road = np.zeros_like(SPOT)
    road[64:, 24:216] = True
    pair = [edit_picture(GROUND, SPOT)] * 3, [edit_picture(GROUND, road)] * 3
    local, wide = (score_road_edit(feature, [GROUND] * 3, [SPOT] * 3) for feature in pair)
    assert local is not None and wide is not None
    assert wide.localised_edit_rate == 1.0 and wide.anchor_error < 0.05
    assert local.edit_outside == 0.0 and wide.edit_outside > 0.6


def test_where_nothing_changed_there_is_no_share_outside() -> None:
    score = score_road_edit([GROUND] * 2, [GROUND] * 2, [SPOT] * 2)
    assert score is not None and np.isnan(score.edit_outside)


def test_a_target_below_80_pixels_is_not_active() -> None:
    small = np.zeros_like(SPOT)
    small[90:98, 100:109] = True
    assert score_road_edit([GROUND], [GROUND], [small]) is None


def draw_strips(heights: list[int]) -> list[np.ndarray]:
    """Outlines of so many rows."""
    targets = [np.zeros_like(SPOT) for _ in heights]
    for target, rows in zip(targets, heights, strict=True):
        target[70 : 70 + rows, 40:120] = True
    return targets


def test_a_true_mask_of_a_still_feature_loses_nothing() -> None:
    score = score_true_masks([GROUND] * 3, draw_strips([6, 6, 6]))
    assert score is not None
    assert (score.localised_edit_rate, score.temporal_iou, score.active_frames) == (1.0, 1.0, 3)
    assert score.anchor_error == 0.0


def test_a_true_outline_of_fewer_rows_than_the_opening_is_lost() -> None:
    """The opening is three rows high; a frame that shows two is active all the same."""
    score = score_true_masks([GROUND] * 2, draw_strips([2, 6]))
    assert score is not None
    assert (score.localised_edit_rate, score.temporal_iou, score.active_frames) == (0.5, 0.0, 2)
    assert score.anchor_error == 0.5


def test_registration_undoes_a_shift() -> None:
    laid, converged = register_background(shift_picture(GROUND, 2, -1), GROUND, ~SPOT)
    assert converged
    assert np.abs(laid[10:-10, 10:-10].astype(int) - GROUND[10:-10, 10:-10]).mean() < 3


def test_a_mask_that_moves_with_the_picture_keeps_its_overlap() -> None:
    moved = np.roll(SPOT, 3, axis=1)
    assert temporal_iou(SPOT, moved, GROUND, shift_picture(GROUND, 3, 0)) > 0.85
    assert temporal_iou(SPOT, moved, GROUND, GROUND) == pytest.approx(47 / 53, abs=0.01)
    assert temporal_iou(SPOT, 0 * SPOT > 0, GROUND, GROUND) == 0.0


def test_statistics_follow_what_they_are_named_for() -> None:
    road = np.broadcast_to(np.arange(160)[:, None] > 80, (2, 160, 240))
    clear = np.stack([GROUND, GROUND])
    fog = (0.5 * clear + 0.5 * 200).astype(np.uint8)
    a, b = measure_image(clear, road), measure_image(fog, road)
    assert b["dark_channel"] > a["dark_channel"] and b["contrast"] < a["contrast"]
    assert b["road_saturation"] < a["road_saturation"]


def test_severity_counts_ranks_and_neighbours() -> None:
    rates = {"a": 0.0, "b": 10.0, "c": 50.0}
    assert severity_agreement(rates, {"a": 3.0, "b": 2.0, "c": 1.0}) == (pytest.approx(-1.0), 1.0)
    rho, accuracy = severity_agreement(rates, {"a": 1.0, "b": 3.0, "c": 2.0})
    assert (rho, accuracy) == (pytest.approx(0.5), 0.5)
    assert severity_agreement(rates, dict.fromkeys(rates, 1.0)) == (0.0, 0.0)
