"""Scores of learned judges for a dataset's pictures; where weights are missing, a row that says so."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.evaluation.clip_prompts import load_prompts
from studies.evaluation.judged_clip import JudgedClip, Row, View
from studies.evaluation.learned_judges import LoadedJudge
from studies.evaluation.metrics.learned_scores import (
    ClipWeather,
    FlowAlignedDistance,
    WholeVideo,
    dover_scores,
)
from studies.evaluation.metrics.severity import severity_agreement
from studies.evaluation.rows import figure_row, find_control, group_weather_families
from tasks.surface.weather import DRY

METRICS = {
    "dover_overall": "dover", "dover_technical": "dover", "dover_aesthetic": "dover", "fast_vqa": "fast_vqa",
    "temporal_lpips": "lpips", "temporal_lpips_excess": "lpips",
    "clip_severity_rho": "clip", "clip_adjacent_accuracy": "clip",
}  # fmt: skip
"""Judge of each metric."""
EXCESS, ORDER = "temporal_lpips_excess", ("clip_severity_rho", "clip_adjacent_accuracy")
"""The metric of a clip against its dry control, and those of a family of clips; any other is of one clip alone."""
METHOD = "TorchScript"


def learned_rows(view: View, clips: list[JudgedClip], judges: dict[str, LoadedJudge]) -> Iterator[Row]:
    """Scores of each clip, and how CLIP's order of the weathers agrees with their rates.

    Parameters
    ----------
    view : of the dataset
    clips : as the other judges saw them
    judges : from `studies.evaluation.learned_judges.load_judges`
    """
    families = list(group_weather_families(clips))
    scores: dict[str, dict[str, float]] = {}
    if any(judge.network is not None for judge in judges.values()):
        for clip in clips:
            kinds = [kind for kind, _, levels in families if clip in levels]
            scores[clip.facts["clip_id"]] = score_pictures(
                view.arrays(clip.facts["index"], "rgb")[0], judges, dict.fromkeys(kinds)
            )
    for clip in clips:
        mine, control = scores.get(clip.facts["clip_id"], {}), find_control(clip, clips, weather=True)
        if control is not None and "temporal_lpips" in mine:
            mine[EXCESS] = mine["temporal_lpips"] - scores[control.facts["clip_id"]]["temporal_lpips"]
    for metric, judge in METRICS.items():
        note = judges[judge].note
        if judges[judge].network is None:
            yield figure_row(metric, "-", "-", None, "1", note=note)
        elif metric not in ORDER:
            yield from _list_scores(metric, clips, scores, note)
        else:
            for kind, condition, levels in families:
                yield _rank_family(metric, condition, levels, f"clip_{kind}", scores, note)


def _list_scores(
    metric: str, clips: list[JudgedClip], scores: Mapping[str, Mapping[str, float]], note: str
) -> Iterator[Row]:
    scored = {clip.facts["label"]: scores[clip.facts["clip_id"]].get(metric) for clip in clips}
    known = {label: value for label, value in scored.items() if value is not None}
    if metric.startswith("dover") and not known:
        yield figure_row(
            metric, "-", "-", None, "1", note="not run: the checkpoint gives the overall score alone"
        )
    for label, value in known.items():
        yield figure_row(metric, METHOD, label, value, "1", note=note)


def _rank_family(
    metric: str, condition: str, levels: Sequence[JudgedClip], name: str,
    scores: Mapping[str, Mapping[str, float]], note: str,
) -> Row:  # fmt: skip
    found = {clip.facts["clip_id"]: scores[clip.facts["clip_id"]].get(name) for clip in levels}
    known = {clip_id: value for clip_id, value in found.items() if value is not None}
    if len(known) < len(levels):
        kind = name.removeprefix("clip_")
        return figure_row(
            metric, METHOD, condition, None, "1", note=f"not run: the catalogue has no CLIP prompts of {kind}"
        )
    rates = {clip.facts["clip_id"]: clip.facts["precipitation_mm_h"] for clip in levels}
    value = dict(zip(ORDER, rank_weathers(rates, known), strict=True))[metric]
    return figure_row(metric, METHOD, condition, value, "1", note=note)


def weather_judge(network: Any, features: Mapping[str, NDArray[np.floating]], kind: str) -> ClipWeather:
    """Return CLIP's judge of one kind of weather.

    Parameters
    ----------
    network : of the pictures, or a module with ``encode_image``
    features : mean text features by kind of weather
    kind : of weather
    """
    return ClipWeather(
        encode_image=getattr(network, "encode_image", network), weather=features[kind], dry=features[DRY]
    )


def rank_weathers(rates: Mapping[str, float], scores: Mapping[str, float]) -> tuple[float, float]:
    """Return Spearman's rank correlation of scores and rates, and the share of neighbouring levels whose score rises.

    The paper counts pairs whose score rises, whatever the correlation's sign.

    Parameters
    ----------
    rates : of each clip [mm/h]
    scores : of the same clips [1]
    """
    rising = np.diff([scores[key] for key in sorted(rates, key=lambda key: rates[key])]) > 0
    return severity_agreement(dict(rates), dict(scores))[0], float(np.mean(rising))


def score_pictures(
    frames: NDArray[np.uint8], judges: Mapping[str, LoadedJudge], kinds: Iterable[str]
) -> dict[str, float]:
    """Return the score of every learned judge that has weights, for the frames of one video.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB
    judges : from `studies.evaluation.learned_judges.load_judges`
    kinds : of weather that CLIP separates from dry: ``clip_KIND`` is its similarity less the dry one
    """
    scores: dict[str, float] = {}
    if (dover := judges["dover"].network) is not None:
        scores |= dover_scores(WholeVideo(network=dover).evaluate_network(frames))
    if (fast := judges["fast_vqa"].network) is not None:
        scores["fast_vqa"] = WholeVideo(network=fast).score(frames)
    if (lpips := judges["lpips"].network) is not None:
        scores["temporal_lpips"] = FlowAlignedDistance(network=lpips).score(frames)
    clip = judges["clip"]
    if clip.network is not None and clip.text_features is not None:
        features = dict(zip(load_prompts(), clip.text_features, strict=True))
        scores |= {
            f"clip_{kind}": weather_judge(clip.network, features, kind).score(frames)
            for kind in kinds
            if kind in features
        }
    return scores
