"""What learned judges say of a dataset's pictures; where their weights are missing, a row that says so."""

from collections.abc import Iterator

import numpy as np

from catalogs.learned_judges import LoadedJudge
from flows.judging.evaluation_rows import figure_row, weather_families
from flows.judging.judged_clip import JudgedClip, Row, View
from tasks.eval.learned_scores import ClipWeather, NeighbourDistance, VideoJudge, WholeVideo
from tasks.eval.severity import severity_agreement

METRICS = {"dover": "dover_overall", "fast_vqa": "fast_vqa", "lpips": "temporal_lpips"}
"""Metric of each judge that scores a clip by itself."""
FEATURES = {"dry": 0, "rain": 1, "snow": 2}
"""Rows of CLIP's text features."""


def learned_rows(view: View, clips: list[JudgedClip], judges: dict[str, LoadedJudge]) -> Iterator[Row]:
    """Scores of each clip, and how CLIP's order of the weathers agrees with their rates.

    Parameters
    ----------
    view : of the dataset
    clips : as the other judges saw them
    judges : from `catalogs.learned_judges.load_judges`
    """
    for name, metric in METRICS.items():
        loaded = judges[name]
        if loaded.network is None:
            yield figure_row(metric, "-", "-", None, "1", note=loaded.note)
            continue
        judge: VideoJudge = (NeighbourDistance if name == "lpips" else WholeVideo)(network=loaded.network)
        for clip in clips:
            value = _score(view, clip, judge)
            yield figure_row(metric, "TorchScript", clip.facts["label"], value, "1", note=loaded.note)
    yield from _severity(view, clips, judges["clip"])


def _severity(view: View, clips: list[JudgedClip], clip_judge: LoadedJudge) -> Iterator[Row]:
    names = ("clip_severity_rho", "clip_adjacent_accuracy")
    if clip_judge.network is None or clip_judge.text_features is None:
        for name in names:
            yield figure_row(name, "-", "-", None, "1", note=clip_judge.note)
        return
    network, features = clip_judge.network, clip_judge.text_features
    for kind, condition, levels in weather_families(clips):
        judge = ClipWeather(
            encode_image=getattr(network, "encode_image", network),
            weather=features[FEATURES[kind]],
            dry=features[FEATURES["dry"]],
        )
        rates = {c.facts["clip_id"]: c.facts["precipitation_mm_h"] for c in levels}
        scores = {c.facts["clip_id"]: _score(view, c, judge) for c in levels}
        rho, _ = severity_agreement(rates, scores)
        # the paper counts pairs whose score rises, whatever the correlation's sign
        rising = np.diff([scores[key] for key in sorted(rates, key=lambda key: rates[key])]) > 0
        for name, value in zip(names, (rho, float(np.mean(rising))), strict=True):
            yield figure_row(name, "TorchScript", condition, value, "1", note=clip_judge.note)


def _score(view: View, clip: JudgedClip, judge: VideoJudge) -> float:
    return judge.score(view.arrays(clip.facts["index"], "rgb")[0])
