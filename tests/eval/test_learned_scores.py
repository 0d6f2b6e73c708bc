"""Learned judges with networks that anyone can check by hand, from TorchScript files made here."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from catalogs.learned_judges import load_judges
from flows.judging.learned_rows import learned_rows
from tasks.errors import InputError
from tasks.eval.learned_scores import CLIP_MEAN, CLIP_STD, ClipWeather, NeighbourDistance, WholeVideo


class MeanColour(torch.nn.Module):
    """Features are the mean colour: white weather is what is white."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x.mean(dim=(2, 3)) + 2.5


class Brightness(torch.nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x.mean()


class SquaredDistance(torch.nn.Module):
    def forward(self, a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        return ((a - b) ** 2).mean()


def video(levels) -> np.ndarray:
    """Frames of one grey each."""
    return np.broadcast_to(np.array(levels, np.uint8)[:, None, None, None], (len(levels), 24, 36, 3)).copy()


def save(module: torch.nn.Module, path: Path) -> None:
    torch.jit.script(module).save(path)


def test_clip_score_is_the_mean_difference_of_cosines():
    weather, dry = np.array((1.0, 2.0, 2.0)), np.array((3.0, 0.0, 4.0))
    frames = video([0, 128, 255])
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

    ClipWeather(encode_image=encode, weather=np.ones(3), dry=np.ones(3)).score(video(range(81)))
    assert seen[0].shape == (16, 3, 224, 224)
    back = seen[0][:, 0, 0, 0].numpy() * CLIP_STD[0] + CLIP_MEAN[0]
    np.testing.assert_allclose(back[[0, -1]] * 255, (0, 80), atol=1e-3)


def test_whole_video_and_neighbour_judges_see_their_scales():
    assert WholeVideo(network=torch.jit.script(Brightness())).score(video([0, 255])) == pytest.approx(0.5)
    distance = NeighbourDistance(network=torch.jit.script(SquaredDistance()))
    assert distance.score(video([51, 51, 51])) == 0
    # from -1 to 1: steps of 0.4 and 1.6
    assert distance.score(video([0, 51, 255])) == pytest.approx((0.4**2 + 1.6**2) / 2)


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
    save(MeanColour(), tmp_path / "clip.pt")
    save(Brightness(), tmp_path / "dover.pt")
    np.save(tmp_path / "prompts.npy", np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]))
    (tmp_path / "judges.yaml").write_text(
        "clip: {checkpoint: clip.pt, text_features: prompts.npy, source: made here}\n"
        "dover: {checkpoint: dover.pt, source: made here}\n"
        "lpips: {checkpoint: nowhere.pt, source: made here}\n"
    )
    made = clips({"dry": 0.0, "rain-2": 2.0, "rain-10": 10.0, "rain-50": 50.0})
    levels = [200, 150, 100, 50]
    view = SimpleNamespace(arrays=lambda index, *names: [video([levels[index]] * 3)])
    rows = list(learned_rows(view, made, load_judges(tmp_path / "judges.yaml")))
    by_metric = {
        metric: [row for row in rows if row["metric"] == metric] for metric in {r["metric"] for r in rows}
    }
    assert [row["value"] for row in by_metric["dover_overall"]] == pytest.approx([v / 255 for v in levels])
    assert [abs(row["value"]) for row in by_metric["clip_severity_rho"]] == [1.0]
    assert by_metric["clip_adjacent_accuracy"][0]["value"] in (0.0, 1.0)
    assert by_metric["fast_vqa"][0]["note"] == "not run: checkpoint missing"
    assert by_metric["temporal_lpips"][0]["note"] == "not run: checkpoint missing: nowhere.pt"
    for missing in ("fast_vqa", "temporal_lpips"):
        assert [row["value"] for row in by_metric[missing]] == [None]


def test_without_a_list_every_judge_is_missing():
    rows = list(learned_rows(SimpleNamespace(), clips({"dry": 0.0}), load_judges(None)))
    assert {row["metric"] for row in rows} == {
        "clip_severity_rho", "clip_adjacent_accuracy", "dover_overall", "fast_vqa", "temporal_lpips",
    }  # fmt: skip
    assert all(row["value"] is None and row["note"] == "not run: checkpoint missing" for row in rows)


def test_files_that_are_no_checkpoints_are_told_at_once(tmp_path):
    (tmp_path / "bad.pt").write_text("no weights")
    save(MeanColour(), tmp_path / "clip.pt")
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
