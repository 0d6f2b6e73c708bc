"""Learned judges with networks that anyone can check by hand, from TorchScript files made here."""

from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch

from studies.evaluation.learned_judges import load_judges
from studies.evaluation.learned_rows import learned_rows
from studies.evaluation.metrics.learned_scores import (
    CLIP_MEAN,
    CLIP_STD,
    ClipWeather,
    FlowAlignedDistance,
    WholeVideo,
    dover_scores,
)
from tasks.errors import InputError


class MeanColour(torch.nn.Module):
    """Features are the mean colour: white weather is what is white."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x.mean(dim=(2, 3)) + 2.5


class Brightness(torch.nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x.mean()


class TwoSides(torch.nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.stack([x.mean(), -x.mean()])


class SquaredDistance(torch.nn.Module):
    def forward(self, a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        return ((a - b) ** 2).mean()


def make_video(levels) -> np.ndarray:
    """Frames of one grey each."""
    return np.broadcast_to(np.array(levels, np.uint8)[:, None, None, None], (len(levels), 24, 36, 3)).copy()


def save_network(module: torch.nn.Module, path: Path) -> None:
    torch.jit.script(module).save(path)


def test_clip_score_is_the_mean_difference_of_cosines():
    weather, dry = np.array((1.0, 2.0, 2.0)), np.array((3.0, 0.0, 4.0))
    frames = make_video([0, 128, 255])
    expected = []
    for level in (0, 128, 255):
        f = (level / 255 - np.array(CLIP_MEAN)) / np.array(CLIP_STD) + 2.5
        expected.append(f @ (weather / 3 - dry / 5) / np.linalg.norm(f))
    found = ClipWeather(encode_image=torch.jit.script(MeanColour()), weather=weather, dry=dry).score(frames)
    assert found == pytest.approx(np.mean(expected), abs=1e-6)


def test_clip_sees_sixteen_frames_from_first_to_last():
    seen = []

    def encode(pictures):
        seen.append(pictures)
        return torch.ones(len(pictures), 3)

    ClipWeather(encode_image=encode, weather=np.ones(3), dry=np.ones(3)).score(make_video(range(81)))
    assert seen[0].shape == (16, 3, 224, 224)
    back = seen[0][:, 0, 0, 0].numpy() * CLIP_STD[0] + CLIP_MEAN[0]
    np.testing.assert_allclose(back[[0, -1]] * 255, (0, 80), atol=1e-3)


def make_textured(width: int, height: int) -> np.ndarray:
    """Smooth grey noise, uint8 [H, W, 3]."""
    noise = np.random.default_rng(3).uniform(0, 255, (height, width)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 4)
    grey = cv2.normalize(smooth, None, 30, 220, cv2.NORM_MINMAX)
    return np.repeat(grey[..., None], 3, axis=2).astype(np.uint8)


def test_whole_video_judges_see_their_scale():
    assert WholeVideo(network=torch.jit.script(Brightness())).score(make_video([0, 255])) == pytest.approx(
        0.5
    )
    with pytest.raises(InputError, match="it gives 2"):
        WholeVideo(network=lambda x: torch.ones(2)).score(make_video([0, 255]))


def test_dover_fuses_its_raw_scores_as_the_papers_own_rows_of_them_are_fused():
    # paper, visual_quality_full_supp (a), VACE: means of videos, so that their fusion is near the mean fused score
    found = dover_scores((-0.1009, 0.0345))
    assert found["dover_overall"] == pytest.approx(0.3679, abs=0.002)
    assert (found["dover_technical"], found["dover_aesthetic"]) == (-0.1009, 0.0345)
    assert dover_scores((0.2,)) == {"dover_overall": 0.2}
    with pytest.raises(InputError, match="it gives 3"):
        dover_scores((1.0, 2.0, 3.0))


def test_temporal_distance_takes_off_what_moves_and_sees_what_flickers():
    wide = make_textured(300, 160)
    moving = np.stack([wide[:, 3 * k : 3 * k + 240] for k in range(12)])
    distance = FlowAlignedDistance(network=torch.jit.script(SquaredDistance()))
    plain = np.mean((np.diff(moving.astype(float), axis=0) / 127.5) ** 2)
    assert distance.score(moving) < 0.02 * plain
    flicker = np.stack([wide[:, :240] + np.uint8(20 * (k % 2)) for k in range(12)])
    assert distance.score(flicker) == pytest.approx((20 / 127.5) ** 2, rel=0.1)


def test_temporal_distance_looks_at_forty_pairs_in_two_roadside_boxes_that_scale_with_the_frame():
    seen = []

    def network(a, b):
        seen.append((a, b))
        return torch.tensor(float(len(seen) % 2))

    columns = np.broadcast_to(np.arange(240, dtype=np.uint8)[None, :, None], (160, 240, 3))
    assert FlowAlignedDistance(network=network).score(np.stack([columns] * 81)) == 0.5
    assert len(seen) == 2 * 40
    (left, _), (right, _) = seen[:2]
    assert left.shape == right.shape == (1, 3, 90, 75)
    np.testing.assert_allclose(left[0, 0, 0, [0, -1]], np.array((0, 74)) / 127.5 - 1, atol=1e-5)
    np.testing.assert_allclose(right[0, 0, 0, [0, -1]], np.array((165, 239)) / 127.5 - 1, atol=1e-5)
    assert np.isnan(FlowAlignedDistance(network=network).score(columns[None]))


def clips(rates: dict[str, float]) -> list[SimpleNamespace]:
    held = {"initial_speed_km_h": 60.0}
    return [
        SimpleNamespace(facts=held | {
            "clip_id": label, "label": label, "index": k, "weather": label.split("-")[0],
            "precipitation_mm_h": rate, "snow_accumulation_h": 0.0,
        })
        for k, (label, rate) in enumerate(rates.items())
    ]  # fmt: skip


def test_rows_hold_scores_where_there_is_a_checkpoint_and_the_reason_where_there_is_none(
    tmp_path, monkeypatch
):
    save_network(MeanColour(), tmp_path / "clip.pt")
    save_network(Brightness(), tmp_path / "dover.pt")
    np.save(tmp_path / "prompts.npy", np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]))
    (tmp_path / "judges.yaml").write_text(
        "clip: {checkpoint: clip.pt, text_features: prompts.npy, source: made here}\n"
        "dover: {checkpoint: dover.pt, source: made here}\n"
        "lpips: {checkpoint: nowhere.pt, source: made here}\n"
    )
    made = clips({"dry": 0.0, "rain-2": 2.0, "rain-10": 10.0, "rain-50": 50.0})
    levels = [200, 150, 100, 50]
    view = SimpleNamespace(arrays=lambda index, *names: [make_video([levels[index]] * 3)])
    rows = list(learned_rows(view, made, load_judges(tmp_path / "judges.yaml")))
    by_metric = {
        metric: [row for row in rows if row["metric"] == metric] for metric in {r["metric"] for r in rows}
    }
    assert [row["value"] for row in by_metric["dover_overall"]] == pytest.approx([v / 255 for v in levels])
    assert [abs(row["value"]) for row in by_metric["clip_severity_rho"]] == [1.0]
    assert by_metric["clip_adjacent_accuracy"][0]["value"] in (0.0, 1.0)
    assert by_metric["fast_vqa"][0]["note"] == "not run: checkpoint missing"
    assert by_metric["temporal_lpips"][0]["note"] == "not run: checkpoint missing: nowhere.pt"
    assert by_metric["dover_technical"][0]["note"] == "not run: the checkpoint gives the overall score alone"
    for missing in (
        "fast_vqa",
        "temporal_lpips",
        "temporal_lpips_excess",
        "dover_technical",
        "dover_aesthetic",
    ):
        assert [row["value"] for row in by_metric[missing]] == [None]


def test_temporal_lpips_stands_beside_its_excess_over_the_dry_clip_and_dover_beside_its_parts(tmp_path):
    save_network(SquaredDistance(), tmp_path / "lpips.pt")
    save_network(TwoSides(), tmp_path / "dover.pt")
    (tmp_path / "judges.yaml").write_text(
        "lpips: {checkpoint: lpips.pt, source: made here}\ndover: {checkpoint: dover.pt, source: made here}\n"
    )
    steps = [10, 30]
    view = SimpleNamespace(arrays=lambda index, *names: [make_video([100, 100 + steps[index]])])
    rows = list(
        learned_rows(view, clips({"dry": 0.0, "rain-50": 50.0}), load_judges(tmp_path / "judges.yaml"))
    )
    found = {(row["metric"], row["condition"]): row["value"] for row in rows}
    raw = [(step / 127.5) ** 2 for step in steps]
    assert found["temporal_lpips", "dry"] == pytest.approx(raw[0], rel=1e-5)
    assert found["temporal_lpips_excess", "rain-50"] == pytest.approx(raw[1] - raw[0], rel=1e-5)
    assert ("temporal_lpips_excess", "dry") not in found
    assert found["dover_technical", "dry"] == pytest.approx(105 / 255)
    assert found["dover_aesthetic", "dry"] == pytest.approx(-105 / 255)
    assert 0 < found["dover_overall", "dry"] < 1


def test_without_a_list_every_judge_is_missing():
    rows = list(learned_rows(SimpleNamespace(), clips({"dry": 0.0}), load_judges(None)))
    assert {row["metric"] for row in rows} == {
        "clip_severity_rho", "clip_adjacent_accuracy", "dover_overall", "dover_technical", "dover_aesthetic",
        "fast_vqa", "temporal_lpips", "temporal_lpips_excess",
    }  # fmt: skip
    assert all(row["value"] is None and row["note"] == "not run: checkpoint missing" for row in rows)


def test_files_that_are_no_checkpoints_are_told_at_once(tmp_path):
    (tmp_path / "bad.pt").write_text("no weights")
    save_network(MeanColour(), tmp_path / "clip.pt")
    np.save(tmp_path / "two.npy", np.ones((2, 3)))
    (tmp_path / "judges.yaml").write_text(
        "clip: {checkpoint: clip.pt, text_features: two.npy, source: made here}\n"
        "dover: {checkpoint: bad.pt, source: made here}\n"
    )
    with pytest.raises(InputError) as caught:
        load_judges(tmp_path / "judges.yaml")
    assert "two.npy must hold finite features [3, D]" in caught.value.problems[0]
    assert "bad.pt must be a TorchScript module" in caught.value.problems[1]
    (tmp_path / "judges.yaml").write_text("vila: {checkpoint: a.pt, source: x}\n")
    with pytest.raises(InputError, match="vila"):
        load_judges(tmp_path / "judges.yaml")
